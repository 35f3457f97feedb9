"""How each forward method is set up on a gridworld; every one gets the weights, none the policy."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.rl import FiniteMDP, linear_program, policy_iteration, value_iteration
from walking_irl.rl.approximate_value_iteration import approximate_value_iteration, greedy
from walking_irl.rl.approximators import Approximator, linear, nearest_neighbours, radial_basis
from walking_irl.rl.cma_es import cma_es
from walking_irl.rl.cross_entropy import cross_entropy
from walking_irl.rl.episodes import Episodes, softmax_episodes, softmax_policy
from walking_irl.rl.finite_mdp import Actions
from walking_irl.rl.generative import generative_model, next_states, sampled_draws
from walking_irl.rl.gpomdp import gpomdp
from walking_irl.rl.lspi import Transitions, lspi
from walking_irl.rl.natural_gradient import ascend
from walking_irl.rl.q_features import BlockFeatures
from walking_irl.rl.reinforce import reinforce
from walking_irl.rl.search import Found, Objective
from walking_irl.rl.simulated_annealing import simulated_annealing

BASES = 7
"""Radial basis functions along a side, for values; 49 in all, one spacing wide."""
POLICY_BASES = 6
"""The same for policies that gradients improve: 37 features for each action."""
SEARCH_BASES = 4
"""The same for policies that are searched without gradients: 17 features for each action."""
BOX = 10.0
"""Bound of a policy's parameters in annealing; exp(10) is as good as deterministic."""


class Solved(NamedTuple):
    """A policy of the grid, and what it took."""

    policy: Array | Actions
    """Deterministic (S,) or stochastic (S, A)."""
    samples: int
    """Transitions drawn; 0 for methods that read the model."""
    evaluations: int = 0
    """Policies evaluated exactly."""


Solver = Callable[[FiniteMDP, Array, np.random.Generator], Solved]


def _places(mdp: FiniteMDP) -> Array:
    """Row and column of every state, in [0, 1], shape (S, 2)."""
    size = round(mdp.n_states**0.5)
    return np.asarray(np.stack(np.divmod(np.arange(mdp.n_states), size), axis=1) / (size - 1))


def basis(mdp: FiniteMDP, n: int) -> Array:
    """n^2 radial basis functions and a constant, shape (S, n^2 + 1)."""
    centres = np.stack(np.meshgrid(*2 * [np.linspace(0, 1, n)]), axis=-1).reshape(-1, 2)
    return radial_basis(centres, 1 / (n - 1))(_places(mdp))


def _from_model(
    solver: Callable[[FiniteMDP, Array], object], mdp: FiniteMDP, w: Array,
    rng: np.random.Generator,
) -> Solved:  # fmt: skip
    return Solved(solver(mdp, w).pi, 0)  # type: ignore[attr-defined]


def _fitted(
    approximator: Callable[[FiniteMDP], Approximator], n_draws: int, mdp: FiniteMDP, w: Array,
    rng: np.random.Generator,
) -> Solved:  # fmt: skip
    states = np.arange(mdp.n_states)
    step = generative_model(mdp, mdp.reward(w))
    draws = sampled_draws(step, states, mdp.n_actions, n_draws, rng=rng)
    fitted = approximate_value_iteration(
        states, draws, approximator(mdp), discount=mdp.discount, n_iter=80
    )
    return Solved(greedy(draws, fitted.value, mdp.discount), draws.rewards.size)


def _neighbours(mdp: FiniteMDP) -> Approximator:
    return nearest_neighbours(_places(mdp).__getitem__, 3)


def _lspi(n: int, mdp: FiniteMDP, w: Array, rng: np.random.Generator) -> Solved:
    s, a = rng.integers(mdp.n_states, size=n), rng.integers(mdp.n_actions, size=n)
    features = BlockFeatures(basis(mdp, BASES), mdp.n_actions)
    found = lspi(
        features,
        Transitions(s, a, mdp.reward(w)[s], next_states(mdp, s, a, rng)),
        lambda theta: features.greedy(theta).__getitem__,
        np.zeros(mdp.n_states, dtype=np.intp).__getitem__,
        discount=mdp.discount,
    )
    return Solved(features.greedy(found.theta), n)


def _policy_features(mdp: FiniteMDP, n: int) -> Array:
    """Of states and actions, shape (S, A, P), P = (n^2 + 1) A."""
    S, A = mdp.n_states, mdp.n_actions
    features = BlockFeatures(basis(mdp, n), A)
    s, a = np.divmod(np.arange(S * A), A)
    return features(s, a).reshape(S, A, -1)


def _gradient(
    estimate: Callable[[Episodes, float], Array], is_natural: bool, mdp: FiniteMDP, w: Array,
    rng: np.random.Generator, n: int = 200, horizon: int = 40, n_iter: int = 100, step: float = 4.0,
) -> Solved:  # fmt: skip
    psi = _policy_features(mdp, POLICY_BASES)
    ascent = ascend(
        np.zeros(psi.shape[2]),
        w,
        lambda theta: softmax_episodes(mdp, psi, theta, n=n, horizon=horizon, rng=rng),
        discount=mdp.discount,
        estimate=estimate,
        is_natural=is_natural,
        ridge=1.0,  # most states are visited rarely: an undamped Fisher matrix is noise there
        step=step,
        n_iter=n_iter,
    )
    return Solved(softmax_policy(psi, ascent.theta), n * horizon * n_iter)


def _searched(
    search: Callable[[Objective, int, np.random.Generator], Found], mdp: FiniteMDP, w: Array,
    rng: np.random.Generator,
) -> Solved:  # fmt: skip
    psi = _policy_features(mdp, SEARCH_BASES)

    def cost(theta: Array) -> float:
        return -float(w @ mdp.feature_expectations(softmax_policy(psi, theta)))

    found = search(cost, psi.shape[2], rng)
    return Solved(softmax_policy(psi, found.x), 0, found.n_evaluations)


def _cross_entropy(cost: Objective, P: int, rng: np.random.Generator) -> Found:
    return cross_entropy(cost, np.zeros(P), 3.0, rng=rng)


def _cma_es(cost: Objective, P: int, rng: np.random.Generator) -> Found:
    return cma_es(cost, np.zeros(P), 3.0, rng=rng)


def _annealing(cost: Objective, P: int, rng: np.random.Generator) -> Found:
    return simulated_annealing(cost, [(-BOX, BOX)] * P, rng=rng)


def _linear_fit(mdp: FiniteMDP) -> Approximator:
    return linear(basis(mdp, BASES).__getitem__)


SOLVERS: dict[str, Solver] = {
    "policy iteration": partial(_from_model, policy_iteration),
    "value iteration": partial(_from_model, value_iteration),
    "linear program": partial(_from_model, linear_program),
    "approximate value iteration, linear": partial(_fitted, _linear_fit, 10),
    "approximate value iteration, neighbours": partial(_fitted, _neighbours, 10),
    "LSPI": partial(_lspi, 10_000),
    "REINFORCE": partial(_gradient, reinforce, False),
    "GPOMDP": partial(_gradient, gpomdp, False),
    "natural gradient": partial(_gradient, gpomdp, True),
    "cross-entropy": partial(_searched, _cross_entropy),
    "CMA-ES": partial(_searched, _cma_es),
    "simulated annealing": partial(_searched, _annealing),
}
