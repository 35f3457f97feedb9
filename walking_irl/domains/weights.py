"""Weights as the domains take them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.types import Objective


def checked_weights(w: Array, n: int) -> Array:
    """Weights of the simplex, shape (n,).

    Raises:
        InvalidInputError: If they are not ``n`` finite, non-negative numbers that sum to 1.
    """
    w = np.asarray(w, dtype=float)
    if w.shape != (n,) or not np.isfinite(w).all():
        raise InvalidInputError(f"weights must be {n} finite numbers, got {w.tolist()}")
    if w.min() < -1e-9 or abs(w.sum() - 1) > 1e-6:
        raise InvalidInputError(
            f"weights must be >= 0 and sum to 1, got minimum {w.min():.3g} and sum {w.sum():.6g}"
        )
    return w


def normalised(given: Sequence[float] | Array, objectives: Sequence[Objective]) -> Array:
    """Weights that a person gave, scaled to sum 1, shape (K,).

    Raises:
        InvalidInputError: If they have another number, or are negative, not finite or all zero.
    """
    w, n = np.asarray(given, dtype=float), len(objectives)
    if w.shape != (n,):
        names = ", ".join(o.name for o in objectives)
        raise InvalidInputError(f"expected {n} weights ({names}), got {w.size}")
    if not np.isfinite(w).all() or (w < 0).any() or not w.any():
        raise InvalidInputError(f"weights must be finite, >= 0 and not all zero, got {w.tolist()}")
    w = w / w.max()  # against overflow
    return np.asarray(w / w.sum())
