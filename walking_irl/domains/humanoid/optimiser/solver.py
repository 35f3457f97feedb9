r"""The optimal gait for given weights, near a given gait.

Newton's method (:mod:`~.newton`) along a homotopy in the root penalty. MuJoCo's contact impedance
has a floor, so a sole sphere that enters the contact margin changes the cost by about 2e-6 of its
value at once, and no derivative sees it. A stage that is stuck leaves by another road: a step that
goes uphill by no more than a jump, then Gauss-Newton's metric, then a perturbation by a hair; the
solve returns the best gait that it saw, and says whether it is a minimum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.contract import OnStep
from walking_irl.domains.humanoid.optimiser.hessian import Structure, half_hessian
from walking_irl.domains.humanoid.optimiser.linearisation import Linearisation
from walking_irl.domains.humanoid.optimiser.newton import UNDAMPED, Model, Newton, State, Status
from walking_irl.domains.humanoid.optimiser.perturbation import perturb
from walking_irl.domains.humanoid.optimiser.ring import Factor
from walking_irl.domains.humanoid.optimiser.stages import DIRECT, TETHERS, Stage, nearby
from walking_irl.domains.humanoid.optimiser.transcription import ROOT_PENALTY, Transcription
from walking_irl.errors import SolverError

JUMP = 5e-6
"""Largest relative rise of the cost that a contact jump explains."""
MAX_ESCAPES = 4
HAIR = np.deg2rad(0.002)
"""Perturbation of a stuck gait [rad]."""
PHYSICAL = 1e-3
"""Root penalty, in units of the cost, below which a gait can be walked as it is."""
SMOOTH_DECREMENT = 1e-6
"""Undamped Newton decrement below which a gait counts as a smooth minimum."""
ROUGH_DECREMENT = 1e-4
"""And above which the exact Hessian says nothing of where the minimum moves."""


@dataclass
class Solution:
    """A gait found, with the gaits passed on the way.

    Attributes:
        x: Best gait vector.
        total_costs: Its total costs G, shape (K,).
        passed: Total costs of all gaits accepted on the way, shape (n, K).
        iterations: Iterations of all stages.
        status: How the last stage ended, at its best gait.
        root: Dual estimate of the root forces there, shape (N, n_root), or None.
        model: If it converged, the quadratic model of the gait one Newton step before it, whose
            decrement showed that.
    """

    x: Array
    total_costs: Array
    passed: Array
    iterations: int
    status: Status
    root: Array | None
    model: Model | None = None


class GaitSolver:
    """Minimises w.G over the gaits of a transcription.

    Attributes:
        problem: The transcription.
        structure: Of its Hessians.
    """

    def __init__(self, problem: Transcription) -> None:
        self.problem = problem
        self.structure = Structure(problem)

    def dual(self, x: Array) -> Array | None:
        """Multipliers of the root forces at an optimal gait of any weights, shape (N, n_root).

        None if the gait is not physical: its root forces are no estimate then.
        """
        ev = self.problem.evaluate(x)
        if not ROOT_PENALTY * ev.root_square < PHYSICAL:
            return None
        return np.asarray(ROOT_PENALTY / self.problem.n_knots * ev.root)

    def physical(self, x: Array) -> Array:
        """The gait ``x``, or a gait near it that can be walked, at even weights."""
        k, shown = len(self.problem.stack.objectives), x
        for tether in TETHERS:
            if self.dual(x) is not None:
                break
            x = self.solve(np.full(k, 1 / k), shown, nearby(tether)).x
        return x

    def solve(
        self,
        w: Array,
        x: Array,
        stages: Sequence[Stage] = DIRECT,
        *,
        known: float | None = None,
        root: Array | None = None,
        anchor: Array | None = None,
        on_step: OnStep | None = None,
    ) -> Solution:
        """Best gait for weights ``w`` near the gait ``x``.

        Args:
            w: Weights, shape (K,).
            x: Start, shape (N nv + 2,).
            stages: Homotopy in the root penalty, easiest first.
            known: Cost w.G of a demonstration: the solve ends as soon as the answer tells it from
                an optimum.
            root: Multipliers of the root forces at the start (:meth:`dual` of an optimal gait of
                other weights); None: unknown, the first step is Gauss-Newton's.
            anchor: Gait that tethers lead to, shape (N nv + 2,); None: the start.
            on_step: Told of every iteration.

        Raises:
            SolverError: If the cost of the start is not finite.
        """
        passed: list[Array] = []
        anchor = x if anchor is None else anchor
        iterations, status, model = 0, Status.CAPPED, None
        for s in stages:
            newton = Newton(self.structure, w, s, anchor, known=known, root=root)

            def told(count: int, cost: float, before: int = iterations) -> None:
                if on_step is not None:
                    on_step(before + count, cost)

            at, n, status = self._stage(newton, x, passed, told)
            x, root, iterations = at.ev.x, newton.root, iterations + n
            model = newton.last if status is Status.CONVERGED else None
        total = self.problem.evaluate(x).total_costs()
        many = np.array(passed).reshape(-1, len(total))
        return Solution(x, total, many, iterations, status, root, model)

    def _stage(
        self, newton: Newton, x: Array, passed: list[Array], on_step: OnStep
    ) -> tuple[State, int, Status]:
        """One stage with its escapes: the best state, iterations, and how that one ended."""
        at = newton.state(x)
        if not np.isfinite(at.cost):
            raise SolverError(
                "the gait to start from has no finite cost; start from one of the known gaits"
            )
        rng, count, limit = np.random.default_rng(0), 0, newton.stage.max_iter
        best, best_status, best_root = at, Status.STUCK, newton.root

        def watch(cost: float) -> None:
            nonlocal count
            count += 1
            on_step(count, cost)

        for escape in range(MAX_ESCAPES + 1):
            newton.stage = newton.stage._replace(max_iter=limit - count)
            at, _, status, _ = newton.run(at, passed, watch)
            is_minimum = status is Status.CONVERGED
            if at.cost < best.cost or (is_minimum and at.cost <= best.cost * (1 + 1e-12)):
                best, best_status, best_root = at, status, newton.root
            if status is not Status.STUCK or count >= limit or escape == MAX_ESCAPES:
                break
            at = self._escape(newton, best, escape, rng)
        newton.root = best_root
        return best, count, best_status

    def _escape(self, newton: Newton, best: State, escape: int, rng: np.random.Generator) -> State:
        """Another road from a gait where no step helps."""
        newton.damping = 1e-3
        if escape % 2 == 0:
            model = newton.model(best)
            factor, _ = model.factor(UNDAMPED)
            uphill = newton.state(best.ev.x - factor.solve(model.gradient))
            if uphill.cost < best.cost * (1 + JUMP):
                return uphill
        if escape == 0:
            newton.root = None  # Gauss-Newton's metric for a step
            return best
        return newton.state(self.perturb(best.ev.x, HAIR, rng))

    def linearise(self, x: Array) -> Linearisation:
        """Derivatives at the gait ``x``."""
        return Linearisation(self.problem, self.problem.evaluate(x))

    def sensitivity(
        self,
        w: Array,
        lin: Linearisation,
        root: Array | None = None,
        tether: Array | None = None,
    ) -> tuple[Array, Array, float] | None:
        r"""Sensitivities of an optimal gait to its weights, and how optimal it is.

        Args:
            w: Weights, shape (K,).
            lin: Linearisation at the gait.
            root: Multipliers of the root forces; None: what the penalty says.
            tether: Of the solve that found the gait, shape (N nv + 2,), or None; with one the
                decrement means nothing.

        Returns:
            d mu / d w = :math:`g^T (2 H)^{-1} g`, symmetric positive semi-definite, shape (K, K),
            with g the gradients of the total costs and H half the Hessian of w.G; dx / dw,
            (N nv + 2, K); and the undamped relative Newton decrement :math:`g_w^T H^{-1} g_w/2J`:
            below 1e-8 the gait is a smooth minimum, above 1e-5 it sits on a contact jump, where
            sensitivities mean nothing. None if the Hessian is indefinite: the gait is no minimum.
        """
        is_exact = self.problem.dynamics.reason is None
        matrix = half_hessian(lin.at(w, ROOT_PENALTY), self.structure, root, is_exact=is_exact)
        try:
            return _sensitivity(w, lin, matrix.factor(UNDAMPED, tether))
        except np.linalg.LinAlgError:
            return None

    def sensitivity_of(self, w: Array, found: Solution) -> tuple[Array, Array, float] | None:
        """:meth:`sensitivity` of a solution, at full penalty; reuses its model if it converged."""
        if found.model is not None and found.model.undamped is not None:
            return _sensitivity(w, found.model.here.lin, found.model.undamped)
        return self.sensitivity(w, self.linearise(found.x), found.root)

    def slope(self, w: Array, found: Solution) -> Array:
        """Derivative dx / dw of a solution, shape (N nv + 2, K), by whatever Hessian there is.

        Where it is no smooth minimum that is Gauss-Newton's: a direction, no derivative.
        """
        known = self.sensitivity_of(w, found)
        if known is None or known[2] > ROUGH_DECREMENT:
            return self.rough_slope(w, self.linearise(found.x))
        return known[1]

    def rough_slope(self, w: Array, lin: Linearisation) -> Array:
        """The same by Gauss-Newton's Hessian, at any gait."""
        matrix = half_hessian(lin.at(w, ROOT_PENALTY), self.structure, is_exact=False)
        return _sensitivity(w, lin, matrix.factor(UNDAMPED))[1]

    def decrement(self, w: Array, lin: Linearisation, root: Array | None = None) -> float:
        """Undamped relative Newton decrement of a gait; inf where the Hessian is indefinite."""
        found = self.sensitivity(w, lin, root)
        return np.inf if found is None else found[2]

    def perturb(self, x: Array, amplitude: float, rng: np.random.Generator) -> Array:
        """See :func:`~.perturbation.perturb`."""
        return perturb(self.problem.walker, x, amplitude, rng)


def _sensitivity(w: Array, lin: Linearisation, factor: Factor) -> tuple[Array, Array, float]:
    unit = np.eye(len(lin.stack.objectives))
    g = np.column_stack([2 * lin.at(e, ROOT_PENALTY).gradient for e in unit])
    y = factor.solve(g) / 2
    m, total = g.T @ y, g @ w / 2
    decrement = float(total @ (y @ w)) / lin.evaluation.total(w, ROOT_PENALTY)
    return (m + m.T) / 2, -y, decrement
