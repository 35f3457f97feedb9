"""Covariance matrix adaptation (N. Hansen & A. Ostermeier 2001), by the package ``cmaes``."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.rl.search import Counted, Found, Objective, checked_start


def cma_es(
    objective: Objective,
    mean: Array,
    spread: float,
    *,
    rng: np.random.Generator,
    n_evaluations: int = 2500,
) -> Found:
    """Minimise by sampling from a normal distribution whose covariance follows the progress.

    Infeasible samples rank last: CMA-ES uses only the order of costs.

    Args:
        objective: Cost of parameters (P,); inf where they are infeasible.
        mean: Of the first distribution, shape (P,).
        spread: Its standard deviation.
        rng: Seeds the sampler.
        n_evaluations: Budget; it may end earlier, when nothing improves any more.

    Raises:
        InvalidInputError: If ``cmaes`` is not installed.
    """
    try:
        from cmaes import CMA
    except ImportError as error:
        raise InvalidInputError(
            "CMA-ES needs the package cmaes; install it by: pip install 'walking-irl[methods]'"
        ) from error
    mean, std = checked_start(mean, spread, n_evaluations)
    cost = Counted(objective)
    sampler = CMA(mean=mean, sigma=float(std[0]), seed=int(rng.integers(2**31)))
    while len(cost.log) + sampler.population_size <= n_evaluations and not sampler.should_stop():
        X = [sampler.ask() for _ in range(sampler.population_size)]
        costs = np.array([cost(x) for x in X])
        finite = costs[np.isfinite(costs)]
        worst = float(finite.max()) + 1.0 if len(finite) else 0.0
        sampler.tell([(x, c if np.isfinite(c) else worst) for x, c in zip(X, costs, strict=True)])
    return cost.found()
