"""Soft values: policies that weigh actions by exp Q, and the likelihood of what they do.

V = log sum_a exp Q, Q = r + gamma T V, pi(a|s) = exp(Q - V): maximum causal entropy (B. Ziebart,
Modeling purposeful adaptive behavior, 2010).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.rl.chain import Chain
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.rl.tabular import best_policy, checked_reward

SOFT_TOL = 1e-10
"""Bellman residual of soft values, relative to the largest of them."""
MAX_NEWTON = 200


class SoftSolution(NamedTuple):
    """The soft-optimal policy of a reward."""

    pi: Array
    """Probabilities pi(a|s), shape (S, A)."""
    V: Array
    """Soft value of each state, shape (S,)."""
    Q: Array
    """Soft action values Q[a, s], shape (A, S)."""


class LogLikelihood(NamedTuple):
    """Log-likelihood of demonstrated actions as a function of the reward."""

    value: float
    """sum c(s, a) log pi_r(a|s)."""
    gradient: Array
    """Its derivative in r(s), shape (S,)."""
    V: Array
    """Soft values, to start the next solve from, shape (S,)."""


def soft_policy(mdp: FiniteMDP, reward: Array, *, V: Array | None = None) -> SoftSolution:
    """Soft-optimal policy by Newton's method, that is soft policy iteration.

    V <- V + (I - gamma T_pi)^-1 (W - V) with W = log sum_a exp Q: 3 to 7 solves, where plain
    sweeps need about ln(1/tol) / (1 - gamma).

    Args:
        mdp: The world; its features play no part.
        reward: r(s), shape (S,).
        V: Values to start from, shape (S,).

    Raises:
        InvalidInputError: If the reward is not finite.
        SolverError: If the residual does not fall to 1e-10 (relative).
    """
    r = checked_reward(mdp, reward)
    V = np.zeros(mdp.n_states) if V is None else V
    for _ in range(MAX_NEWTON):
        W, pi = _softmax(mdp.action_values(r, V))
        if np.abs(W - V).max() <= SOFT_TOL * max(1.0, float(np.abs(W).max())):
            Q = mdp.action_values(r, W)
            return SoftSolution(_softmax(Q)[1], W, Q)
        V = V + Chain(mdp, pi).solve(W - V)
    raise SolverError(f"soft values have not settled after {MAX_NEWTON} Newton steps")


def _softmax(Q: Array) -> tuple[Array, Array]:
    """Soft maximum log sum_a exp Q[a, s], shape (S,), and softmax over actions, shape (S, A)."""
    top = Q.max(axis=0)
    e = np.exp(Q - top)
    total = e.sum(axis=0)
    return top + np.log(total), (e / total).T


def boltzmann(mdp: FiniteMDP, reward: Array, beta: float) -> Array:
    """pi(a|s) ~ exp(beta Q*(s, a)) of the optimal action values, shape (S, A).

    An expert that prefers better actions, but plans as if it would take the best ones later.
    """
    if not 0 <= beta < np.inf:
        raise InvalidInputError(f"beta must be finite and not negative, got {beta}")
    r = checked_reward(mdp, reward)
    return _softmax(beta * mdp.action_values(r, best_policy(mdp, r).V))[1]


def mce_loglik(
    mdp: FiniteMDP, reward: Array, counts: Array, *, V: Array | None = None
) -> LogLikelihood:
    """How likely the soft-optimal policy of a reward is to act as demonstrated.

    With psi = dV/dr, d log pi(a|s) = e_s + gamma T_a psi - psi(s), so that one transposed solve
    gives the gradient c_s - D, D = (I - gamma T_pi)^-T (c_s - gamma sum_a T_a' c_a). It needs
    neither a start distribution nor trajectories of any length.

    Args:
        mdp: The world.
        reward: r(s), shape (S,).
        counts: c[s, a], how often each action was demonstrated, shape (S, A).
        V: Soft values to start from, shape (S,).
    """
    soft = soft_policy(mdp, reward, V=V)
    value = float((counts * (soft.Q - soft.V).T).sum())
    c = counts.sum(axis=1)
    flow = c - mdp.discount * (mdp.T.T @ counts.T.ravel())
    gradient = c - Chain(mdp, soft.pi).solve_transposed(flow)
    return LogLikelihood(value, gradient, soft.V)
