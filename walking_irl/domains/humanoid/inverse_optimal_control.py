"""What inverse optimal control asks of the humanoid: gradients of its costs, and nearest gaits.

These methods see a gait, not its features: joint angles at the knots, as motion capture gives them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.contract import Compared
from walking_irl.domains.humanoid.costs.base import Channels
from walking_irl.domains.humanoid.gait.gait import Gait, cycle_motion
from walking_irl.domains.humanoid.learner import solver_for
from walking_irl.domains.humanoid.optimiser.chain import Outputs
from walking_irl.domains.humanoid.optimiser.linearisation import Linearisation
from walking_irl.domains.humanoid.optimiser.solver import Solution
from walking_irl.domains.humanoid.optimiser.stages import DIRECT
from walking_irl.domains.humanoid.spec import WalkerSpec
from walking_irl.errors import SolverError


class Stationarity(NamedTuple):
    """First derivatives at a gait, of which a combination vanishes where it is optimal."""

    costs: Array
    """Gradient of each cost with the shared part, without the root penalty: (N nv + 2, K)."""
    constraints: Array
    """Gradient of each root force, in its units: (N n_root, N nv + 2)."""


MAX_DRAWS, MAX_NEWTON = 4, 4
"""Draws of a gait near by for each that is wanted, and steps that make one physical."""


def stationarity(spec: WalkerSpec, gait: Gait) -> Stationarity:
    """Derivatives of costs and constraints at a gait, whether physical or not."""
    lin = solver_for(spec).linearise(gait.to_vector())
    unit = np.eye(len(spec.stack.objectives))
    costs = np.column_stack([2 * lin.at(e, 0.0).gradient for e in unit])
    return Stationarity(costs, root_jacobian(lin))


def root_jacobian(lin: Linearisation) -> Array:
    """Derivatives of the root forces with respect to the gait, shape (N n_root, N nv + 2)."""
    ev = lin.evaluation
    nothing = ev.motion._replace(**{f: 0 * getattr(ev.motion, f) for f in Channels._fields})
    rows = []
    for unit in np.eye(ev.root.size):
        rows.append(lin.chain.backward(Outputs(nothing, unit.reshape(ev.root.shape), 0.0)))
    return np.array(rows)


def nearby_costs(
    spec: WalkerSpec, gait: Gait, size: float, n: int, rng: np.random.Generator
) -> Array:
    """Costs of ``n`` physical gaits near one less its own, shape (n, K).

    They lie where gaits of other weights would, to first order and with Gauss-Newton's Hessian at
    even weights: random directions would be told apart by their stiffest cost alone. Newton steps
    then take away what the curvature of the constraints leaves.

    Args:
        spec: Which body, and its costs.
        gait: A gait; it is made physical first where it is not.
        size: Standard deviation of the change of a weight.
        n: Number of gaits.
        rng: Draws them.

    Raises:
        SolverError: If hardly any gait so near is physical.
    """
    solver, K = solver_for(spec), len(spec.stack.objectives)
    x = solver.physical(gait.to_vector())
    lin = solver.linearise(x)
    J, towards = root_jacobian(lin), solver.rough_slope(np.full(K, 1 / K), lin)
    back, found = np.linalg.pinv(J), []
    own = lin.evaluation.total_costs()
    for change in size * rng.standard_normal((MAX_DRAWS * n, K)):
        step = towards @ (change - change.mean())
        near = x + step - back @ (J @ step)
        for _ in range(MAX_NEWTON):
            near = near - back @ solver.problem.evaluate(near).root.ravel()
        if solver.dual(near) is not None:
            found.append(solver.problem.evaluate(near).total_costs() - own)
        if len(found) == n:
            return np.array(found)
    raise SolverError(f"of {MAX_DRAWS * n} gaits near by only {len(found)} are physical")


class NearestGait:
    """The forward problem of bilevel methods: the optimal gait, next to the joint angles shown.

    The residual holds joint angles shown minus optimal, without what a later start explains, shape
    (N nu,) [rad]. Every solve starts from the demonstration, made physical; where its answer is not
    the nearest so far, once more from the nearest gait so far, and the cheaper answer counts.

    Args:
        spec: Which body, and its costs.
        shown: Demonstrated gait; its joint angles are fitted, its root and its timing only give
            the first start.

    Attributes:
        n_solves: Solves so far, second starts included.
    """

    def __init__(self, spec: WalkerSpec, shown: Gait) -> None:
        self.spec, self.n_solves = spec, 0
        self.shown = self.angles(shown)
        solver = solver_for(spec)
        self.start = solver.physical(shown.to_vector())
        self.nearest, self.distance = self.start, np.inf

    def angles(self, gait: Gait) -> Array:
        """Joint angles at the knots, shape (N, nu) [rad]."""
        return gait.q[:, self.spec.walker.n_root :]

    def __call__(self, w: Array) -> Compared:
        """The optimal gait for weights ``w``, shape (K,)."""
        found = self._solve(w, self.start)
        near = self._compare(w, found)
        if np.linalg.norm(near.residual) > self.distance:
            other = self._solve(w, self.nearest)
            if float(other.total_costs @ w) < float(found.total_costs @ w):
                found, near = other, self._compare(w, other)
        distance = float(np.linalg.norm(near.residual))
        if distance < self.distance:
            self.nearest, self.distance = found.x, distance
        return near

    def _solve(self, w: Array, x: Array) -> Solution:
        self.n_solves += 1
        solver = solver_for(self.spec)
        return solver.solve(w, x, DIRECT, root=solver.dual(x))

    def _compare(self, w: Array, found: Solution) -> Compared:
        nv, walker = len(self.spec.walker.joints), self.spec.walker
        gait = Gait.from_vector(found.x, nv)
        later = cycle_motion(gait, walker.mirror)[1][: gait.n_knots, walker.n_root :].ravel()
        later /= np.linalg.norm(later)

        def angles(change: Array) -> Array:
            """Joint angles of a change of the gait, without a later start."""
            part = change[:-2].reshape(-1, nv)[:, walker.n_root :].ravel()
            return np.asarray(part - later * (later @ part))

        def slope() -> Array:
            dx = solver_for(self.spec).slope(w, found)
            return np.column_stack([angles(column) for column in dx.T])

        away = np.zeros_like(found.x)
        away[:-2].reshape(-1, nv)[:, walker.n_root :] = self.shown - self.angles(gait)
        return Compared(angles(away), slope, gait, -found.total_costs)
