"""Successor features: how values depend on the weights (P. Dayan, 1993)."""

from __future__ import annotations

from walking_irl.arrays import Array
from walking_irl.rl.chain import Chain
from walking_irl.rl.finite_mdp import Actions, FiniteMDP


def successor_states(
    mdp: FiniteMDP, policy: Array | Actions, *, chain: Chain | None = None
) -> Array:
    """Psi = d V^pi / d w = (I - gamma T_pi)^-1 Phi, shape (S, K): V^pi = Psi w for every w."""
    return (chain or Chain(mdp, policy)).solve(mdp.Phi)


def successor(mdp: FiniteMDP, policy: Array | Actions, *, chain: Chain | None = None) -> Array:
    """Derivative d Q^pi / d w, shape (S, A, K): Q^pi(s, a) = d Q^pi / d w . w for every w.

    By the envelope theorem also the derivative of Q* where the policy is optimal and no action
    ties with it.

    Args:
        mdp: The world.
        policy: Deterministic, shape (S,), or stochastic, shape (S, A).
        chain: The policy's linear systems, where they are factorised already.
    """
    S, A, K = mdp.n_states, mdp.n_actions, mdp.n_objectives
    later = (mdp.T @ successor_states(mdp, policy, chain=chain)).reshape(A, S, K)
    Psi: Array = mdp.Phi[:, None] + mdp.discount * later.transpose(1, 0, 2)
    return Psi
