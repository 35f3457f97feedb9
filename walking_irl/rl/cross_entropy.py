"""The cross-entropy method (R. Rubinstein 1999; smoothing of de Boer et al. 2005, section 3)."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.rl.search import Counted, Found, Objective, checked_start


def cross_entropy(
    objective: Objective,
    mean: Array,
    spread: Array | float,
    *,
    rng: np.random.Generator,
    n_evaluations: int = 2500,
    population: int = 50,
    elite: float = 0.2,
    smoothing: float = 0.7,
) -> Found:
    """Minimise by refitting a normal distribution with independent axes to the best samples.

    Args:
        objective: Cost of parameters (P,); inf where they are infeasible.
        mean: Of the first distribution, shape (P,).
        spread: Its standard deviation, a number or shape (P,).
        rng: Of the samples.
        n_evaluations: Budget; the last population may be cut short by it.
        population: Samples per round.
        elite: Share of them that the next distribution is fitted to.
        smoothing: Weight of the new distribution against the old one, in (0, 1].
    """
    mean, std = checked_start(mean, spread, n_evaluations)
    n_elite = round(elite * population)
    if not 2 <= n_elite <= population or not 0 < smoothing <= 1:
        raise InvalidInputError(
            f"expected at least 2 elites of the population and smoothing in (0, 1], got {n_elite} "
            f"of {population} and {smoothing}"
        )
    cost = Counted(objective)
    while len(cost.log) < n_evaluations:
        n = min(population, n_evaluations - len(cost.log))
        X = mean + std * rng.standard_normal((n, len(mean)))
        costs = np.array([cost(x) for x in X])
        best = X[np.argsort(costs, kind="stable")[:n_elite]][: int(np.isfinite(costs).sum())]
        if len(best) >= 2:
            mean = smoothing * best.mean(axis=0) + (1 - smoothing) * mean
            std = smoothing * best.std(axis=0) + (1 - smoothing) * std
    return cost.found()
