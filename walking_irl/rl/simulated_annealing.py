"""Generalised simulated annealing (Xiang et al. 1997), by ``scipy.optimize.dual_annealing``."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import dual_annealing

from walking_irl.errors import InvalidInputError
from walking_irl.rl.search import Counted, Found, Objective

PENALTY = 10.0
"""Infeasible parameters cost this many times the largest feasible |cost| seen so far."""


def simulated_annealing(
    objective: Objective,
    bounds: Sequence[tuple[float, float]],
    *,
    rng: np.random.Generator,
    n_evaluations: int = 2500,
    has_local_search: bool = False,
) -> Found:
    """Minimise within bounds by random jumps that become rarer and shorter.

    Args:
        objective: Cost of parameters (P,); inf where they are infeasible.
        bounds: Lower and upper bound of each parameter.
        rng: Of the jumps.
        n_evaluations: Budget.
        has_local_search: Whether L-BFGS-B polishes what the jumps find.

    Raises:
        InvalidInputError: If a bound is not finite or crossed, or there is no budget.
    """
    box = np.asarray(bounds, dtype=float)
    if box.ndim != 2 or box.shape[1] != 2 or not np.isfinite(box).all():
        raise InvalidInputError(f"expected finite bounds (P, 2), got shape {box.shape}")
    if (box[:, 0] >= box[:, 1]).any() or n_evaluations < 1:
        raise InvalidInputError("lower bounds must lie below upper ones, with evaluations to spend")
    cost = Counted(objective)
    largest = 0.0

    def finite(x: np.ndarray) -> float:
        nonlocal largest
        value = cost(x)
        if not np.isfinite(value):  # SciPy stops at infinite costs
            return PENALTY * (1.0 + largest)
        largest = max(largest, abs(value))
        return value

    dual_annealing(finite, box, rng=rng, maxfun=n_evaluations, no_local_search=not has_local_search)
    return cost.found()
