"""How CPIRL chooses its next query: a centre of the polyhedron, or a Newton step on the regret."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.bundle import Archive
from walking_irl.cpirl.gauge import SAME, gauge_fixed
from walking_irl.cpirl.modeller import Model, Modeller
from walking_irl.cpirl.newton import Step, standard_errors
from walking_irl.errors import EmptyPolyhedronError, FlatPolyhedronError
from walking_irl.geometry.centres.centre import CentreRule
from walking_irl.geometry.game import game_lp
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.types import Mode, Rule, Status

Measure = Callable[[Any], tuple[Array, Array]]

NEWTON_GAP = 0.02
"""Newton's method takes over once the best regret is within this of optimal, relative."""
SLACK = 2e-4
"""By how much, relative to |w.mu_E|, a Newton query may miss a cut."""
FLOOR = 2e-5
"""Relative regret below which poor Newton steps mean the demonstration's own gap is reached."""
BIAS_MARGIN = 1.25
"""Share of the best regret that a noisy expert's bias may explain."""
CLEARLY_WORSE = 2e-4
"""Relative rise of the regret that noise does not explain."""
LONGEST_STEP = 0.3
"""Longest Newton step (L1) where min f is not known to be 0."""
MEASURE_WITHIN, MEASURE_AGAIN, MOST_MEASUREMENTS = 0.1, 0.01, 2
"""A learner's policy is measured once the step is below the first (L1), again if it moves."""


@dataclass(frozen=True)
class Tolerances:
    """When CPIRL is done: relative regret, and the length (L1) of a step in the weights."""

    regret: float
    step: float
    secant: float


class Decision(NamedTuple):
    """What to do next: the query (None at the end), its rule, and what is believed now."""

    w: Array | None
    rule: Rule
    estimate: Array
    status: Status


class Guide:
    """Chooses queries from an archive; knows nothing of the forward solver."""

    def __init__(
        self,
        archive: Archive,
        centre: CentreRule,
        mode: Mode,
        tolerances: Tolerances,
        measure: Measure | None,
        rng: np.random.Generator,
    ) -> None:
        self.archive, self.mode, self.tolerances = archive, mode, tolerances
        self.measure, self.rng = measure, rng
        self.is_exact = archive.covariance is None
        self.model: Model | None = None
        self._centre = centre
        self._models = Modeller(archive, tolerances.secant)
        self._n_poor = self._n_nudges = 0
        self._best_before = np.inf
        self._measured: list[Array] = []
        self._steps: list[float] = []

    def lift(self) -> Array:
        """Level of the weights that explain the expert: 0, sigma ('set'), or the best regret.

        The best regret in 'minimise', and where noise may have made the expert look worse than it
        is.
        """
        archive = self.archive
        if self.mode == "set":
            return self.tolerances.regret * np.abs(archive.mu)
        if (self.mode == "minimise" or not self.is_exact) and archive.responses:
            f = float(archive.robust_regrets(archive.W).min())
            margin = 1.0 if self.mode == "minimise" else BIAS_MARGIN
            return np.full(archive.K, margin * max(f, 0.0))
        return np.zeros(archive.K)

    def probe_lift(self, level: float) -> Array:
        """Level at which intervals are probed: ``level``, relative, and never below the cuts'."""
        own, wanted = self.lift(), level * np.abs(self.archive.mu)
        both: Array = own + wanted if self.mode == "minimise" else np.maximum(own, wanted)
        return both

    def polyhedron(self) -> WeightPolyhedron:
        """Weights among which the next query is sought.

        In 'minimise' those that may still lower the regret, be it below 0, as the corner of noisy
        features allows; the expert's own gap is no reason to ask anywhere else.
        """
        archive = self.archive
        if self.mode == "minimise" and archive.responses:
            f = float(archive.robust_regrets(archive.W).min())
            return archive.polyhedron(np.full(archive.K, f - archive.expert.suboptimality))
        return archive.polyhedron(self.lift())

    def start(self) -> Array:
        """First query: the centre of all weights."""
        return self._centre(self.polyhedron(), rng=self.rng).w

    def decide(self, rule: Rule) -> Decision:
        """Next query after the newest response, whose query was chosen by ``rule``."""
        self.model = self._models.fit(self._relative_regrets()) if self._is_near() else None
        status = self._stop_on_regret()
        if status is not None:
            return Decision(None, rule, self._estimate(), status)
        if self.model is not None:
            decision = self._newton(rule)
            if decision is not None:
                return decision
        return self._kelley() or self._next_centre()

    def _relative_regrets(self) -> Array:
        W = self.archive.W
        scale = np.maximum(self.archive.scale(W), 1e-300)
        relative: Array = self.archive.regrets(W) / scale
        if self.archive.has_gauge():  # f is linear from 0 at 1/K outwards
            distance = 1.0 - self.archive.K * W.min(axis=1)
            relative = np.where(distance > SAME, relative / np.maximum(distance, SAME), np.inf)
        return relative

    def _lower_bound(self) -> float:
        """Lower bound on min f, relative: 0 for an optimal expert."""
        if self.mode != "minimise":
            return 0.0
        value = self.archive.game().value
        return -value / max(float(np.abs(self.archive.mu).max()), 1e-300)

    def _is_near(self) -> bool:
        known = [r.sensitivity for r in self.archive.responses if r.sensitivity is not None]
        if not known:
            return False
        if self.model is not None and not self.is_exact:
            return True
        W, archive = self.archive.W, self.archive
        is_noise = not self.is_exact and float(archive.robust_regrets(W).min()) <= 0.0
        return is_noise or float(self._relative_regrets().min()) - self._lower_bound() <= NEWTON_GAP

    def _estimate(self) -> Array:
        """Minimum of the model where the policies found do not speak against it, or best query."""
        archive = self.archive
        f = self._relative_regrets()
        best: Array = archive.W[int(np.argmin(f))]
        if self.model is None:
            return best
        k, _, step = self.model
        v = step.w
        if self.is_exact:
            v = self._guarded(archive.W[k], step, float(f[k] * archive.scale(archive.W[k])))
        allowed = max(float(f.min()), 0.0) + (SLACK if self.is_exact else NEWTON_GAP)
        is_plausible = archive.regrets(v[None])[0] <= allowed * archive.scale(v)
        return v if is_plausible else best

    def _stop_on_regret(self) -> Status | None:
        """Stops that need no model: dominance, a match, a closed gap."""
        archive, tol = self.archive, self.tolerances.regret
        d = archive.differences()
        scale = max(float(np.abs(archive.mu).max()), 1e-300)
        if self.mode == "minimise":
            asked = d[: len(archive.responses)]  # of the others no policy is kept
            is_above = (asked >= 0.0).all(axis=1) & (asked.max(axis=1) > tol * scale)
            if is_above.any():
                return Status.DOMINATED
            if self.model is None or not self.is_exact:
                f = float(archive.robust_regrets(archive.W).min())
                t = game_lp(d).value
                has_mixture = t < -tol * scale
                # Near the minimum features err by the gap's square root: for one policy to beat
                # the expert as the mixture does, the gap must close relative to its advantage.
                unit = -t if has_mixture and self.is_exact else scale
                if f + archive.game().value <= tol * unit:
                    return Status.MIXTURE_DOMINATES if has_mixture else Status.GAP_CLOSED
            return None
        w: Array | None = archive.W[-1]
        if archive.has_gauge() and not archive.is_match()[-1]:
            w = gauge_fixed(archive.W[-1])
        if w is None:  # uniform weights explain every expert
            return None
        is_trusted = self.is_exact and not archive.error.any()
        is_trusted = is_trusted and archive.expert.suboptimality == 0.0
        slack = archive.error + archive.expert.suboptimality
        if is_trusted or self.model is not None:
            slack = np.zeros(archive.K)
        f = float(archive.values(w) - w @ (archive.mu + slack))
        is_suspect = self.model is not None and bool(archive.is_match()[-1])
        is_matched = f <= tol * float(archive.scale(w)) and not is_suspect
        if is_matched and (self.model is None or self.is_exact):
            return Status.MATCHED
        return None

    def _newton(self, rule: Rule) -> Decision | None:
        """Newton query, or the end; None where a centre must be tried instead."""
        assert self.model is not None
        if not self.is_exact:
            return self._newton_estimated(rule)
        archive, tol = self.archive, self.tolerances
        f = self._relative_regrets()
        is_poor = rule is Rule.NEWTON and float(f[-1]) > 0.9 * self._best_before
        self._n_poor = self._n_poor + 1 if is_poor else (0 if rule is Rule.NEWTON else self._n_poor)
        self._best_before = float(f.min())
        best, _, step = self.model
        w = archive.W[best]
        if self._n_poor >= 2 and self._best_before - self._lower_bound() <= FLOOR:
            return Decision(None, rule, self._estimate(), Status.CONVERGED)
        v = self._guarded(w, step, float(f[best] * archive.scale(w)))
        if np.abs(v - w).sum() <= tol.step and not archive.is_match()[best]:
            return Decision(None, rule, self._estimate(), Status.CONVERGED)
        is_asked = np.abs(archive.W - v).sum(axis=1) <= tol.step
        if bool((is_asked & archive.is_match()).any()):  # nothing beats the demonstration there
            return Decision(None, rule, v, Status.CONVERGED)
        if self._n_poor >= 2 or archive.is_match()[best]:
            self._n_poor = 0
            return None
        rows = archive.rows(self.lift())
        if float((rows @ v).max()) > SLACK * float(archive.scale(v)):
            return None
        return Decision(v, Rule.NEWTON, self._estimate(), Status.CUT)

    def _guarded(self, w: Array, step: Step, regret: float) -> Array:
        """Shorten a step that promises more than f, whose minimum is known to be 0."""
        move = step.w - w
        if self.mode != "minimise":
            ratio = step.decrease / max(regret, 1e-12 * float(self.archive.scale(w)))
            return w + move / ratio if ratio > 3.0 else step.w
        length = float(np.abs(move).sum())
        return w + move * min(1.0, LONGEST_STEP / max(length, 1e-300))

    def _newton_estimated(self, rule: Rule) -> Decision | None:
        """As :meth:`_newton` where mu_E is a sample mean: f may pass below 0, cuts say less."""
        archive = self.archive
        is_new = self._measure_defect()
        assert self.model is not None and archive.covariance is not None
        best, B, step = self.model
        w = archive.W[best]
        length = float(np.abs(step.w - w).sum())
        self._steps.append(length)
        noise = 0.5 * float(standard_errors(B, archive.covariance).sum())
        is_measured = self.measure is None or bool(self._measured)
        has_stalled = (
            len(self._steps) >= 4
            and not is_new
            and min(self._steps[-2:]) > 0.7 * min(self._steps[:-2])
        )
        if is_measured and (length <= max(self.tolerances.step, noise) or has_stalled):
            return Decision(None, Rule.NEWTON, self._estimate(), Status.CONVERGED)
        f = self._relative_regrets()
        is_poor = rule is Rule.NEWTON and float(f[-1] - f[:-1].min()) > CLEARLY_WORSE
        self._n_poor = self._n_poor + 1 if is_poor else 0
        if self._n_poor >= 2:
            self._n_poor = 0
            return None
        share = min(1.0, LONGEST_STEP / max(length, 1e-300)) * 0.5**self._n_poor
        v = w + (step.w - w) * share
        if np.abs(self.archive.W - v).sum(axis=1).min() <= 1e-9:  # asked before: learn elsewhere
            return None
        return Decision(v, Rule.NEWTON, self._estimate(), Status.CUT)

    def _measure_defect(self) -> bool:
        """Measure the best policy as the expert was measured, and correct the expert by it."""
        assert self.model is not None
        best, _, step = self.model
        w = self.archive.W[best]
        if self.measure is None or len(self._measured) >= MOST_MEASUREMENTS:
            return False
        if np.abs(step.w - w).sum() >= MEASURE_WITHIN:
            return False
        if self._measured and np.abs(w - self._measured[-1]).sum() <= MEASURE_AGAIN:
            return False
        response = self.archive.responses[best]
        mean, covariance = self.measure(response.policy)
        self.archive.correct(mean - response.mu, covariance)
        self._measured.append(w)
        self.model = self._models.fit(self._relative_regrets())
        return True

    def _kelley(self) -> Decision | None:
        """Where the policies found leave the least regret, if the newest is one that was known.

        Levels shrink towards the minimum for ever where few policies meet in it; there the policies
        that are known either close the gap or are joined by a new one.
        """
        archive = self.archive
        M, W = archive.M, archive.W
        if self.mode != "minimise" or not len(M[:-1]):
            return None
        if np.abs(M[:-1] - M[-1]).max(axis=1).min() > 1e-12 * float(np.abs(archive.mu).max()):
            return None
        w = archive.game().w
        if np.abs(W - w).max(axis=1).min() <= 1e-9:
            return None
        return Decision(w, Rule.KELLEY, self._estimate(), Status.CUT)

    def _next_centre(self) -> Decision:
        """Centre of the polyhedron, or the status that says why there is none."""
        try:
            w = self._centre(self.polyhedron(), rng=self.rng).w
        except FlatPolyhedronError:  # all that is left is about one point, or one face
            w = self._estimate() if self.model is not None else self.archive.game().w
            return Decision(None, Rule.CENTRE, w, Status.GAP_CLOSED)
        except EmptyPolyhedronError:
            t = game_lp(self.archive.differences()).value
            dominates = t < -1e-8 * float(np.abs(self.archive.mu).max())
            status = Status.MIXTURE_DOMINATES if dominates else Status.EMPTY
            return Decision(None, Rule.CENTRE, self._estimate(), status)
        estimate = w if self.model is None and self.mode != "minimise" else self._estimate()
        if np.abs(self.archive.W - w).max(axis=1).min() <= 1e-9:  # the centre repeats itself
            self._n_nudges += 1
            if self._n_nudges > 2:
                return Decision(None, Rule.CENTRE, estimate, Status.STALLED)
            v = self.rng.dirichlet(np.ones(self.archive.K))
            corner = self.polyhedron().support(v - v.mean())[1]
            w = 0.8 * w + 0.2 * corner
        return Decision(w, Rule.CENTRE, estimate, Status.CUT)
