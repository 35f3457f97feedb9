"""Linear systems of a policy: I - gamma T_pi, dense for few states and sparse for many."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse
from scipy.linalg.lapack import dgetrf, dgetrs
from scipy.sparse.linalg import splu

from walking_irl.arrays import Array

if TYPE_CHECKING:  # a world evaluates its policies with this
    from walking_irl.rl.finite_mdp import Actions, FiniteMDP

DENSE_STATES = 300
"""Up to here a dense factorisation is faster: a sparse one of 256 states takes seven times as
long, most of it to build the matrix."""


class Chain:
    """Factorised I - gamma T_pi of one policy.

    Args:
        mdp: The world.
        policy: Deterministic, shape (S,), or stochastic, shape (S, A).
    """

    def __init__(self, mdp: FiniteMDP, policy: Array | Actions) -> None:
        S = mdp.n_states
        self._lu: Any = None
        if S > DENSE_STATES:
            self._lu = splu((sparse.eye_array(S) - mdp.discount * _sparse(mdp, policy)).tocsc())
            return
        matrix = _dense(mdp, policy)
        matrix *= -mdp.discount
        matrix.reshape(-1)[:: S + 1] += 1.0
        # Its rows are the columns that LAPACK wants: the transposed matrix is factorised in place.
        self._factors, self._pivots, _ = dgetrf(matrix.T, overwrite_a=1)

    def solve(self, b: Array) -> Array:
        """The x with (I - gamma T_pi) x = b; b has shape (S,) or (S, n)."""
        if self._lu is not None:
            x: Array = self._lu.solve(b)
            return x
        return self._substituted(b, 1)

    def solve_transposed(self, b: Array) -> Array:
        """The x with (I - gamma T_pi)' x = b; for b = start the discounted visits."""
        if self._lu is not None:
            x: Array = self._lu.solve(b, trans="T")
            return x
        return self._substituted(b, 0)

    def _substituted(self, b: Array, trans: int) -> Array:
        x, _ = dgetrs(self._factors, self._pivots, b, trans=trans)
        return np.ascontiguousarray(x)


def _dense(mdp: FiniteMDP, policy: Array | Actions) -> Array:
    """T_pi as a new array, shape (S, S)."""
    S = mdp.n_states
    if policy.ndim == 1:
        rows: Array = mdp.dense[policy.astype(np.intp), np.arange(S)]
        return rows
    entry, state, action, value = mdp.entries
    chain: Array = np.bincount(entry, policy[state, action] * value, S * S).reshape(S, S)  # type: ignore[assignment]
    return chain


def _sparse(mdp: FiniteMDP, policy: Array | Actions) -> Any:
    """T_pi as a sparse matrix, shape (S, S)."""
    S = mdp.n_states
    entry, state, action, value = mdp.entries
    values = mdp.probabilities(policy)[state, action] * value
    return sparse.csc_array((values, (state, entry % S)), shape=(S, S))
