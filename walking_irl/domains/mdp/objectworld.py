"""Objectworld: a grid with coloured objects and a reward that is not linear in the features.

Source: Levine, Popovic & Koltun (2011), section 5; written from the paper's description.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.domains.mdp.finite import FiniteDomain
from walking_irl.domains.mdp.grid import grid_transitions
from walking_irl.domains.mdp.soft_expert import soft_expert
from walking_irl.domains.weights import checked_weights
from walking_irl.errors import InvalidInputError
from walking_irl.rl.finite_mdp import Actions, FiniteMDP
from walking_irl.rl.soft import soft_policy
from walking_irl.rl.tabular import best_policy
from walking_irl.types import Expert, Objective

MOVES = np.array([(0, 0), (0, 1), (0, -1), (1, 0), (-1, 0)])
"""(row, column) steps of the five actions: stay, right, left, down, up."""
SIZES = (8, 64)
FEATURES = ("continuous", "binary")
REWARDS = (5.0, -10.0)
"""Near both of the first two outer colours; near the first alone. Elsewhere 0."""
RADII = (3.0, 2.0)
"""How near the first and the second outer colour are "near" [cells]."""
MAX_DRAWS = 10_000
"""Draws of objects after which a world that lacks a colour is given up."""


class Objects(NamedTuple):
    """The objects of a world, n of them."""

    cells: Indices
    """State that each lies in, shape (n,)."""
    inner: Indices
    """Inner colour of each, shape (n,)."""
    outer: Indices
    """Outer colour of each, shape (n,)."""


class ObjectPicture(NamedTuple):
    """What a viewer needs to draw a policy of an Objectworld; row 0 is at the top."""

    arrows: Array
    """Mean (row, column) step of the actions in each cell, shape (size, size, 2)."""
    visits: Array
    """Discounted expected visits of each cell, shape (size, size)."""
    reward: Array
    """Reward of each cell that the world's own experts collect, shape (size, size)."""


class Objectworld(FiniteDomain):
    """A walk on size x size cells among objects with an inner and an outer colour.

    The features are distances to the nearest object of each colour; the world's own reward,
    :attr:`reward`, depends on two of the outer colours only and is not linear in them. As a
    domain of weights it is linear: ``forward(w)`` is the best policy for the reward Phi w.

    Args:
        size: Cells along a side, 8 to 64 (16 and 32 in the literature).
        density: Probability that a cell holds an object.
        colours: C inner and C outer colours, at least 2.
        success: Probability that an action is obeyed, else one of the other four is taken.
        discount: gamma in [0, 1).
        features: "continuous": Euclidean distance to the nearest object of each inner, then of
            each outer colour, divided by size, K = 2 C; "binary": whether that distance is below
            1, 2, .., size - 1 cells, K = 2 C (size - 1); large thresholds may hold everywhere.
        seed: Of the objects; another one is another world with the same rule of reward.
        method: Forward solver, see :class:`FiniteDomain`.

    Attributes:
        view: Its view in recordings.
        reward: The non-linear reward of each state, shape (S,).
        distances: To the nearest object of each inner, then outer colour [cells], shape (S, 2 C).
        objects: Where the objects are.
    """

    view = "objectworld"

    def __init__(
        self,
        size: int = 16,
        density: float = 0.05,
        colours: int = 2,
        success: float = 0.7,
        discount: float = 0.9,
        features: str = "continuous",
        seed: int = 0,
        method: str = "policy-iteration",
    ) -> None:
        _check(size, density, colours, success, features)
        S = size**2
        self.size, self.features = size, features
        self.objects = _objects(S, density, colours, np.random.default_rng(seed))
        self.distances = _distances(size, colours, self.objects)
        self.reward = _reward(self.distances[:, colours], self.distances[:, colours + 1])
        Phi = self.distances / size
        if features == "binary":
            Phi = (self.distances[:, :, None] < np.arange(1, size)).reshape(S, -1).astype(float)
        obeyed = success * np.eye(5) + (1 - success) / 4 * (1 - np.eye(5))
        T = grid_transitions(size, MOVES, obeyed)
        mdp = FiniteMDP(T, Phi, np.full(S, 1 / S), discount)
        super().__init__("objectworld", _objectives(size, colours, features), mdp, method)

    def suboptimal_expert(self, w_E: Array, rng: np.random.Generator) -> Expert:
        """Expert that weighs actions by exp(20 Q), unknown to the learner."""
        return soft_expert(self.mdp, checked_weights(w_E, len(self.objectives)))

    def own_policy(self, temperature: float = 0.0) -> Array | Actions:
        """How an expert of the world's own reward acts.

        Args:
            temperature: 0 for the best policy, deterministic (S,); above, the soft-optimal policy
                of reward / temperature, shape (S, A). Levine et al. demonstrate with 1.
        """
        if temperature == 0:
            return best_policy(self.mdp, self.reward).pi
        if not 0 < temperature < np.inf:
            raise InvalidInputError(f"temperature must be finite and >= 0, got {temperature}")
        return soft_policy(self.mdp, self.reward / temperature).pi

    def picture(self, policy: Array | Actions) -> ObjectPicture:
        """Mean steps and visits of a policy, (S,) or (S, A), and the world's own reward."""
        shape = (self.size, self.size)
        arrows = (self.mdp.probabilities(policy) @ MOVES).reshape(*shape, 2)
        visits = self.mdp.visits(policy).reshape(shape)
        return ObjectPicture(arrows, visits, self.reward.reshape(shape))


def _check(size: int, density: float, colours: int, success: float, features: str) -> None:
    lo, hi = SIZES
    if not lo <= size <= hi:
        raise InvalidInputError(f"Objectworld's size must lie in [{lo}, {hi}], got {size}")
    if not 0 < density <= 1 or not 0 < success <= 1:
        raise InvalidInputError(f"density and success must lie in (0, 1], got {density}, {success}")
    if colours < 2:
        raise InvalidInputError(f"Objectworld needs at least 2 colours, got {colours}")
    if features not in FEATURES:
        raise InvalidInputError(f"unknown features {features!r}; choose from {', '.join(FEATURES)}")


def _objects(S: int, density: float, colours: int, rng: np.random.Generator) -> Objects:
    """Random objects, drawn again until every inner and every outer colour occurs."""
    for _ in range(MAX_DRAWS):
        cells = np.flatnonzero(rng.random(S) < density)
        inner, outer = rng.integers(colours, size=(2, len(cells)))
        if len(np.unique(inner)) == len(np.unique(outer)) == colours:
            return Objects(cells, inner, outer)
    raise InvalidInputError(
        f"{S} cells with density {density} hardly ever hold all {colours} colours; raise the "
        "density or take fewer colours"
    )


def _distances(size: int, colours: int, objects: Objects) -> Array:
    """Distance from each cell to the nearest object of each inner, then outer colour [cells]."""
    rows, columns = np.divmod(np.arange(size**2), size)
    at = np.divmod(objects.cells, size)
    d = np.hypot(rows[:, None] - at[0], columns[:, None] - at[1])
    kinds = [objects.inner == c for c in range(colours)]
    kinds += [objects.outer == c for c in range(colours)]
    return np.stack([d[:, kind].min(axis=1) for kind in kinds], axis=1)


def _reward(first: Array, second: Array) -> Array:
    """Reward of each cell by its distances to the first two outer colours [cells], shape (S,)."""
    is_near, is_near_both = first <= RADII[0], (first <= RADII[0]) & (second <= RADII[1])
    return np.where(is_near_both, REWARDS[0], np.where(is_near, REWARDS[1], 0.0))


def _objectives(size: int, colours: int, features: str) -> tuple[Objective, ...]:
    kinds = [f"{side} colour {c + 1}" for side in ("inner", "outer") for c in range(colours)]
    if features == "continuous":
        return tuple(
            Objective(f"far from {kind}", "cells", float(size), f"Keep away from {kind}.")
            for kind in kinds
        )
    return tuple(
        Objective(f"{kind} < {d}", "share", 1.0, f"Stay within {d} cells of {kind}.")
        for kind in kinds
        for d in range(1, size)
    )
