"""How hidden weights are drawn: around the reference, or from the whole simplex."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.costs.defaults import REFERENCE_WEIGHTS

SPREAD = 0.5
"""Standard deviation of the log-weights of a typical walker."""
LEAST = 0.04
"""Smallest weight of the uniform population."""


def typical_weights(rng: np.random.Generator) -> Array:
    """Log-normal weights around the reference, shape (6,)."""
    w = REFERENCE_WEIGHTS * np.exp(SPREAD * rng.normal(size=len(REFERENCE_WEIGHTS)))
    return np.asarray(w / w.sum())


def uniform_weights(rng: np.random.Generator) -> Array:
    """Weights spread uniformly over the part of the simplex where all are >= ``LEAST``."""
    k = len(REFERENCE_WEIGHTS)
    return np.asarray(LEAST + (1 - k * LEAST) * rng.dirichlet(np.ones(k)))


POPULATIONS = {"typical": typical_weights, "uniform": uniform_weights}
