"""Episodes of stochastic policies: what policy gradients need of them.

Episodes carry the features of all K objectives, so that one set of them yields the gradient of
every feature expectation at once: d mu / d theta, shape (P, K); times w it is that of w.mu.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.rl.chain import Chain
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.rl.generative import next_states


class Episodes(NamedTuple):
    """n episodes of H steps under a policy with P parameters."""

    scores: Array
    """d log pi(a_t | s_t) / d theta, shape (n, H, P)."""
    features: Array
    """Features collected in each step, shape (n, H, K)."""


def gaussian_episodes(
    k: Array,
    *,
    spread: float,
    start: Array,
    step: Callable[[Array, Array], Array],
    features: Callable[[Array, Array], Array],
    n: int,
    horizon: int,
    rng: np.random.Generator,
) -> Episodes:
    """Episodes of u_j = k_j x_j + spread xi_j, xi standard normal; score_j = xi_j x_j / spread.

    Args:
        k: Gain of each axis, the P parameters, shape (P,).
        spread: Standard deviation of the controls.
        start: First state, shape (P,).
        step: Next states of n states and controls, (n, P) each.
        features: Features of n states and controls, shape (n, K).
        n: Episodes.
        horizon: H; what comes later is cut off, gamma^H of the whole.
        rng: Of the noise.
    """
    if not spread > 0 or n < 1 or horizon < 1:
        raise InvalidInputError(
            f"expected a spread > 0, episodes and a horizon, got {spread}, {n} and {horizon}"
        )
    x = np.repeat(np.asarray(start, dtype=float)[None], n, axis=0)
    scores, found = [], []
    for _ in range(horizon):
        noise = rng.standard_normal(x.shape)
        u = k * x + spread * noise
        scores.append(noise * x / spread)
        found.append(features(x, u))
        x = step(x, u)
    return Episodes(np.stack(scores, axis=1), np.stack(found, axis=1))


def softmax_policy(psi: Array, theta: Array) -> Array:
    """pi(a|s) ~ exp(psi(s, a).theta), shape (S, A), for features psi of shape (S, A, P)."""
    logits = psi @ theta
    p = np.exp(logits - logits.max(axis=1, keepdims=True))
    policy: Array = p / p.sum(axis=1, keepdims=True)
    return policy


def softmax_episodes(
    mdp: FiniteMDP, psi: Array, theta: Array, *, n: int, horizon: int, rng: np.random.Generator
) -> Episodes:
    """Episodes of the softmax policy; score = psi(s, a) - sum_b pi(b|s) psi(s, b).

    Args:
        mdp: The world.
        psi: Features of states and actions, shape (S, A, P).
        theta: Parameters, shape (P,).
        n: Episodes.
        horizon: H.
        rng: Of starts, actions and transitions.
    """
    policy = softmax_policy(psi, theta)
    centred = psi - np.einsum("sa,sap->sp", policy, psi)[:, None]
    cumulative = np.cumsum(policy, axis=1)
    s = rng.choice(mdp.n_states, size=n, p=mdp.start)
    scores = np.empty((n, horizon, psi.shape[2]))
    features = np.empty((n, horizon, mdp.n_objectives))
    for t in range(horizon):
        a = (cumulative[s] <= rng.random(n)[:, None]).sum(axis=1).clip(max=mdp.n_actions - 1)
        scores[:, t], features[:, t] = centred[s, a], mdp.Phi[s]
        s = next_states(mdp, s, a, rng)
    return Episodes(scores, features)


def softmax_gradient(mdp: FiniteMDP, psi: Array, theta: Array) -> Array:
    """Exact d mu / d theta of the softmax policy, shape (P, K) (policy gradient theorem).

    sum_s x(s) sum_a pi(a|s) (psi(s, a) - E psi) Q_k(s, a), where x are the discounted visits and
    Q_k the action values of feature k (Sutton, McAllester, Singh & Mansour 2000, theorem 1).
    """
    policy = softmax_policy(psi, theta)
    chain = Chain(mdp, policy)
    x, Psi = chain.solve_transposed(mdp.start), chain.solve(mdp.Phi)
    after = (mdp.T @ Psi).reshape(mdp.n_actions, mdp.n_states, -1)
    Q = mdp.Phi[None] + mdp.discount * after  # (A, S, K)
    centred = psi - np.einsum("sa,sap->sp", policy, psi)[:, None]
    gradient: Array = np.einsum("s,sa,sap,ask->pk", x, policy, centred, Q, optimize=True)
    return gradient
