"""Generative models: the next state and the reward of many states and actions at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.errors import InvalidInputError
from walking_irl.rl.finite_mdp import FiniteMDP

Step = Callable[[Any, Any, np.random.Generator], tuple[Any, Array]]
"""step(states, actions, rng) -> next states and rewards; the first axis counts the samples."""


class Draws(NamedTuple):
    """What may follow on each action in n states; probabilities of the last axis sum to 1."""

    next_states: Any
    """Shape (A, n, m), or (A, n, m, d) for states that are vectors."""
    rewards: Array
    """Shape (A, n, m)."""
    probabilities: Array
    """Of the m outcomes, shape (A, n, m): 1 / m for independent draws."""


def next_states(mdp: FiniteMDP, states: Indices, actions: Indices, rng: np.random.Generator) -> Any:
    """A random next state for each of n states and actions, shape (n,).

    Inverts the cumulative sums of the sparse rows, for all samples at once.
    """
    T = mdp.T.tocsr()
    rows = actions * mdp.n_states + states
    first, last = T.indptr[rows], T.indptr[rows + 1] - 1
    cumulative = np.concatenate([[0.0], np.cumsum(T.data)])
    target = cumulative[first] + rng.random(len(rows)) * (cumulative[last + 1] - cumulative[first])
    entry = np.searchsorted(cumulative[1:], target, side="right")
    return T.indices[np.clip(entry, first, last)].astype(np.intp)


def generative_model(mdp: FiniteMDP, r: Array) -> Step:
    """The finite MDP as a generative model with reward r(s) of the state that is left, (S,)."""
    r = np.asarray(r, dtype=float)
    if r.shape != (mdp.n_states,) or not np.isfinite(r).all():
        raise InvalidInputError(f"rewards must be {mdp.n_states} finite numbers, got {r.shape}")

    def step(states: Indices, actions: Indices, rng: np.random.Generator) -> tuple[Indices, Array]:
        return next_states(mdp, states, actions, rng), r[states]

    return step


def sampled_draws(
    step: Step, states: Any, n_actions: int, n_draws: int, *, rng: np.random.Generator
) -> Draws:
    """``n_draws`` independent outcomes of every action in n ``states``."""
    if n_draws < 1 or not len(states):
        raise InvalidInputError(f"need states and draws, got {len(states)} and {n_draws}")
    n = len(states)
    again = np.repeat(states, n_draws, axis=0)
    outcomes = [step(again, np.full(n * n_draws, a), rng) for a in range(n_actions)]
    after = np.stack([np.asarray(s).reshape(n, n_draws, *s.shape[1:]) for s, _ in outcomes])
    rewards = np.stack([r.reshape(n, n_draws) for _, r in outcomes])
    return Draws(after, rewards, np.full(rewards.shape, 1 / n_draws))


def exact_draws(mdp: FiniteMDP, r: Array) -> Draws:
    """Every outcome of every action in every state with its probability, n = S."""
    T = mdp.T.tocsr()
    S, A = mdp.n_states, mdp.n_actions
    counts = np.diff(T.indptr)
    m = int(counts.max())
    place = np.arange(len(T.data)) - np.repeat(T.indptr[:-1], counts)
    rows = np.repeat(np.arange(A * S), counts)
    after, p = np.zeros((A * S, m), dtype=np.intp), np.zeros((A * S, m))
    after[rows, place], p[rows, place] = T.indices, T.data
    rewards = np.broadcast_to(np.asarray(r, dtype=float)[None, :, None], (A, S, m))
    return Draws(after.reshape(A, S, m), rewards, p.reshape(A, S, m))
