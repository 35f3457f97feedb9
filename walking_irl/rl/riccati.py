"""Discounted linear-quadratic regulators (D. Bertsekas, Dynamic Programming, volume 1, ch. 4)."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import solve_discrete_are, solve_discrete_lyapunov

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError


def optimal_gain(A: Array, B: Array, Q: Array, R: Array, discount: float) -> tuple[Array, Array]:
    """Gain k of u = k x that minimises sum_t gamma^t (x'Qx + u'Ru), and its value matrix P.

    The discount is absorbed by A sqrt(gamma), B sqrt(gamma); scipy solves the Riccati equation to
    about 1e-12 relative.

    Args:
        A: Dynamics, shape (n, n).
        B: Effect of the controls, shape (n, m).
        Q: Cost of the state, shape (n, n), positive semi-definite.
        R: Cost of the controls, shape (m, m), positive definite.
        discount: gamma in (0, 1].

    Returns:
        k of shape (m, n), and P of shape (n, n): the cost from x is x'Px.
    """
    root = math.sqrt(discount)
    P = solve_discrete_are(root * A, root * B, Q, R)
    k: Array = -discount * np.linalg.solve(R + discount * B.T @ P @ B, B.T @ P @ A)
    return k, P


def closed_loop_cost(A: Array, B: Array, k: Array, Q: Array, R: Array, discount: float) -> Array:
    """P with x'Px = sum_t gamma^t (x'Qx + u'Ru) under u = k x, shape (n, n).

    Raises:
        InvalidInputError: If the cost is infinite: sqrt(gamma) (A + B k) is not stable.
    """
    loop = math.sqrt(discount) * (A + B @ k)
    radius = float(np.abs(np.linalg.eigvals(loop)).max())
    if radius >= 1:
        raise InvalidInputError(
            f"the gain leaves an infinite cost: spectral radius {radius:.3g} must be below 1"
        )
    P: Array = solve_discrete_lyapunov(loop.T, Q + k.T @ R @ k)
    return P
