"""The game between weights and a mixture of policies: the linear program of the certificate.

Source: S. Balloccu, Cutting-Plane methods for Inverse Reinforcement Learning, Theorem 6.2.3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.geometry.dual_simplex import maximise
from walking_irl.geometry.plane import feasible, plane_basis


class Game(NamedTuple):
    """Solution of the minimax program between the weights and a mixture of policies."""

    value: float
    """t_k: the mixture loses at most this much to the expert, whatever the expert's weights."""
    mixture: Array
    """Probabilities of the policies found, shape (n,)."""
    w: Array
    """Worst weights for the mixture, shape (K,): Kelley's query."""


def game_lp(D: Array, min_weight: float = 0.0) -> Game:
    """Minimax certificate t_k = max {t : w in simplex, -d_i.w >= t for all i} (Theorem 6.2.3).

    By duality the mixture lambda (the multipliers) satisfies
    0 <= w_E.(mu_E - mu_lambda) <= t_k, and min_i L_i(w_E) <= t_k. It never increases with more
    policies. Where no row is constant, t_k > 0, = 0, < 0 if and only if the polyhedron of the rows
    has an interior, is flat, or is empty (Gordan): t_k < 0 means that the mixture beats the expert
    in every feature.

    >>> game = game_lp(np.array([[0.6, -0.4], [-0.4, 0.6]]))
    >>> round(game.value, 9), game.mixture.round(9).tolist()
    (-0.1, [0.5, 0.5])

    Args:
        D: Differences of the policies, shape (n, K).
        min_weight: Lower bound of every weight; the value then holds for such weights only.

    Raises:
        InvalidInputError: If ``D`` is not a finite matrix with at least one row.
    """
    D = finite_rows(D)
    n, K = D.shape
    if min_weight > 0.0:  # w = min_weight + share v with v on the whole simplex
        share = 1.0 - K * min_weight
        game = game_lp(share * D + min_weight * D.sum(axis=1, keepdims=True))
        return game._replace(w=min_weight + share * game.w)
    scale = max(float(np.abs(D).max()), 1e-300)
    rows = np.r_[np.c_[D @ plane_basis(K) / scale, np.ones(n)], np.c_[-plane_basis(K), np.zeros(K)]]
    right = np.r_[-D.mean(axis=1) / scale, np.full(K, 1.0 / K)]
    # One policy alone is worst where its d_j is smallest: on all bounds but that one.
    first = int(D.min(axis=1).argmax())
    basis = np.r_[first, n + (D[first].argmin() + np.arange(1, K)) % K]
    found = maximise(np.eye(K)[K - 1 :], rows, right, basis[None])
    mixture = found.multipliers[0, :n] / found.multipliers[0, :n].sum()
    w = feasible(1.0 / K + plane_basis(K) @ found.x[0, : K - 1], 0.0)
    # The mixture's own guarantee, exact whatever the solver's tolerance.
    return Game(float(np.max(-(mixture @ D))) + 0.0, mixture, w)  # + 0.0: no negative zero


def finite_rows(D: Array, width: int | None = None) -> Array:
    """Differences of policies as a finite matrix, shape (n >= 1, K).

    Raises:
        InvalidInputError: If they are not.
    """
    D = np.asarray(D, dtype=np.float64)
    if D.ndim != 2 or len(D) == 0 or width not in (None, D.shape[1]):
        expected = "K" if width is None else width
        raise InvalidInputError(f"differences must have shape (n >= 1, {expected}), got {D.shape}")
    if not np.isfinite(D).all():
        raise InvalidInputError("differences must be finite")
    return D
