"""GIRL: weights that make the demonstrated policy stationary (M. Pirotta & M. Restelli, AAAI 2016).

At an optimal policy with parameters theta the gradient of w.mu vanishes: w = argmin |G w|_2 on the
simplex, G = d mu / d theta' at the expert. No forward problem is ever solved. Where theta obeys
constraints G is the reduced gradient, along the directions that keep them.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from walking_irl.arrays import Array
from walking_irl.baselines.recovered import Recovered
from walking_irl.errors import InvalidInputError


def girl(G: Array) -> Recovered:
    """Weights of the simplex whose policy gradient at the expert is shortest.

    Solved as non-negative least squares min |G w|^2 + (sum w - 1)^2, whose solution has the same
    direction (Lawson & Hanson 1974, chapter 23), then once more on its support by the null space
    of sum w = 1, to rounding.

    Args:
        G: Gradient of each feature in each parameter of the policy, shape (p, K).

    Returns:
        Weights; ``info["residual"]`` is |G w| relative to the largest |G_j|, and
        ``info["singular_values"]`` those of G, relative: a second small one means that the
        weights are not identifiable from this policy.

    Raises:
        InvalidInputError: If the gradients are not finite or all vanish.
    """
    G = np.asarray(G, dtype=np.float64)
    if G.ndim != 2 or not G.size or not np.isfinite(G).all():
        raise InvalidInputError(f"policy gradients must be finite with shape (p, K), got {G.shape}")
    scale = float(np.linalg.norm(G, axis=0).max())
    if scale == 0.0:
        raise InvalidInputError(
            "no feature depends on the policy's parameters: all gradients are 0"
        )
    A = G / scale
    raw = nnls(np.vstack([A, np.ones(G.shape[1])]), np.r_[np.zeros(len(G)), 1.0])[0]
    w = _on_support(A, raw / raw.sum())
    values = np.linalg.svd(A, compute_uv=False)
    info = {
        "residual": float(np.linalg.norm(A @ w)),
        "singular_values": values / values[0],
        "solves": 0,
    }
    return Recovered(w=w, space="simplex", objective=np.array([info["residual"]]), info=info)


def _on_support(A: Array, w: Array) -> Array:
    """The same minimiser with the zero weights kept at zero, without squared condition numbers."""
    support = np.flatnonzero(w > 0)
    base = w[support]
    if len(support) < 2:
        return w
    basis = np.linalg.svd(np.ones((1, len(support))))[2][1:].T  # directions of sum w = 1
    columns = A[:, support]
    move = np.linalg.lstsq(columns @ basis, -columns @ base, rcond=None)[0]
    better = base + basis @ move
    if better.min() < 0:
        return w
    polished = np.zeros_like(w)
    polished[support] = better / better.sum()
    return polished
