r"""Gait and weights of a recorded walk, found together.

For weights w and a pull tau towards the recording,

.. math:: g(w) = \min_y [w \cdot G(y) + \tau d(y)^2] - \min_x w \cdot G(x) \ge 0

is what the recording costs more than the best gait: CPIRL's regret where tau is large, a fit of
joint angles where it is small. Both minima are envelopes, so its gradient is G(y) - G(x) and its
Hessian S_x - S_y, the difference of their sensitivities.

Weights for which every walk is cheap would have a small gap, too. So costs count in units u of what
the person's walk costs: the search is for the shares v = w u / (w.u), with the gap and tau relative
to w.u.

How far a body's best gait is from a person's is not known beforehand. So the gap is read like a sum
of squares of n errors of unknown variance, whose likelihood is :math:`g^{-n/2}`, and what it leaves
open is decided by how weights are spread among walkers. Sought is the least

.. math:: \tfrac n2 \log g(w) + \tfrac1{2\sigma^2} \sum_k (z_k - \bar z)^2,
   \qquad z = \log(w / w_\text{ref}),

by Newton's method, with the gap's part as a quadratic; its curvature tells how sure the weights
are. n is calibrated by walkers of known weights.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.domain import MIN_WEIGHT
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.recorded.closeness import Walk
from walking_irl.domains.humanoid.recorded.feasible import (
    STRENGTH,
    Feasible,
    feasible_gait,
    sensitivity,
)
from walking_irl.domains.humanoid.spec import WalkerSpec
from walking_irl.geometry.plane import feasible, plane_basis
from walking_irl.run.remembered import Remembered
from walking_irl.types import Response

OBSERVATIONS = 13.0
"""n: independent errors that a recorded cycle is worth. From walkers of known weights
(``benchmarks/known_walkers.py``): noise of joint angles alone would allow more, but with a load
that the search does not know of errors nearly fill the half widths, and no person has our body."""
SPREAD = 1.0
"""sigma: standard deviation of the log-weights of walkers about the reference; twice that of a
typical one, and about that of weights drawn anywhere on the simplex."""
LEAST_GAP = 1e-3
"""Gap that the solver and the harmonics of a recording leave of any walk."""
MAX_STEPS = 12
LONGEST = 0.5
"""Longest step of the shares (L1)."""
RESTS = 0.03
"""Fall of the loss below which the search rests."""
SHORTEST = 0.005
"""Shortest step of the shares (L1)."""
SHARE = 0.95
"""Of S_y that a Newton step trusts: all of it may leave nothing of the Hessian."""
ATTEMPTS = ((SHARE, 1.0), (SHARE, 0.4), (0.0, 1.0), (0.0, 0.4))
"""Share of S_y and of the step, tried in turn until the loss falls."""


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
    loss: float
    """What the search minimises."""

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
    """From the start on, each with a smaller loss."""
    covariance: Array
    """Of the weights, shape (K, K): the inverse Hessian of the loss."""
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
        if following.loss > here.loss - RESTS:
            break
    return Fit(tuple(points), search.covariance(points[-1]), tuple(search.forward.answers))


@dataclass(frozen=True)
class _Search:
    """The loss of weights, its derivatives, and steps down."""

    spec: WalkerSpec
    walk: Walk
    unit: Array
    forward: Remembered

    @property
    def usual(self) -> Array:
        """Shares of the reference weights, shape (K,)."""
        v = self.spec.stack.reference_weights * self.unit
        return np.asarray(v / v.sum())

    def point(self, v: Array, near: Sequence[Gait]) -> Point:
        """The gap at shares ``v``, its nearest gait sought from ``near``."""
        w = v / self.unit
        scale, w = 1.0 / float(w.sum()), w / w.sum()
        y = feasible_gait(self.spec, self.walk, w, strength=STRENGTH * scale, near=near)
        self.forward.meet(y.gait, y.total_costs)
        best = self.forward(w)
        gap = (float(w @ y.total_costs) + self.forward.value(w) + y.pull) / scale
        loss = OBSERVATIONS / 2 * float(np.log(gap + LEAST_GAP)) + rarity(v, self.usual)
        return Point(v, w, scale, y, best, gap, loss)

    def step(self, here: Point) -> Point | None:
        """The first attempt that lowers the loss, or None."""
        gradient = (here.near.total_costs + here.best.mu) / self.unit
        has_tried = False
        for share, length in ATTEMPTS:
            H = self.hessian(here, share)
            move = _minimum(here, gradient, H, self.usual) - here.v
            size = float(np.abs(move).sum())
            v = here.v + move * length * min(1.0, LONGEST / max(size, 1e-300))
            if np.abs(v - here.v).sum() < SHORTEST:
                continue
            there = self.point(v, [here.near.gait, *([here.gait] if has_tried else [])])
            if there.loss < here.loss:
                return there
            has_tried = True
        return None

    def hessian(self, at: Point, share: float) -> Array:
        """S_x less a share of S_y for the shares, positive semi-definite: (K, K)."""
        units = np.outer(self.unit, self.unit) / at.scale
        best = self.forward.sensitivity(at.w) / units
        held = None
        if share:
            strength = STRENGTH * at.scale
            held = sensitivity(self.spec, at.near, self.walk, at.w, strength=strength)
        U = plane_basis(len(best))
        if held is None:
            held, share = np.zeros_like(best), 0.0
        values, vectors = np.linalg.eigh(U.T @ (best - share * held / units) @ U)
        floor = (1 - share) * np.einsum("ij,ij->j", vectors, (U.T @ best @ U) @ vectors)
        vectors = U @ vectors
        return np.asarray((vectors * np.maximum(values, np.maximum(floor, 0.0))) @ vectors.T)

    def covariance(self, at: Point) -> Array:
        """Inverse Hessian of the loss at the end, carried from shares to weights, shape (K, K)."""
        K = len(at.w)
        U = plane_basis(K)
        spread = (np.eye(K) - 1.0 / K) / at.v  # of the centred logarithms of the shares
        rare = spread.T @ spread / SPREAD**2
        H = _sharpness(at) * self.hessian(at, SHARE) + rare
        to_weights = (np.eye(K) - at.w[:, None]) / self.unit * at.scale
        C = U @ np.linalg.solve(U.T @ H @ U, U.T)
        return np.asarray(to_weights @ C @ to_weights.T)


def rarity(v: Array, usual: Array) -> float:
    """How rare shares are among walkers: half the square of their distance in deviations."""
    z = np.log(v / usual)
    return float(np.sum((z - z.mean()) ** 2)) / (2 * SPREAD**2)


def _sharpness(at: Point) -> float:
    """By how much the loss rises with the gap."""
    return OBSERVATIONS / 2 / (at.gap + LEAST_GAP)


def _minimum(here: Point, gradient: Array, H: Array, usual: Array) -> Array:
    """Shares of least loss where the gap is a quadratic, shape (K,)."""

    def loss(z: Array) -> float:
        v = _shares(z, usual)
        move = v - here.v
        rise = float(gradient @ move + 0.5 * move @ H @ move)
        return _sharpness(here) * rise + rarity(v, usual)

    found = minimize(loss, np.log(here.v / usual), method="BFGS")
    return _shares(found.x, usual)


def _shares(z: Array, usual: Array) -> Array:
    """Shares of logarithms relative to the usual ones, none below MIN_WEIGHT; shape (K,)."""
    v = usual * np.exp(np.clip(z - z.max(), -20.0, 0.0))
    return feasible(v / v.sum(), MIN_WEIGHT)
