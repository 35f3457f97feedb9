"""What the gradient-free searches share: a counted objective and a common answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError, SolverError

Objective = Callable[[Array], float]
"""Cost of parameters (P,); inf where they are infeasible."""


class Found(NamedTuple):
    """The best parameters of a search."""

    x: Array
    """Shape (P,)."""
    cost: float
    n_evaluations: int
    log: Array
    """Lowest cost after each evaluation, shape (n_evaluations,)."""


class Counted:
    """An objective that remembers its best argument; NaN counts as infeasible."""

    def __init__(self, objective: Objective) -> None:
        self.objective = objective
        self.best: Array | None = None
        self.log: list[float] = []

    def __call__(self, x: Array) -> float:
        """Cost at ``x``, inf where it is infeasible."""
        cost = float(self.objective(np.asarray(x, dtype=float)))
        cost = np.inf if np.isnan(cost) else cost
        lowest = self.log[-1] if self.log else np.inf
        if cost < lowest:
            self.best = np.array(x, dtype=float)
        self.log.append(min(cost, lowest))
        return cost

    def found(self) -> Found:
        """The best of all evaluations.

        Raises:
            SolverError: If none was feasible.
        """
        if self.best is None:
            raise SolverError(f"none of {len(self.log)} parameters tried was feasible")
        return Found(self.best, self.log[-1], len(self.log), np.array(self.log))


def checked_start(mean: Array, spread: Array | float, n_evaluations: int) -> tuple[Array, Array]:
    """First mean and standard deviations, shape (P,) each.

    Raises:
        InvalidInputError: If they are not finite, or the spread or the budget is not positive.
    """
    mean = np.asarray(mean, dtype=float)
    std = np.broadcast_to(np.asarray(spread, dtype=float), mean.shape).copy()
    if mean.ndim != 1 or not np.isfinite(np.r_[mean, std]).all() or not std.min() > 0:
        raise InvalidInputError("a search starts from a finite mean (P,) and a positive spread")
    if n_evaluations < 1:
        raise InvalidInputError(f"a search needs evaluations, got {n_evaluations}")
    return mean, std
