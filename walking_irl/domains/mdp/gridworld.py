"""Gridworld with macro-cells (Abbeel & Ng 2004, section 5.1), and a non-degenerate variant."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse

from walking_irl.arrays import Array, Indices
from walking_irl.domains.contract import Option
from walking_irl.domains.mdp.finite import FiniteDomain
from walking_irl.domains.mdp.grid import grid_transitions
from walking_irl.errors import InvalidInputError
from walking_irl.rl.finite_mdp import Actions, FiniteMDP
from walking_irl.types import Objective

MOVES = np.array([(0, 1), (0, -1), (1, 0), (-1, 0)])
"""(row, column) steps of the four actions: right, left, down, up."""
SUCCESS = 0.7
"""Probability that an action is obeyed, else a uniformly random direction (Abbeel & Ng 2004)."""
VARIANTS = ("patches", "macro")
SIZES = (8, 64)
OPTIONS = {
    "population": Option("uniform", "how ground-truth weights are drawn", ("uniform", "sparse"))
}


class GridPicture(NamedTuple):
    """What a viewer needs to draw a policy of the gridworld; row 0 is at the top."""

    arrows: Array
    """Mean (row, column) step of the actions in each cell, shape (size, size, 2)."""
    visits: Array
    """Discounted expected visits of each cell, shape (size, size)."""
    regions: Indices
    """Feature that each cell counts for, -1 for none, shape (size, size)."""


class Gridworld(FiniteDomain):
    """An agent on size x size cells that collects the features of cells x cells regions.

    In the "macro" variant the regions tile the grid, so that all features sum to a constant: the
    weights are then known only up to w -> a w + (1 - a)/K, and uniform weights explain every
    expert. In the "patches" variant each region is the inner part of its macro-cell and the rest
    counts for nothing; weights then mean something.

    Args:
        size: Cells along a side, 8 to 64.
        cells: Macro-cells along a side; K = cells^2 objectives.
        variant: "patches" or "macro".
        success: Probability that an action is obeyed.
        discount: gamma in [0, 1).
        method: Forward solver, see :class:`FiniteDomain`.
    """

    options = OPTIONS
    view = "gridworld"

    def __init__(
        self,
        size: int = 16,
        cells: int = 4,
        variant: str = "patches",
        success: float = SUCCESS,
        discount: float = 0.9,
        method: str = "policy-iteration",
    ) -> None:
        _check(size, cells, variant, success)
        self.size, self.cells, self.variant = size, cells, variant
        self.regions = _regions(size, cells, variant)
        labels = self.regions.ravel()
        Phi = (labels[:, None] == np.arange(cells**2)).astype(float)
        start = np.full(size**2, 1 / size**2)
        mdp = FiniteMDP(_transitions(size, success), Phi, start, discount)
        name = "gridworld" if variant == "patches" else "gridworld-macro"
        super().__init__(name, _objectives(cells), mdp, method)

    def random_weights(self, population: str, rng: np.random.Generator) -> Array:
        """Ground-truth weights, shape (K,).

        Sparse ones are non-zero with probability .3, at least two, with uniform values; Abbeel & Ng
        draw non-zeros with probability .1 for K = 64, and .3 suits K = 9 and 16.
        """
        if population != "sparse":
            return super().random_weights(population, rng)
        share = 0.1 if self.cells >= 8 else 0.3
        while True:
            w = rng.random(self.cells**2) * (rng.random(self.cells**2) < share)
            if np.count_nonzero(w) >= 2:
                return np.asarray(w / w.sum())

    def picture(self, policy: Array | Actions) -> GridPicture:
        """Arrows, visits and regions of a policy, (S,) or (S, A)."""
        shape = (self.size, self.size)
        arrows = (self.mdp.probabilities(policy) @ MOVES).reshape(*shape, 2)
        return GridPicture(arrows, self.mdp.visits(policy).reshape(shape), self.regions)


def _check(size: int, cells: int, variant: str, success: float) -> None:
    lo, hi = SIZES
    if not lo <= size <= hi:
        raise InvalidInputError(f"grid size must lie in [{lo}, {hi}], got {size}")
    if variant not in VARIANTS:
        raise InvalidInputError(f"unknown variant {variant!r}; choose from {', '.join(VARIANTS)}")
    smallest = 3 if variant == "patches" else 1
    if not 2 <= cells <= size // smallest:
        raise InvalidInputError(
            f"a grid of size {size} takes 2 to {size // smallest} macro-cells along a side in the "
            f"{variant!r} variant, got {cells}"
        )
    if not 0 < success <= 1:
        raise InvalidInputError(f"success must lie in (0, 1], got {success}")


def _objectives(cells: int) -> tuple[Objective, ...]:
    return tuple(
        Objective(
            f"region {i + 1},{j + 1}", "visits", 1.0, f"Time spent in region {i + 1},{j + 1}."
        )
        for i in range(cells)
        for j in range(cells)
    )


def _transitions(size: int, success: float) -> sparse.csr_array:
    """Sparse (4 * S, S): a move that is not obeyed goes any way, the chosen one included."""
    return grid_transitions(size, MOVES, success * np.eye(4) + (1 - success) / 4)


def _regions(size: int, cells: int, variant: str) -> Indices:
    """Feature index of each cell, -1 for none, shape (size, size)."""
    band = np.arange(size) * cells // size
    inside = np.ones(size, dtype=bool)
    if variant == "patches":
        for c in range(cells):
            members = np.flatnonzero(band == c)
            edge = max(1, len(members) // 4)
            inside[members[:edge]] = inside[members[-edge:]] = False
    labels = band[:, None] * cells + band[None, :]
    return np.where(inside[:, None] & inside[None, :], labels, -1).astype(np.intp)
