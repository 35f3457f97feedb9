r"""Levenberg-Marquardt with geodesic acceleration for the optimal gait.

M. K. Transtrum, J. P. Sethna (2012), Improvements to the Levenberg-Marquardt algorithm for
nonlinear least-squares minimization.

MuJoCo's contact impedance has a floor, so a sole sphere that enters the contact margin changes the
cost by about 2e-6 of its value at once. A monotone method creeps onto such a jump and stops there.
When no step helps, this one therefore accepts a step that goes uphill by less than a jump, then
changes the step of the finite differences, then shakes the gait by a hair; it returns the best
gait that it saw. :func:`decrement` tells afterwards whether that gait is a smooth minimum.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.costs.objectives import OBJECTIVES
from walking_irl.domains.humanoid.optimiser.linearisation import (
    Linearisation,
    Terms,
    Windows,
    weighted,
)
from walking_irl.domains.humanoid.optimiser.normal_equations import Factor, Fold, normal_matrix
from walking_irl.domains.humanoid.optimiser.transcription import (
    ROOT_PENALTY,
    Evaluation,
    Transcription,
)
from walking_irl.errors import SolverError

FD_STEPS = (1e-7, 3e-8, 1e-6, 1e-8, 1e-5)
"""Steps of the finite differences through inverse dynamics, in the order of trial."""
JUMP = 5e-6
"""Largest relative rise of the cost that a contact jump explains."""
MAX_JUMPS = 6
MAX_SHAKES = 3
SHAKE = np.deg2rad(0.002)
MAX_PERIOD_STEP = 0.1  # [s]
PROBE = 0.1  # fraction of a step at which its curvature is measured
SMOOTH_DECREMENT = 1e-6
"""Undamped Newton decrement below which a gait counts as a smooth minimum."""


class Stage(NamedTuple):
    """One stage of a homotopy in the root penalty."""

    penalty: float
    max_iter: int
    tol: float
    """Relative decrease of the cost that counts as none; three in a row end the stage."""
    tether: float = 0.0
    """Weight of the squared distance from the start of the solve, for starts that do not walk."""


def stage(raw_penalty: float, max_iter: int, tol: float, tether: float = 0.0) -> Stage:
    """Stage with its penalty stated relative to the full one (1e6)."""
    return Stage(ROOT_PENALTY * raw_penalty / 1e6, max_iter, tol, tether)


DIRECT = (stage(1e6, 150, 1e-7),)
"""From a gait of similar weights."""
LADDER = (stage(1e4, 100, 1e-5), stage(1e5, 60, 1e-5), stage(1e6, 150, 1e-6))
"""From a gait of other weights."""


@dataclass
class Solution:
    """A gait found, with the gaits passed on the way.

    Attributes:
        x: Best gait vector.
        folded: Its folded costs G, shape (6,).
        passed: Folded costs of all gaits accepted on the way, shape (n, 6).
        iterations: Iterations of all stages.
        is_stalled: Whether the last stage ended because no step helped.
    """

    x: Array
    folded: Array
    passed: Array
    iterations: int
    is_stalled: bool


class _State(NamedTuple):
    ev: Evaluation
    cost: float


class GaitSolver:
    """Minimises w.G over the gaits of a transcription.

    Attributes:
        problem: The transcription.
    """

    def __init__(self, problem: Transcription) -> None:
        self.problem = problem
        windows = Windows(problem.n_knots, problem.walker.mirror)
        self.fold = Fold(problem.n_knots, problem.nv, windows)

    def solve(
        self,
        w: Array,
        x: Array,
        stages: Sequence[Stage] = DIRECT,
        on_step: Callable[[int, float], None] | None = None,
    ) -> Solution:
        """Best gait for weights ``w`` near the gait ``x``.

        Args:
            w: Weights, shape (6,).
            x: Start, shape (N nv + 2,).
            stages: Homotopy in the root penalty, easiest first.
            on_step: Told of every iteration: its number and the cost.

        Raises:
            SolverError: If the cost of the start is not finite.
        """
        passed: list[Array] = []
        anchor = x
        iterations = 0
        stalled = False
        for s in stages:
            run = _Descent(self, w, s, anchor, on_step)
            x, n, stalled = run.minimise(x, passed)
            iterations += n
        ev = self.problem.evaluate(x)
        return Solution(x, ev.folded(), np.array(passed), iterations, stalled)

    def linearise(self, x: Array, eps: float = FD_STEPS[0]) -> Linearisation:
        """Derivatives at the gait ``x``."""
        return Linearisation(self.problem, *self.problem.differentiate(x, eps))

    def decrement(self, w: Array, lin: Linearisation) -> float:
        r"""Undamped relative Newton decrement :math:`g^T H^{-1} g / 2J` of a gait.

        Below 1e-8 the gait is a smooth minimum; above 1e-5 it sits on a contact jump, where
        derivatives and sensitivities mean nothing.
        """
        g = lin.gradient(w, ROOT_PENALTY)
        step = self._undamped(w, lin).solve(g)
        return float(g @ step / lin.evaluation.total(w, ROOT_PENALTY))

    def sensitivity(self, w: Array, lin: Linearisation) -> tuple[Array, Array]:
        r"""Gauss-Newton sensitivities of an optimal gait to its weights.

        Returns:
            d mu / d w = :math:`g^T (2 J^T J)^{-1} g`, symmetric positive semi-definite, shape
            (6, 6), with g the gradients of the six folded costs; and dx / dw, (N nv + 2, 6).
        """
        unit = np.eye(len(OBJECTIVES))
        g = np.column_stack([2 * lin.gradient(e, ROOT_PENALTY) for e in unit])
        y = self._undamped(w, lin).solve(g) / 2
        m = g.T @ y
        return (m + m.T) / 2, -y

    def _undamped(self, w: Array, lin: Linearisation) -> Factor:
        return normal_matrix(lin, self.fold, w, ROOT_PENALTY).factor(1e-9)

    def shake(self, x: Array, amplitude: float, rng: np.random.Generator) -> Array:
        """Smooth random change of the joint angles that keeps the mirror symmetry.

        Args:
            x: Gait vector.
            amplitude: Standard deviation of the first harmonic [rad].
            rng: Source of randomness.
        """
        p = self.problem
        q = x[:-2].reshape(p.n_knots, p.nv).copy()
        phase = np.arange(p.n_knots) / (2 * p.n_knots)
        names = p.walker.joints
        for j, name in enumerate(names):
            if j < p.walker.n_root or not name.endswith("_r"):
                continue
            c = rng.normal(size=(2, 3)) * amplitude / np.arange(1, 4)
            q[:, j] += _harmonics(c, phase)
            q[:, names.index(name[:-2] + "_l")] += _harmonics(c, phase + 0.5)
        return np.concatenate([q.ravel(), x[-2:]])


def _harmonics(c: Array, phase: Array) -> Array:
    angle = 2 * np.pi * np.outer(phase, np.arange(1, c.shape[1] + 1))
    return np.asarray(np.cos(angle) @ c[0] + np.sin(angle) @ c[1])


class _Descent:
    """State of one stage."""

    def __init__(
        self,
        solver: GaitSolver,
        w: Array,
        s: Stage,
        anchor: Array,
        on_step: Callable[[int, float], None] | None,
    ) -> None:
        self.solver, self.problem, self.w, self.stage = solver, solver.problem, w, s
        self.on_step = on_step
        self.anchor = anchor
        self.tether = np.full(anchor.size, s.tether)
        self.tether[-2:] *= anchor.size  # L and T concern all knots
        self.rng = np.random.default_rng(0)
        self.damping = 1e-2
        self.fd = 0
        self.failures = self.jumps = self.shakes = self.small = 0

    def state(self, x: Array) -> _State:
        ev = self.problem.evaluate(x)
        away = x - self.anchor
        total = ev.total(self.w, self.stage.penalty) + float(away @ (self.tether * away))
        return _State(ev, total / 2)

    def minimise(self, x: Array, passed: list[Array]) -> tuple[Array, int, bool]:
        at = best = self.state(x)
        if not np.isfinite(at.cost):
            raise SolverError(
                "the gait to start from has no finite cost; start from one of the shipped gaits"
            )
        iteration = 0
        for iteration in range(1, self.stage.max_iter + 1):  # noqa: B007
            found, decrease, is_step = self.step(at)
            if self.on_step is not None:
                self.on_step(iteration, 2 * found.cost)
            if is_step:
                passed.append(found.ev.folded())
                self.failures = 0
                self.small = self.small + 1 if decrease < self.stage.tol else 0
            at = found
            if at.cost < best.cost:
                best = at
            if self.small >= 3:
                if self.damping < 1 or not self.can_shake():
                    break
                at = self.shaken(best)
            elif self.failures >= 5:
                if not self.can_shake():
                    break
                at = self.shaken(best)
        return best.ev.x, iteration, self.damping >= 1

    def can_shake(self) -> bool:
        return self.shakes < MAX_SHAKES

    def shaken(self, best: _State) -> _State:
        self.shakes += 1
        self.failures = self.small = self.fd = 0
        self.damping = 1e-2
        return self.state(self.solver.shake(best.ev.x, SHAKE, self.rng))

    def step(self, at: _State) -> tuple[_State, float, bool]:
        """One iteration: the next state, its relative decrease, and whether a step was found."""
        lin = self.solver.linearise(at.ev.x, FD_STEPS[self.fd])
        w, penalty = self.w, self.stage.penalty
        normal = normal_matrix(lin, self.solver.fold, w, penalty)
        r = weighted(at.ev, w, penalty)
        pull = self.tether * (at.ev.x - self.anchor)
        g = lin.transpose_times(r, w, penalty) + pull
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
            jdx = lin.times(dx, w, penalty).flat()
            bend, ratio = self.acceleration(lin, factor, at, r, dx, jdx)
            if ratio > 3:
                self.damping = max(3 * self.damping, 1e-8)
                continue
            steps = [dx + bend / 2, dx] if ratio < 0.75 else [dx]
            for s in steps:
                new = self.state(at.ev.x + s)
                if new.cost < at.cost:
                    predicted = -float(g @ dx) - 0.5 * float(jdx @ jdx)
                    self.adapt(at.cost - new.cost, predicted - 0.5 * float(dx @ (self.tether * dx)))
                    return new, (at.cost - new.cost) / at.cost, True
                if uphill is None and new.cost < at.cost * (1 + JUMP):
                    uphill = new
            self.damping = max(4 * self.damping, 1e-8)
        return self.stuck(at, uphill, decrement)

    def acceleration(
        self, lin: Linearisation, factor: Factor, at: _State, r: Terms, dx: Array, jdx: Array
    ) -> tuple[Array, float]:
        """Second-order correction of a step and its size relative to the step."""
        w, penalty = self.w, self.stage.penalty
        ahead = weighted(self.problem.evaluate(at.ev.x + PROBE * dx), w, penalty).flat()
        curvature = 2 / PROBE * ((ahead - r.flat()) / PROBE - jdx)
        bend = -factor.solve(lin.transpose_times(r.like(curvature), w, penalty))
        return bend, float(2 * np.linalg.norm(bend) / np.linalg.norm(dx))

    def adapt(self, actual: float, predicted: float) -> None:
        ratio = actual / max(predicted, 1e-300)
        if ratio > 0.6:
            self.damping = max(self.damping / 5, 1e-10)
        elif ratio < 0.2:
            self.damping *= 2

    def stuck(
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
