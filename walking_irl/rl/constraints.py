"""Gradients along the directions that constraints leave free."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError


def free_gradient(G: Array, A: Array) -> Array:
    """What is left of gradients without what lies in the rows of A, shape (n, K).

    Least squares over Lagrange multipliers: a point is stationary for a combination of the columns
    exactly if that combination of the result vanishes.

    Args:
        G: Gradient of each function, shape (n, K).
        A: Jacobian of the constraints, shape (m, n); rows may depend on each other.

    Raises:
        InvalidInputError: If shapes do not fit, or the Jacobian is not finite.
    """
    G, A = np.asarray(G, dtype=np.float64), np.asarray(A, dtype=np.float64)
    if A.ndim != 2 or A.shape[1] != len(G) or not np.isfinite(A).all():
        raise InvalidInputError(
            f"the constraints' Jacobian must be finite with shape (m, {len(G)}), got {A.shape}"
        )
    scaled = A / np.maximum(np.linalg.norm(A, axis=1, keepdims=True), 1e-300)
    Q, R = np.linalg.qr(scaled.T)
    Q = Q[:, np.abs(np.diag(R)) > 1e-10]
    free = G - Q @ (Q.T @ G)
    left: Array = free - Q @ (Q.T @ free)  # twice: multipliers are large where noise is
    return left
