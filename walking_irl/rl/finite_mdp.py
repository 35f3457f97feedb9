"""Finite Markov decision processes with linear rewards, and exact evaluation of their policies.

Source: M. Puterman, Markov Decision Processes (1994), chapter 6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.rl.chain import Chain

Actions = NDArray[np.intp]
"""A deterministic policy: one action per state, shape (S,)."""


class Entries(NamedTuple):
    """Non-zero transition probabilities, n of them, each array of shape (n,)."""

    place: NDArray[np.intp]
    """s S + s', the place in a matrix of states by next states."""
    state: NDArray[np.intp]
    action: NDArray[np.intp]
    value: Array


class Solution(NamedTuple):
    """A policy of a finite MDP and its exact figures."""

    pi: Actions
    """Action of each state, shape (S,)."""
    V: Array
    """Value of each state, shape (S,)."""
    mu: Array
    """Feature expectations from the start distribution, shape (K,)."""
    n_iter: int
    """Iterations of the solver."""


@dataclass(frozen=True)
class FiniteMDP:
    """S states, A actions, K features of the state, a start distribution and a discount.

    Attributes:
        T: Sparse transition matrix, shape (A * S, S): row ``a * S + s`` is the distribution of the
            next state after action ``a`` in state ``s``.
        Phi: Features of each state, shape (S, K).
        start: Distribution of the first state, shape (S,).
        discount: gamma in [0, 1).
    """

    T: Any
    Phi: Array
    start: Array
    discount: float

    def __post_init__(self) -> None:
        S = len(self.Phi)
        if self.T.shape[1] != S or self.T.shape[0] % S or self.start.shape != (S,):
            raise InvalidInputError(
                f"an MDP of {S} states needs transitions (A * {S}, {S}) and a start ({S},), "
                f"got {self.T.shape} and {self.start.shape}"
            )
        if self.Phi.ndim != 2 or not np.isfinite(self.Phi).all():
            raise InvalidInputError(
                f"features of states must be finite with shape ({S}, K), got {self.Phi.shape} with "
                f"{int(np.count_nonzero(~np.isfinite(self.Phi)))} values that are not finite"
            )
        if not 0 <= self.discount < 1:
            raise InvalidInputError(f"discount must lie in [0, 1), got {self.discount}")
        rows = np.asarray(self.T.sum(axis=1)).ravel()
        if np.abs(rows - 1).max() > 1e-9 or abs(self.start.sum() - 1) > 1e-9:
            raise InvalidInputError("transition rows and the start distribution must sum to 1")
        if self.T.min() < 0 or self.start.min() < 0:
            raise InvalidInputError("probabilities must not be negative")

    @property
    def n_states(self) -> int:
        """S."""
        return len(self.Phi)

    @property
    def n_actions(self) -> int:
        """A."""
        return int(self.T.shape[0]) // self.n_states

    @property
    def n_objectives(self) -> int:
        """K."""
        return int(self.Phi.shape[1])

    @cached_property
    def dense(self) -> Array:
        """T as one dense array (A, S, S): T[a, s, s'] is the probability of s' after a in s."""
        T: Array = self.T.toarray().reshape(self.n_actions, self.n_states, self.n_states)
        return T

    @cached_property
    def entries(self) -> Entries:
        """The non-zero entries of T."""
        T = sparse.coo_array(self.T)
        state = T.row % self.n_states
        return Entries(state * self.n_states + T.col, state, T.row // self.n_states, T.data)

    def reward(self, w: Array) -> Array:
        """r(s) = w.phi(s), shape (S,); any finite weights (K,), negative ones included."""
        w = np.asarray(w, dtype=float)
        if w.shape != (self.n_objectives,) or not np.isfinite(w).all():
            raise InvalidInputError(f"weights must be {self.n_objectives} finite numbers, got {w}")
        return self.Phi @ w

    def action_values(self, r: Array, V: Array) -> Array:
        """Q[a, s] = r(s) + gamma E[V(s')], shape (A, S)."""
        q: Array = r + self.discount * (self.T @ V).reshape(self.n_actions, self.n_states)
        return q

    def visits(self, policy: Array | Actions) -> Array:
        """Discounted expected visits of each state, shape (S,); they sum to 1 / (1 - gamma)."""
        return Chain(self, policy).solve_transposed(self.start)

    def feature_expectations(self, policy: Array | Actions) -> Array:
        """Exact mu = Phi' (I - gamma T_pi)'^-1 start, shape (K,)."""
        return self.Phi.T @ self.visits(policy)

    def stationary_policy(
        self, policies: Sequence[Array | Actions], mixture: Array
    ) -> tuple[Array, Array]:
        """One stochastic policy with the same feature expectations as a lottery over policies.

        pi(a|s) = x(s, a) / sum_a x(s, a) for the mixed occupancy x (Syed, Bowling & Schapire
        2008, Theorem 3). States that are never visited get the uniform distribution.

        Args:
            policies: Deterministic (S,) or stochastic (S, A) policies.
            mixture: Probability of each, drawn once before the start.

        Returns:
            The policy, shape (S, A), and its feature expectations, shape (K,).
        """
        x = np.zeros((self.n_states, self.n_actions))
        seen: dict[bytes, Array] = {}  # many lotteries hold a policy several times
        for policy, p in zip(policies, mixture, strict=True):
            key = policy.tobytes()
            if key not in seen and p > 0:
                seen[key] = self.visits(policy)[:, None] * self.probabilities(policy)
            if p > 0:
                x += p * seen[key]
        pi = normalised_occupancy(x)
        return pi, self.feature_expectations(pi)

    def probabilities(self, policy: Array | Actions) -> Array:
        """A policy as probabilities pi(a|s), shape (S, A)."""
        if policy.ndim == 2:
            return np.asarray(policy, dtype=float)
        return np.eye(self.n_actions)[policy.astype(np.intp)]


def normalised_occupancy(x: Array) -> Array:
    """pi(a|s) = x(s, a) / sum_a x(s, a), uniform where a state is never visited, shape (S, A)."""
    x = np.maximum(x, 0.0)
    total = x.sum(axis=1, keepdims=True)
    uniform = np.full_like(x, 1 / x.shape[1])
    pi: Array = np.divide(x, total, out=uniform, where=total > 1e-12)
    return pi
