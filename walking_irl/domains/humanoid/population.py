"""How ground-truth weights are drawn: around the reference, or from the whole simplex."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.costs.defaults import REFERENCE_WEIGHTS

SPREAD = 0.5
"""Standard deviation of the log-weights of a typical walker."""
LEAST = 0.04
"""Smallest weight of the uniform population."""


def typical_weights(rng: np.random.Generator, reference: Array = REFERENCE_WEIGHTS) -> Array:
    """Log-normal weights around the reference, shape (K,)."""
    w = reference * np.exp(SPREAD * rng.normal(size=len(reference)))
    return np.asarray(w / w.sum())


def uniform_weights(rng: np.random.Generator, reference: Array = REFERENCE_WEIGHTS) -> Array:
    """Weights spread uniformly over the part of the simplex where all are >= ``LEAST``, (K,)."""
    k = len(reference)
    return np.asarray(LEAST + (1 - k * LEAST) * rng.dirichlet(np.ones(k)))


POPULATIONS = {"typical": typical_weights, "uniform": uniform_weights}
