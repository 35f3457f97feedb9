r"""Levenberg-Marquardt with geodesic acceleration for the optimal gait.

M. K. Transtrum, J. P. Sethna (2012), Improvements to the Levenberg-Marquardt algorithm for
nonlinear least-squares minimization.

MuJoCo's contact impedance has a floor, so a sole sphere that enters the contact margin changes the
cost by about 2e-6 of its value at once. A monotone method creeps onto such a jump and stops there.
When no step helps, this one therefore accepts a step that goes uphill by less than a jump, then
changes the step of the finite differences, then perturbs the gait by a hair; it returns the best
gait that it saw. :meth:`~.solver.GaitSolver.decrement` tells afterwards whether that gait is a
smooth minimum.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.optimiser.linearisation import Linearisation, Weighted, weighted
from walking_irl.domains.humanoid.optimiser.normal_equations import Factor, normal_matrix
from walking_irl.domains.humanoid.optimiser.perturbation import perturb
from walking_irl.domains.humanoid.optimiser.ring import KnotOrder
from walking_irl.domains.humanoid.optimiser.stages import Stage
from walking_irl.domains.humanoid.optimiser.transcription import Evaluation, Transcription
from walking_irl.errors import SolverError

FD_STEPS = (1e-7, 3e-8, 1e-6, 1e-8, 1e-5)
"""Steps of the finite differences through inverse dynamics, in the order of trial."""
JUMP = 5e-6
"""Largest relative rise of the cost that a contact jump explains."""
MAX_JUMPS = 6
MAX_PERTURBATIONS = 3
PERTURBATION = np.deg2rad(0.002)
MAX_PERIOD_STEP = 0.1  # [s]
PROBE = 0.1  # fraction of a step at which its curvature is measured

OnStep = Callable[[int, float], None]
"""Told of every iteration: its number and the cost."""


class _State(NamedTuple):
    ev: Evaluation
    cost: float


def linearise(problem: Transcription, x: Array, eps: float = FD_STEPS[0]) -> Linearisation:
    """Derivatives at the gait ``x``, by finite differences of step ``eps``."""
    return Linearisation(problem, *problem.differentiate(x, eps))


class Descent:
    """State of one stage: :meth:`minimise` runs it."""

    def __init__(
        self,
        problem: Transcription,
        order: KnotOrder,
        w: Array,
        s: Stage,
        anchor: Array,
        on_step: OnStep | None = None,
    ) -> None:
        self.problem, self.order, self.w, self.stage = problem, order, w, s
        self.anchor, self.on_step = anchor, on_step
        self.tether = np.full(anchor.size, s.tether)
        self.tether[-2:] *= anchor.size  # L and T concern all knots
        self.rng = np.random.default_rng(0)
        self.damping = 1e-2
        self.fd = 0
        self.failures = self.jumps = self.perturbations = self.small = 0

    def _state(self, x: Array) -> _State:
        ev = self.problem.evaluate(x)
        away = x - self.anchor
        total = ev.total(self.w, self.stage.penalty) + float(away @ (self.tether * away))
        return _State(ev, total / 2)

    def minimise(self, x: Array, passed: list[Array]) -> tuple[Array, int, bool]:
        """Best gait from ``x``, the number of iterations, and whether the end was a stall."""
        at = best = self._state(x)
        if not np.isfinite(at.cost):
            raise SolverError(
                "the gait to start from has no finite cost; start from one of the shipped gaits"
            )
        iteration = 0
        for iteration in range(1, self.stage.max_iter + 1):  # noqa: B007
            found, decrease, is_step = self._step(at)
            if self.on_step is not None:
                self.on_step(iteration, 2 * found.cost)
            if is_step:
                passed.append(found.ev.total_costs())
                self.failures = 0
                self.small = self.small + 1 if decrease < self.stage.tol else 0
            at = found
            if at.cost < best.cost:
                best = at
            if self.small >= 3:
                if self.damping < 1 or not self._can_perturb():
                    break
                at = self._perturbed(best)
            elif self.failures >= 5:
                if not self._can_perturb():
                    break
                at = self._perturbed(best)
        return best.ev.x, iteration, self.damping >= 1

    def _can_perturb(self) -> bool:
        return self.perturbations < MAX_PERTURBATIONS

    def _perturbed(self, best: _State) -> _State:
        self.perturbations += 1
        self.failures = self.small = self.fd = 0
        self.damping = 1e-2
        return self._state(perturb(self.problem.walker, best.ev.x, PERTURBATION, self.rng))

    def _step(self, at: _State) -> tuple[_State, float, bool]:
        """One iteration: the next state, its relative decrease, and whether a step was found."""
        lin = linearise(self.problem, at.ev.x, FD_STEPS[self.fd])
        here = lin.at(self.w, self.stage.penalty)
        normal = normal_matrix(here, self.order)
        g = here.gradient + self.tether * (at.ev.x - self.anchor)
        uphill: _State | None = None
        decrement = np.nan
        for _ in range(15):
            try:
                factor = normal.factor(self.damping, self.tether)
            except np.linalg.LinAlgError:
                self.damping = max(10 * self.damping, 1e-8)
                continue
            dx = -factor.solve(g)
            decrement = -0.5 * float(g @ dx)
            if abs(dx[-1]) > MAX_PERIOD_STEP:
                self.damping = max(5 * self.damping, 1e-8)
                continue
            jdx = here.times(dx).flat()
            bend, ratio = self._acceleration(here, factor, dx, jdx)
            if ratio > 3:
                self.damping = max(3 * self.damping, 1e-8)
                continue
            steps = [dx + bend / 2, dx] if ratio < 0.75 else [dx]
            for s in steps:
                new = self._state(at.ev.x + s)
                if new.cost < at.cost:
                    predicted = -float(g @ dx) - 0.5 * float(jdx @ jdx)
                    self._adapt(
                        at.cost - new.cost, predicted - 0.5 * float(dx @ (self.tether * dx))
                    )
                    return new, (at.cost - new.cost) / at.cost, True
                if uphill is None and new.cost < at.cost * (1 + JUMP):
                    uphill = new
            self.damping = max(4 * self.damping, 1e-8)
        return self._stuck(at, uphill, decrement)

    def _acceleration(
        self, here: Weighted, factor: Factor, dx: Array, jdx: Array
    ) -> tuple[Array, float]:
        """Second-order correction of a step and its size relative to the step."""
        r, ev = here.residuals, self.problem.evaluate(here.lin.evaluation.x + PROBE * dx)
        ahead = weighted(self.problem.stack, ev, self.w, self.stage.penalty).flat()
        curvature = 2 / PROBE * ((ahead - r.flat()) / PROBE - jdx)
        bend = -factor.solve(here.transpose_times(r.like(curvature)))
        return bend, float(2 * np.linalg.norm(bend) / np.linalg.norm(dx))

    def _adapt(self, actual: float, predicted: float) -> None:
        ratio = actual / max(predicted, 1e-300)
        if ratio > 0.6:
            self.damping = max(self.damping / 5, 1e-10)
        elif ratio < 0.2:
            self.damping *= 2

    def _stuck(
        self, at: _State, uphill: _State | None, decrement: float
    ) -> tuple[_State, float, bool]:
        """No step helps: jump uphill, else try another finite-difference step."""
        if uphill is not None and self.jumps < MAX_JUMPS and decrement > 1e-9 * at.cost:
            self.jumps += 1
            self.damping = 1e-3
            self.small = 0
            return uphill, np.nan, False
        self.failures += 1
        self.fd = (self.fd + 1) % len(FD_STEPS)
        self.damping = 10.0 ** (self.failures - 2)
        return at, np.nan, False
