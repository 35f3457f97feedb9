"""What inverse optimal control asks of the humanoid: gradients of its costs, and nearest gaits.

These methods see a gait, not its features: joint angles at the knots, as motion capture gives them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.costs.base import Channels
from walking_irl.domains.humanoid.gait.gait import Gait, cycle_motion
from walking_irl.domains.humanoid.learner import solver_for
from walking_irl.domains.humanoid.optimiser.chain import Outputs
from walking_irl.domains.humanoid.optimiser.linearisation import Linearisation
from walking_irl.domains.humanoid.optimiser.solver import Solution
from walking_irl.domains.humanoid.optimiser.stages import DIRECT
from walking_irl.domains.humanoid.spec import WalkerSpec


class Stationarity(NamedTuple):
    """First derivatives at a gait, of which a combination vanishes where it is optimal."""

    costs: Array
    """Gradient of each cost with the shared part, without the root penalty: (N nv + 2, K)."""
    constraints: Array
    """Gradient of each root force, in its units: (N n_root, N nv + 2)."""


class NearGait(NamedTuple):
    """The optimal gait for some weights, compared with joint angles that were shown."""

    residual: Array
    """Joint angles shown minus optimal, without what a later start explains, (N nu,) [rad]."""
    slope: Callable[[], Array]
    """d angles / d w, shape (N nu, K) [rad]."""
    policy: Gait
    mu: Array
    """Its feature expectations, shape (K,)."""


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


class NearestGait:
    """The forward problem of bilevel methods: the optimal gait, next to the joint angles shown.

    Every solve starts from the demonstration, made physical; where its answer is not the nearest
    so far, once more from the nearest gait so far, and the cheaper answer counts.

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

    def __call__(self, w: Array) -> NearGait:
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

    def _compare(self, w: Array, found: Solution) -> NearGait:
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
        return NearGait(angles(away), slope, gait, -found.total_costs)
