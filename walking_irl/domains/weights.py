"""Weights as the domains take them."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError


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
