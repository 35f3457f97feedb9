"""Best policies, values and the score of rewards that are given state by state."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.rl.chain import Chain
from walking_irl.rl.finite_mdp import Actions, FiniteMDP
from walking_irl.rl.policy_iteration import TIE

WARM_SWEEPS = 10
"""Sweeps of value iteration that choose the first policy."""
MAX_IMPROVEMENTS = 500


class Optimum(NamedTuple):
    """An optimal deterministic policy and its value."""

    pi: Actions
    """Action of each state, shape (S,)."""
    V: Array
    """Value of each state, shape (S,)."""
    chain: Chain
    """The policy's linear systems: its visits cost one more substitution."""


def checked_reward(mdp: FiniteMDP, reward: Array) -> Array:
    """A reward of the state (S,), or of state and action (S, A), as floats.

    Raises:
        InvalidInputError: If its shape is another one, or it is not finite.
    """
    r = np.asarray(reward, dtype=np.float64)
    S, A = mdp.n_states, mdp.n_actions
    if r.shape not in ((S,), (S, A)) or not np.isfinite(r).all():
        raise InvalidInputError(
            f"a reward must be finite with shape ({S},) or ({S}, {A}), got {r.shape} with "
            f"{int(np.count_nonzero(~np.isfinite(r)))} values that are not finite"
        )
    return r


def checked_policy(mdp: FiniteMDP, policy: Array | Actions) -> Array | Actions:
    """A deterministic (S,) or stochastic (S, A) policy of this world.

    Raises:
        InvalidInputError: If actions do not exist, rows do not sum to 1, or states are missing.
    """
    S, A = mdp.n_states, mdp.n_actions
    pi: Any = np.asarray(policy)
    checked: Array | Actions = pi
    if pi.shape == (S,):
        if pi.dtype.kind not in "iu" or pi.min() < 0 or pi.max() >= A:
            raise InvalidInputError(f"a policy's actions must be whole numbers from 0 to {A - 1}")
        return checked
    if pi.shape != (S, A):
        raise InvalidInputError(
            f"a complete policy needs an action for each of {S} states, shape ({S},), or "
            f"probabilities ({S}, {A}), got {pi.shape}"
        )
    if not np.isfinite(pi).all() or pi.min() < 0 or np.abs(pi.sum(axis=1) - 1).max() > 1e-9:
        raise InvalidInputError("a policy's probabilities must not be negative and sum to 1")
    return checked


def best_policy(mdp: FiniteMDP, reward: Array, *, pi: Actions | None = None) -> Optimum:
    """Optimal policy for a tabular reward by policy iteration, exact to rounding.

    Args:
        mdp: The world; its features play no part.
        reward: r(s), shape (S,), or r(s, a), shape (S, A).
        pi: Policy to start from, shape (S,); where several actions are optimal its own are kept.

    Raises:
        InvalidInputError: If the reward is not finite.
        SolverError: If the policy still changes after 500 improvements.
    """
    r = checked_reward(mdp, reward)
    S, A = mdp.n_states, mdp.n_actions
    states = np.arange(S)
    R = np.broadcast_to(r if r.ndim == 1 else r.T, (A, S))
    if pi is None:
        V = np.zeros(S)
        for _ in range(WARM_SWEEPS):
            V = mdp.action_values(R, V).max(axis=0)
        pi = mdp.action_values(R, V).argmax(axis=0)
    for _ in range(MAX_IMPROVEMENTS):
        chain = Chain(mdp, pi)
        V = chain.solve(R[pi, states])
        Q = mdp.action_values(R, V)
        margin = TIE * max(1.0, float(np.abs(V).max()))
        is_better = Q.max(axis=0) > Q[pi, states] + margin
        if not is_better.any():
            return Optimum(pi, V, chain)
        pi = np.where(is_better, Q.argmax(axis=0), pi)
    raise SolverError(
        f"policy iteration still changes the policy after {MAX_IMPROVEMENTS} improvements"
    )


def policy_value(mdp: FiniteMDP, policy: Array | Actions, reward: Array) -> Array:
    """Value of a policy in each state for a reward r(s) of shape (S,)."""
    return Chain(mdp, policy).solve(reward)


def uniform_policy(mdp: FiniteMDP) -> Array:
    """All actions equally likely, shape (S, A)."""
    return np.full((mdp.n_states, mdp.n_actions), 1 / mdp.n_actions)


def loss(mdp: FiniteMDP, reward: Array, policy: Array | Actions) -> float:
    """start.(V* - V^pi) / start.(V* - V_uniform): 0 is optimal, 1 as good as chance.

    It does not depend on the scale or the offset of the true reward.

    Args:
        mdp: The world.
        reward: The true reward r(s), shape (S,).
        policy: Deterministic (S,) or stochastic (S, A).

    Raises:
        InvalidInputError: If under the reward every policy is as good as chance.
    """
    r = checked_reward(mdp, reward)
    best = float(mdp.start @ best_policy(mdp, r).V)
    chance = float(mdp.start @ policy_value(mdp, uniform_policy(mdp), r))
    if best - chance <= 1e-12 * max(1.0, abs(best)):
        raise InvalidInputError("no loss: under this reward every policy is as good as chance")
    got = float(mdp.start @ policy_value(mdp, checked_policy(mdp, policy), r))
    return (best - got) / (best - chance)
