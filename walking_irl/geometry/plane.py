"""The plane of the weights that sum to one: its orthonormal coordinates, and rounding."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from walking_irl.arrays import Array


@lru_cache(maxsize=64)
def plane_basis(n_objectives: int) -> Array:
    """Orthonormal basis U of {v : sum(v) = 0}, shape (K, K-1), so that w = 1/K + U z."""
    K = n_objectives
    Q, _ = np.linalg.qr(np.c_[np.ones(K), np.eye(K)[:, : K - 1]])
    U: Array = np.ascontiguousarray(Q[:, 1:K])
    U.setflags(write=False)
    return U


def feasible(w: Array, min_weight: float) -> Array:
    """Weights with rounding clipped onto their bounds, (..., K) -> (..., K)."""
    excess = np.maximum(w - min_weight, 0.0)
    share = 1.0 - w.shape[-1] * min_weight
    normalised: Array = min_weight + share * excess / excess.sum(axis=-1, keepdims=True)
    return normalised
