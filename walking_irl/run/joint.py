r"""Gait and weights of a recorded walk, found together.

For weights w and a pull tau towards the recording,

.. math:: g(w) = \min_y [w \cdot G(y) + \tau d(y)^2] - \min_x w \cdot G(x) \ge 0

is what the recording costs more than the best gait: CPIRL's regret where tau is large, a fit of
joint angles where it is small. Both minima are envelopes, so its gradient is G(y) - G(x) and its
Hessian S_x - S_y, the difference of their sensitivities: Newton's method on the simplex. Without
S_y the step is that of finding weights for a given gait, in turn with gaits for given weights; it
is the safer one, and by far the shorter one where the pull is weak.

Weights for which every walk is cheap would have a small gap, too. So costs count in units u of what
the person's walk costs: the search is for the shares v = w u / (w.u), with the gap and tau relative
to w.u.
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
from walking_irl.domains.humanoid.recorded.feasible import (
    STRENGTH,
    Feasible,
    feasible_gait,
    sensitivity,
)
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

    v: Array
    """Shares of the costs, shape (K,)."""
    w: Array
    """Weights, shape (K,)."""
    scale: float
    """Cost of the unit walk under the weights, w.u."""
    near: Feasible
    """The nearest gait for them."""
    best: Response
    """The best gait for them."""
    gap: float
    """Relative to the scale."""

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
    """Inverse Hessian of the gap, for the weights, shape (K, K)."""
    answers: tuple[tuple[Array, Response], ...]
    """All that the forward solver answered."""

    @property
    def last(self) -> Point:
        """The end."""
        return self.points[-1]


def joint_fit(spec: WalkerSpec, walk: Walk, w: Array, near: Feasible, unit: Array) -> Fit:
    """Weights that a recorded walk speaks most for, from starting weights; for a process pool.

    Args:
        spec: Which body, and its costs.
        walk: The recorded walk.
        w: Starting weights, shape (K,).
        near: A gait near the walk, from which its nearest gait is sought.
        unit: Total costs that count as one each, shape (K,).

    Raises:
        SolverError: If no gait is found for some weights.
    """
    search = _Search(spec, walk, unit, Remembered(near.gait, spec))
    points = [search.point(w * unit / (w @ unit), [near.gait])]
    while len(points) <= MAX_STEPS:
        here = points[-1]
        following = search.step(here)
        if following is None:
            break
        points.append(following)
        if following.gap > (1 - RESTS) * here.gap:
            break
    return Fit(tuple(points), search.spread(points[-1]), tuple(search.forward.answers))


@dataclass(frozen=True)
class _Search:
    """The gap of a walk and its derivatives."""

    spec: WalkerSpec
    walk: Walk
    unit: Array
    forward: Remembered

    def point(self, v: Array, near: Sequence[Gait]) -> Point:
        """The gap at shares ``v``, its nearest gait sought from ``near``."""
        w = v / self.unit
        scale, w = 1.0 / float(w.sum()), w / w.sum()
        y = feasible_gait(
            self.spec,
            self.walk.shown,
            w,
            missing=self.walk.missing,
            strength=STRENGTH * scale,
            near=near,
        )
        self.forward.meet(y.gait, y.total_costs)
        best = self.forward(w)
        gap = float(w @ y.total_costs) + self.forward.value(w) + y.pull
        return Point(v, w, scale, y, best, gap / scale)

    def step(self, here: Point) -> Point | None:
        """The first attempt that lowers the gap, or None."""
        gradient = (here.near.total_costs + here.best.mu) / self.unit
        has_tried = False
        for share, length in ATTEMPTS:
            B = self.hessian(here, share)
            move = newton_step(here.v, gradient, B, MIN_WEIGHT).w - here.v
            size = float(np.abs(move).sum())
            v = here.v + move * length * min(1.0, LONGEST / max(size, 1e-300))
            if np.abs(v - here.v).sum() < RESTS:
                continue
            there = self.point(v, [here.near.gait, *([here.gait] if has_tried else [])])
            if there.gap < here.gap:
                return there
            has_tried = True
        return None

    def hessian(self, at: Point, share: float) -> Array:
        """S_x less a share of S_y in the plane of the shares, positive definite: (K-1, K-1)."""
        units = np.outer(self.unit, self.unit) / at.scale
        best = self.forward.sensitivity(at.w) / units
        held = None
        if share:
            held = sensitivity(
                self.spec,
                at.near,
                self.walk.shown,
                at.w,
                missing=self.walk.missing,
                strength=STRENGTH * at.scale,
            )
        if held is None:
            return reduced(best)
        U = plane_basis(len(best))
        values, vectors = np.linalg.eigh(reduced(best - share * held / units))
        floor = (1 - share) * np.einsum("ij,ij->j", vectors, (U.T @ best @ U) @ vectors)
        return np.asarray((vectors * np.maximum(values, floor)) @ vectors.T)

    def spread(self, at: Point) -> Array:
        """Inverse Hessian of the gap at the end, carried from shares to weights, shape (K, K)."""
        U = plane_basis(len(at.w))
        to_weights = (np.eye(len(at.w)) - at.w[:, None]) / self.unit * at.scale
        C = U @ np.linalg.solve(self.hessian(at, SHARE), U.T)
        return np.asarray(to_weights @ C @ to_weights.T)
