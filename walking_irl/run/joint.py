r"""Gait and weights of a recorded walk, found together.

For weights w and a pull tau towards the recording,

.. math:: g(w) = \min_y [w \cdot G(y) + \tau d(y)^2] - \min_x w \cdot G(x) \ge 0

is what the recording costs more than the best gait: CPIRL's regret where tau is large, a fit of
joint angles where it is small. Both minima are envelopes, so its gradient is G(y) - G(x) and its
Hessian S_x - S_y, the difference of their sensitivities: Newton's method on the simplex. Without
S_y the step is that of finding weights for a given gait, in turn with gaits for given weights; it
is the safer one, and by far the shorter one where the pull is weak.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.regret_model import newton_step, reduced
from walking_irl.domains.humanoid.domain import MIN_WEIGHT
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.recorded.feasible import Feasible, feasible_gait, sensitivity
from walking_irl.domains.humanoid.spec import WalkerSpec
from walking_irl.geometry.plane import plane_basis
from walking_irl.run.remembered import Remembered
from walking_irl.types import Response

MAX_STEPS = 12
LONGEST = 0.5
"""Longest step (L1)."""
RESTS = 0.005
"""Relative fall of the gap, and length of a step (L1), below which the search rests."""
SHARE = 0.95
"""Of S_y that a Newton step trusts: all of it may leave nothing of the Hessian."""
ATTEMPTS = ((SHARE, 1.0), (SHARE, 0.4), (0.0, 1.0), (0.0, 0.4))
"""Share of S_y and of the step, tried in turn until the gap falls."""


@dataclass(frozen=True)
class Walk:
    """A recorded walk, as the model's body would walk it.

    Attributes:
        shown: The gait as recorded.
        missing: Columns that the recording has not got.
    """

    shown: Gait
    missing: tuple[str, ...] = ()


class Point(NamedTuple):
    """What is known at some weights."""

    w: Array
    """Shape (K,)."""
    near: Feasible
    """The nearest gait for them."""
    best: Response
    """The best gait for them."""
    gap: float

    @property
    def cost(self) -> float:
        """Of the nearest gait."""
        return float(self.w @ self.near.total_costs)

    @property
    def gait(self) -> Gait:
        """The best gait."""
        gait: Gait = self.best.policy
        return gait


class Fit(NamedTuple):
    """Where the search from some weights came to rest."""

    points: tuple[Point, ...]
    """From the start on, each with a smaller gap."""
    spread: Array
    """Inverse Hessian of the gap in the plane of the weights, shape (K, K)."""
    answers: tuple[tuple[Array, Response], ...]
    """All that the forward solver answered."""

    @property
    def last(self) -> Point:
        """The end."""
        return self.points[-1]


def joint_fit(spec: WalkerSpec, walk: Walk, w: Array, near: Sequence[Gait]) -> Fit:
    """Weights that a recorded walk speaks most for, from starting weights; for a process pool.

    Args:
        spec: Which body, and its costs.
        walk: The recorded walk.
        w: Starting weights, shape (K,).
        near: Gaits from which the first nearest gait is sought.

    Raises:
        SolverError: If no gait is found for some weights.
    """
    forward = Remembered(near[0], spec)
    points = [_point(spec, walk, w, near, forward)]
    while len(points) <= MAX_STEPS:
        here = points[-1]
        following = _step(spec, walk, here, forward)
        if following is None:
            break
        points.append(following)
        if following.gap > (1 - RESTS) * here.gap:
            break
    B = _hessian(spec, walk, points[-1], forward, SHARE)
    U = plane_basis(len(w))
    spread = np.asarray(U @ np.linalg.solve(B, U.T))
    return Fit(tuple(points), spread, tuple(forward.answers))


def _point(
    spec: WalkerSpec, walk: Walk, w: Array, near: Sequence[Gait], forward: Remembered
) -> Point:
    y = feasible_gait(spec, walk.shown, w, missing=walk.missing, near=near)
    forward.meet(y.gait, y.total_costs)
    best = forward(w)
    return Point(w, y, best, float(w @ y.total_costs) + forward.value(w) + y.pull)


def _step(spec: WalkerSpec, walk: Walk, here: Point, forward: Remembered) -> Point | None:
    """The first attempt that lowers the gap, or None."""
    gradient = here.near.total_costs + here.best.mu
    seen = False
    for share, length in ATTEMPTS:
        B = _hessian(spec, walk, here, forward, share)
        move = newton_step(here.w, gradient, B, MIN_WEIGHT).w - here.w
        size = float(np.abs(move).sum())
        w = here.w + move * length * min(1.0, LONGEST / max(size, 1e-300))
        if np.abs(w - here.w).sum() < RESTS:
            continue
        near = [here.near.gait, *([here.gait] if seen else [])]
        there = _point(spec, walk, w, near, forward)
        if there.gap < here.gap:
            return there
        seen = True
    return None


def _hessian(spec: WalkerSpec, walk: Walk, at: Point, forward: Remembered, share: float) -> Array:
    """S_x less a share of S_y in the plane of the weights, positive definite: (K-1, K-1)."""
    best = forward.sensitivity(at.w)
    held = None
    if share:
        held = sensitivity(spec, at.near, walk.shown, at.w, missing=walk.missing)
    if held is None:
        return reduced(best)
    U = plane_basis(len(best))
    values, vectors = np.linalg.eigh(reduced(best - share * held))
    floor = (1 - share) * np.einsum("ij,ij->j", vectors, (U.T @ best @ U) @ vectors)
    return np.asarray((vectors * np.maximum(values, floor)) @ vectors.T)
