r"""Cutting-Plane Inverse Reinforcement Learning (S. Balloccu, Politecnico di Milano).

An expert that is optimal for hidden weights w_E beats every policy under them, so every policy
evaluated cuts the simplex of weights: :math:`(\mu_i - \mu_E) \cdot w \le 0`. The algorithm asks for
the best policy at the centre of what is left, cuts, and repeats. It is the cutting-plane method for
the convex regret :math:`f(w) = V(w) - w \cdot \mu_E`, whose minimum is 0 at w_E; near it, a domain
with sensitivities allows Newton steps on f instead of centres.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import replace
from typing import Any

import numpy as np

from walking_irl.archive import Archive
from walking_irl.centres import centre_rule
from walking_irl.certificates import game_lp
from walking_irl.errors import EmptyPolyhedronError, InvalidInputError
from walking_irl.estimate import NoiseCorrection
from walking_irl.newton import NewtonRule, Step, extremes
from walking_irl.polyhedron import WeightPolyhedron
from walking_irl.types import Array, Expert, Forward, Iteration, Response, Rule, Status

MODES = ("optimal", "set", "minimise")
WEIGHT_TOL = 2e-4
"""L1 length of a Newton step below which the estimate of the weights stands."""
FLOOR = 2e-5
"""Relative regret that poor steps may leave: what the demonstration itself lacks."""
SLACK = 2e-4
"""How far a Newton query may lie outside the polyhedron, relative to the expert's return."""
POOR_STEPS = 2

Measure = Callable[[Any], tuple[Array, Array]]


def cpirl(
    forward: Forward,
    expert: Expert,
    *,
    rng: np.random.Generator,
    centre: str = "ac",
    mode: str = "optimal",
    tol: float = 1e-6,
    max_solves: int = 40,
    min_weight: float = 0.0,
    has_newton: bool = True,
    has_probes: bool = False,
    measure: Measure | None = None,
    executor: Executor | None = None,
) -> Iterator[Iteration]:
    """Shrink the simplex of weights around those that explain the expert.

    Args:
        forward: Best policy for weights, with its feature expectations.
        expert: What is known of the expert; never its weights.
        rng: Source of randomness of sampling centres.
        centre: Which centre is queried: "ac", "cg", "mvie" or "cc".
        mode: "optimal": the expert is optimal and cuts are at level 0 (Algorithm 2); "set": at
            level ``tol``, for one weight vector under which the expert is that close to optimal
            (Theorem A3); "minimise": at the best regret so far, for sub-optimal experts.
        tol: Regret that counts as none, relative to the expert's return.
        max_solves: Budget of forward solves, probes left aside.
        min_weight: Lower bound of every weight.
        has_newton: Whether responses with sensitivities lead to Newton steps.
        has_probes: Whether to finish with 2K solves at the predicted extremes of the weights that
            the expert's suboptimality leaves possible: they tighten the intervals.
        measure: Re-measures a learner's policy as the expert was measured: mean feature
            expectations (K,) and their covariance (K, K). Removes the bias of noisy experts.
        executor: Runs the probes side by side.

    Yields:
        One iteration per forward solve; the last but the probes has a status other than CUT.

    Raises:
        InvalidInputError: If an argument is out of range, or a response has the wrong shape.
    """
    search = _Search(expert, centre, mode, tol, min_weight, has_newton, measure, rng)
    query = search.first()
    for k in range(max_solves):
        polyhedron, w, rule = query
        response = forward(w)
        before = search.best_regret()
        search.add(w, response)
        status, query = search.decide(w, rule, before)
        if status is Status.CUT and k == max_solves - 1:
            status = Status.BUDGET
        last = search.iteration(k, polyhedron, w, rule, response, status)
        yield last
        if status is not Status.CUT:
            break
    if has_probes and status is Status.CONVERGED or status is Status.MATCHED and has_probes:
        yield from search.probes(forward, last, executor)


class _Search:
    """State of a run: the archive, the two rules for the next query, and when to stop."""

    def __init__(
        self,
        expert: Expert,
        centre: str,
        mode: str,
        tol: float,
        min_weight: float,
        has_newton: bool,
        measure: Measure | None,
        rng: np.random.Generator,
    ) -> None:
        if mode not in MODES:
            raise InvalidInputError(f"unknown mode {mode!r}; choose from {', '.join(MODES)}")
        self.archive = Archive(expert, min_weight)
        self.centre, self.mode, self.tol, self.rng = centre_rule(centre), mode, tol, rng
        self.is_estimated = expert.covariance is not None
        self.newton = NewtonRule(min_weight, self.is_estimated) if has_newton else None
        self.correction = NoiseCorrection(expert, measure) if self.is_estimated else None
        self.min_weight = min_weight
        self.poor = 0
        self.step: Step | None = None

    def first(self) -> tuple[WeightPolyhedron, Array, Rule]:
        P = self.archive.polyhedron()
        return P, self.centre(P, rng=self.rng).w, Rule.CENTRE

    def best_regret(self) -> float:
        return float(min(self.archive.relative_regrets(), default=np.inf))

    def add(self, w: Array, response: Response) -> None:
        if response.mu.shape != self.archive.mu_E.shape or not np.isfinite(response.mu).all():
            raise InvalidInputError(
                f"the forward solver must return {self.archive.mu_E.size} finite feature "
                f"expectations, got {response.mu}"
            )
        self.archive.add(w, response)

    def level(self) -> float:
        """Regret above which a weight vector is cut away."""
        best = max(0.0, min(self.archive.regret(q.w) for q in self.archive.queries))
        if self.mode == "minimise" or (self.correction and not self.correction.is_done):
            return 1.25 * best if self.correction else best
        return self.tol * self.archive.scale(self.archive.queries[-1].w) * (self.mode == "set")

    def decide(
        self, w: Array, rule: Rule, before: float
    ) -> tuple[Status, tuple[WeightPolyhedron, Array, Rule]]:
        """Why to stop, or CUT and the next query."""
        archive = self.archive
        q, regret = archive.queries[-1], archive.regret(w) / archive.scale(w)
        if rule is Rule.NEWTON:
            self.poor = self.poor + 1 if regret > 0.9 * before else 0
        self.step = self.newton.step(archive) if self.newton else None
        here = (archive.polyhedron(self.level()), w, rule)
        if self.correction and self.step:
            if self.correction.update(archive, self.step) and self.newton:
                self.step = self.newton.step(archive)
            if self.step and self.correction.has_settled(self.step):
                return Status.CONVERGED, here
        elif regret <= self.tol and not archive.is_demonstration(q) and not self.correction:
            return Status.MATCHED, here
        elif self.step and self.step.length <= WEIGHT_TOL:
            return Status.CONVERGED, here
        elif self.poor >= POOR_STEPS and self.best_regret() <= FLOOR:
            return Status.CONVERGED, here
        if self.mode == "minimise":
            ended = self._minimised()
            if ended is not None:
                return ended, here
        return self._next(here[0], w)

    def _minimised(self) -> Status | None:
        """Endings of the search for the smallest regret of a sub-optimal expert."""
        archive = self.archive
        game = game_lp(archive.differences)
        scale = archive.scale(archive.queries[-1].w)
        if any(archive.dominates(q.mu) for q in archive.queries):
            return Status.DOMINATED
        if game.value <= -1e-9 * scale:
            return Status.MIXTURE_DOMINATES
        best = min(archive.regret(q.w) for q in archive.queries)
        return Status.GAP_CLOSED if best + game.value <= self.tol * scale else None

    def _next(
        self, P: WeightPolyhedron, w: Array
    ) -> tuple[Status, tuple[WeightPolyhedron, Array, Rule]]:
        if self.step is not None and self.poor < POOR_STEPS:
            v = self.step.w
            rows = self.archive.differences - self.archive.slack - self.level()
            if self.correction or np.max(rows @ v) <= SLACK * self.archive.scale(v):
                return Status.CUT, (P, v, Rule.NEWTON)
        self.poor = 0
        try:
            v = self.centre(P, rng=self.rng).w
        except EmptyPolyhedronError as error:
            is_flat = abs(error.radius) <= 1e-7
            return (Status.MIXTURE_DOMINATES if is_flat else Status.EMPTY), (P, w, Rule.CENTRE)
        stalled = float(np.abs(v - w).max()) <= 1e-10
        return (Status.STALLED if stalled else Status.CUT), (P, v, Rule.CENTRE)

    def iteration(
        self,
        k: int,
        polyhedron: WeightPolyhedron,
        w: Array,
        rule: Rule,
        response: Response,
        status: Status,
    ) -> Iteration:
        archive = self.archive
        return Iteration(
            k=k,
            polyhedron=polyhedron,
            w=w,
            rule=rule,
            response=response,
            regret=archive.regret(w),
            best_regret=min(archive.regret(q.w) for q in archive.queries),
            certificate=game_lp(archive.differences).value,
            intervals=self.intervals(),
            estimate=self.estimate(),
            status=status,
        )

    def estimate(self) -> Array:
        """One more Newton step from the best query, else that query itself."""
        if self.step is not None:
            return self.step.w
        return self.archive.queries[int(np.argmin(self.archive.relative_regrets()))].w

    def intervals(self) -> Array:
        """Bounds of each weight, (K, 2): by the cuts, or by error bars once noise is removed."""
        if self.correction and self.correction.is_done and self.step:
            return self.correction.intervals(self.step)
        try:
            return self.archive.polyhedron(self.level()).intervals()
        except EmptyPolyhedronError:
            return np.full((len(self.archive.mu_E), 2), np.nan)

    def probes(
        self, forward: Forward, last: Iteration, executor: Executor | None
    ) -> Iterator[Iteration]:
        """Solves at the predicted extremes of the weights that explain the expert."""
        if self.step is None:
            return
        centre = self.estimate()
        tolerance = float(np.mean(self.archive.slack))
        W = extremes(centre, self.step.hessian, tolerance, self.min_weight)
        answers = executor.map(forward, W) if executor else map(forward, W)
        for k, (w, response) in enumerate(zip(W, answers, strict=True), start=last.k + 1):
            polyhedron = self.archive.polyhedron(self.level())
            self.add(w, response)
            it = self.iteration(k, polyhedron, w, Rule.PROBE, response, Status.PROBE)
            yield replace(it, estimate=centre, best_regret=last.best_regret)
