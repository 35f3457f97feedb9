"""Linear systems of a policy: I - gamma T_pi, dense for few states and sparse for many."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import lu_factor, lu_solve
from scipy.sparse.linalg import splu

from walking_irl.arrays import Array
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
        S, A = mdp.n_states, mdp.n_actions
        self._lu: Any = None
        if S <= DENSE_STATES:
            T = mdp.dense
            if policy.ndim == 1:
                rows = T[policy.astype(np.intp), np.arange(S)]
            else:
                rows = np.einsum("sa,ast->st", policy, T)
            self._dense = lu_factor(np.eye(S) - mdp.discount * rows, check_finite=False)
            return
        P, T = mdp.probabilities(policy), sparse.csr_array(mdp.T)
        entries = np.diff(T.indptr)
        state = np.repeat(np.tile(np.arange(S), A), entries)
        values = np.repeat(P.T.ravel(), entries) * T.data
        chain = sparse.csc_array((values, (state, T.indices)), shape=(S, S))
        self._lu = splu((sparse.eye_array(S) - mdp.discount * chain).tocsc())

    def solve(self, b: Array) -> Array:
        """The x with (I - gamma T_pi) x = b; b has shape (S,) or (S, n)."""
        x: Array
        if self._lu is not None:
            x = self._lu.solve(b)
        else:
            x = lu_solve(self._dense, b, check_finite=False)
        return x

    def solve_transposed(self, b: Array) -> Array:
        """The x with (I - gamma T_pi)' x = b; for b = start the discounted visits."""
        x: Array
        if self._lu is not None:
            x = self._lu.solve(b, trans="T")
        else:
            x = lu_solve(self._dense, b, trans=1, check_finite=False)
        return x
