r"""Newton's method for the optimal gait, one stage: exact Hessian, dual estimates, corrections.

The root forces c(x) are penalised by rho |c|^2. Far from the minimum rho c(x) is a wild guess of
their multipliers and makes the Hessian indefinite; it is built with a *dual estimate* instead,
y = rho (c + A dx) of the last accepted step (A = dc/dx), the primal-dual form of the penalty method
(J. Nocedal, S. Wright 2006, Numerical Optimization, section 17.1). Steps leave the curved valley
c(x) = 0 by O(|dx|^2); up to three corrections with the same factor bring them back
(second-order corrections, section 15.6). An indefinite Hessian is damped, then blended with
Gauss-Newton's.

A learner far from w_E needs no optimum, only a cut: with the cost ``known`` that the demonstration
has, a stage ends when what is left to gain is small against the regret known/c - 1.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.optimiser.hessian import Structure, half_hessian
from walking_irl.domains.humanoid.optimiser.linearisation import (
    Linearisation,
    Terms,
    Weighted,
    weighted,
)
from walking_irl.domains.humanoid.optimiser.ring import BorderedMatrix, Factor
from walking_irl.domains.humanoid.optimiser.stages import Stage
from walking_irl.domains.humanoid.optimiser.transcription import Evaluation

UNDAMPED = 1e-9
"""Damping that only keeps the factorisation from breaking down."""
START_DAMPING = 1e-3
MOST_DAMPING = 1.0  # of an indefinite matrix, before it is blended
SHARES = (1.0, 0.5, 0.25, 0.0)
"""Shares of the exact Hessian in the blends with Gauss-Newton's, in the order of trial."""
MAX_PERIOD_STEP = 0.1  # [s]
TRIALS = 16
"""Most step lengths tried in one iteration."""
FAR, DECISIVE, NEAR, LOOSEST = 0.02, 0.05, 1e-4, 1e-7
"""Regrets above FAR end the solve at DECISIVE times the regret, others at NEAR times it, but no
later than LOOSEST; always relative to the cost."""
CUTS, IDLE = 1e-3, 0.01
"""Where the Hessian is indefinite or steps need braking, a step that gains less than IDLE times the
regret ends the solve: there is no smooth minimum to be had, and the answer cuts already. It does if
its regret is above CUTS, or what the undamped model promises is small against it."""
CORRECTIONS = 3


class Status(Enum):
    """How a stage ended."""

    CONVERGED = "the Hessian is positive definite and the undamped Newton decrement below the stop"
    DECISIVE = "the last step gained little against the regret: the answer cuts, it is no minimum"
    STUCK = "no step helped, although the undamped decrement is not small"
    CAPPED = "the most iterations allowed"


class State(NamedTuple):
    """A gait and its half cost, tether included."""

    ev: Evaluation
    cost: float


class Model:
    """The quadratic model of the cost at one gait.

    Attributes:
        here: Linearisation at weights.
        gradient: Half the gradient, tether included.
        is_indefinite: Whether a factorisation has failed.
    """

    def __init__(
        self, here: Weighted, structure: Structure, root: Array | None, tether: Array, pull: Array
    ) -> None:
        self.here, self.structure, self.root, self.tether = here, structure, root, tether
        self.gradient = here.gradient + tether * pull
        covered = here.lin.problem.dynamics.reason is None
        self.shares = list(SHARES) if root is not None and covered else [0.0]
        self.is_indefinite = False
        self._exact: BorderedMatrix | None = None
        self._gauss: BorderedMatrix | None = None
        self._last: tuple[float, float, Factor] | None = None

    def matrix(self, share: float) -> BorderedMatrix:
        """Gauss-Newton's matrix plus a share of what the exact Hessian differs by."""
        if share < 1 and self._gauss is None:
            self._gauss = half_hessian(self.here, self.structure, is_exact=False)
        if share > 0 and self._exact is None:
            self._exact = half_hessian(self.here, self.structure, self.root)
        if 0 < share < 1:
            assert self._gauss is not None and self._exact is not None
            return self._gauss.blend(self._exact, share)
        chosen = self._exact if share else self._gauss
        assert chosen is not None
        return chosen

    def factor(self, damping: float) -> tuple[Factor, float]:
        """A positive definite factor and its damping: more damping first, then less curvature."""
        start = damping
        while True:
            try:
                return self._factored(self.shares[0], damping), damping
            except np.linalg.LinAlgError:
                self.is_indefinite = True
                if damping < MOST_DAMPING:
                    damping = max(10 * damping, START_DAMPING)
                elif len(self.shares) > 1:
                    self.shares.pop(0)
                    damping = start
                else:
                    damping *= 10

    def _factored(self, share: float, damping: float) -> Factor:
        if self._last is None or self._last[:2] != (share, damping):
            self._last = share, damping, self.matrix(share).factor(damping, self.tether)
        return self._last[2]

    @cached_property
    def undamped(self) -> Factor | None:
        """Factor of the exact Hessian, else of Gauss-Newton's; None if it is indefinite."""
        has_exact = self._exact is not None or self.shares[0] > 0
        try:
            return self._factored(1.0 if has_exact else 0.0, UNDAMPED)
        except np.linalg.LinAlgError:
            return None

    def decrement(self) -> float:
        """Undamped Newton decrement g'H^-1 g/2 of the half cost; inf if H is indefinite."""
        if self.undamped is None:
            return np.inf
        return 0.5 * float(self.gradient @ self.undamped.solve(self.gradient))


class Step(NamedTuple):
    """What one iteration found."""

    to: State | None
    """Next state, or None if no step lowered the cost."""
    predicted: float
    """Decrease of the half cost that the last step's damped model promised."""
    damping: float
    root: Array | None
    """Dual estimate after the step, shape (N, n_root)."""


class Newton:
    """One stage: iterations from a gait, until the stage's stop.

    Attributes:
        root: Dual estimate of the root forces; None until the first step.
        damping: That the next iteration starts with.
        last: Model of the last gait that was linearised.
    """

    def __init__(
        self,
        structure: Structure,
        w: Array,
        stage: Stage,
        anchor: Array,
        *,
        known: float | None = None,
        root: Array | None = None,
    ) -> None:
        self.structure, self.problem = structure, structure.problem
        self.w, self.stage, self.anchor, self.known, self.root = w, stage, anchor, known, root
        self.tether = np.broadcast_to(stage.tether, anchor.size).copy()
        if np.ndim(stage.tether) == 0:
            self.tether[-2:] *= anchor.size  # L and T concern all knots
        self.damping = START_DAMPING
        self.last: Model | None = None

    def state(self, x: Array) -> State:
        """The gait ``x`` with its cost: infinite where it does not go forward in time and space."""
        ev = self.problem.evaluate(x)
        if not (x[-2] > 0 and x[-1] > 0):  # costs per metre would be negative, and win
            return State(ev, np.inf)
        away = x - self.anchor
        total = ev.total(self.w, self.stage.penalty) + float(away @ (self.tether * away))
        return State(ev, total / 2)

    def model(self, at: State) -> Model:
        """The quadratic model at a state."""
        here = Linearisation(self.problem, at.ev).at(self.w, self.stage.penalty)
        return Model(here, self.structure, self.root, self.tether, at.ev.x - self.anchor)

    def regret(self, at: State) -> float:
        """By how much the demonstration is dearer, relative; 0 where it is not known."""
        return 0.0 if self.known is None else self.known / (2 * at.cost) - 1

    def stop(self, at: State) -> float:
        """Relative decrement that ends the stage here."""
        regret = self.regret(at)
        loose = DECISIVE * regret if regret > FAR else min(LOOSEST, NEAR * regret)
        return max(self.stage.tol, loose)

    def is_decisive(self, at: State, model: Model, step: Step, gain: float, is_small: bool) -> bool:
        """Whether the answer cuts and more work would not deepen the cut by much."""
        regret = self.regret(at)
        if regret > FAR and is_small and gain < self.stop(at):
            return True
        is_rough = model.is_indefinite or step.damping > MOST_DAMPING or step.to is None
        if not (is_rough and gain < IDLE * regret):
            return False
        return regret > CUTS or model.decrement() < DECISIVE * regret * at.cost

    def run(
        self, at: State, passed: list[Array], watch: Callable[[float], None] | None = None
    ) -> tuple[State, int, Status, float]:
        """Iterate; gives the state, the iterations, how it ended, and the last decrement known.

        The decrement is relative to the cost, undamped, at the last gait that was linearised; inf
        where the Hessian there is indefinite, nan where it was not asked for.
        """
        hidden = 0  # steps in a row that only damping made small
        for iteration in range(1, self.stage.max_iter + 1):
            model, stop = self.model(at), self.stop(at)
            self.last = model
            step = self.step(at, model, stop)
            is_small = step.predicted < stop * at.cost
            decrement, cost, gain = np.nan, at.cost, 0.0
            if is_small or step.to is None:
                decrement = model.decrement() / cost
            if step.to is not None:
                gain, at = (cost - step.to.cost) / cost, step.to
                passed.append(at.ev.total_costs())
                self.root = step.root
            if watch is not None:
                watch(2 * at.cost)
            if decrement < stop:
                return at, iteration, Status.CONVERGED, decrement
            if self.is_decisive(at, model, step, gain, is_small):
                return at, iteration, Status.DECISIVE, decrement
            hidden = hidden + 1 if is_small else 0
            if step.to is None or hidden > 2:
                return at, iteration, Status.STUCK, decrement
            self.adapt(gain * cost / max(step.predicted, 1e-300), step.damping)
        return at, self.stage.max_iter, Status.CAPPED, np.nan

    def adapt(self, ratio: float, damping: float) -> None:
        """Damping of the next iteration, after a step that gained ``ratio`` of its promise."""
        if ratio > 0.6:
            self.damping = max(damping / (10 if ratio > 0.85 else 4), UNDAMPED)
        else:
            self.damping = 2 * damping if ratio < 0.2 else damping

    def step(self, at: State, model: Model, stop: float) -> Step:
        """The first step that lowers the cost, with ever more damping."""
        damping, predicted = self.damping, np.inf
        for _ in range(TRIALS):
            factor, damping = model.factor(damping)
            dx = -factor.solve(model.gradient)
            predicted = -0.5 * float(model.gradient @ dx)
            if abs(dx[-1]) > MAX_PERIOD_STEP:
                damping = max(5 * damping, 1e-8)
                continue
            linear = model.here.times(dx)
            to = self.corrected(at, model, factor, dx, linear, predicted)
            if to.cost < at.cost:
                r, f = model.here.residuals, model.here.factors
                return Step(to, predicted, damping, f.root * (r.root + linear.root))
            if predicted < stop * at.cost:
                break
            damping = max(5 * damping, 1e-7)
        return Step(None, predicted, damping, None)

    def corrected(
        self, at: State, model: Model, factor: Factor, dx: Array, linear: Terms, predicted: float
    ) -> State:
        """The end of a step, brought back towards what the linear model promised."""
        here, to = model.here, self.state(at.ev.x + dx)
        for _ in range(CORRECTIONS):
            is_good = at.cost - to.cost >= 0.7 * predicted or predicted < 1e-9 * at.cost
            if is_good or not np.isfinite(to.cost):
                break
            ahead = weighted(self.problem.stack, to.ev, self.w, self.stage.penalty)
            miss = Terms(
                *(a - r - d for a, r, d in zip(ahead, here.residuals, linear, strict=True))
            )
            if model.shares[0] > 0:  # the Hessian knows how the costs bend, not how the valley does
                miss = Terms(np.zeros_like(miss.costs), miss.root, np.zeros_like(miss.anchors))
            back = -factor.solve(here.transpose_times(miss))
            if np.linalg.norm(back) > 0.75 * np.linalg.norm(dx):
                break
            better = self.state(to.ev.x + back)
            if not better.cost < to.cost:
                break
            gain, change = to.cost - better.cost, abs(at.cost - to.cost)
            to = better
            if gain < 0.3 * change:
                break
        return to
