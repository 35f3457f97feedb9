"""How each forward method is set up on the LQR; policies are gains of the axes, u = k x."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.domains.lqr import LQR
from walking_irl.rl.approximate_value_iteration import approximate_value_iteration
from walking_irl.rl.approximators import linear
from walking_irl.rl.cma_es import cma_es
from walking_irl.rl.cross_entropy import cross_entropy
from walking_irl.rl.episodes import Episodes, gaussian_episodes
from walking_irl.rl.generative import sampled_draws
from walking_irl.rl.gpomdp import gpomdp
from walking_irl.rl.lspi import Policy, Transitions, lspi
from walking_irl.rl.natural_gradient import ascend
from walking_irl.rl.q_features import QuadraticFeatures
from walking_irl.rl.reinforce import reinforce
from walking_irl.rl.riccati import optimal_gain
from walking_irl.rl.search import Found, Objective
from walking_irl.rl.simulated_annealing import simulated_annealing

LEVELS = 9
"""Gains between 0 and -1 that approximate value iteration may choose from, on each axis."""
MAX_ACTIONS = 1000
"""Combinations of them that it can still maximise over."""
FIRST = -0.5
"""Gain that searches start from, in the middle of what is stable without discount."""


class Solved(NamedTuple):
    """Gains, and what they took."""

    gains: Array
    """Shape (K,)."""
    samples: int
    """Transitions drawn; 0 for methods that read the model or evaluate gains exactly."""
    evaluations: int = 0
    """Gains evaluated exactly."""


Solver = Callable[[LQR, Array, np.random.Generator], Solved]


def charges(problem: LQR) -> tuple[Array, Array]:
    """What each objective charges for states and controls, shape (K, K): row i is objective i's."""
    Q = problem.mixing + (1 - 2 * problem.mixing) * np.eye(problem.n_objectives)
    return Q, 1 - Q


def _riccati(problem: LQR, w: Array, rng: np.random.Generator) -> Solved:
    Q, R = charges(problem)
    eye = np.eye(problem.n_objectives)
    k, _ = optimal_gain(eye, eye, np.diag(w @ Q), np.diag(w @ R), problem.discount)
    return Solved(np.diag(k), 0)


def can_enumerate(problem: LQR) -> bool:
    """Whether approximate value iteration can maximise over every combination of gains."""
    return int(LEVELS**problem.n_objectives) <= MAX_ACTIONS


def _fitted(problem: LQR, w: Array, rng: np.random.Generator) -> Solved:
    """V quadratic in x, controls u = c x with gains c on a grid; one greedy step in closed form."""
    K, g = problem.n_objectives, problem.discount
    Q, R = (w @ charge for charge in charges(problem))
    levels = np.linspace(-1.0, 0.0, LEVELS)
    C = np.stack(np.meshgrid(*K * [levels], indexing="ij"), axis=-1).reshape(-1, K)

    def step(x: Array, a: Indices, rng: np.random.Generator) -> tuple[Array, Array]:
        u = C[a] * x
        return x + u, -(x**2 @ Q + u**2 @ R)

    def products(x: Array) -> Array:
        i, j = np.triu_indices(K)
        return np.asarray(x[:, i] * x[:, j])

    states = problem.start * rng.standard_normal((50, K))
    draws = sampled_draws(step, states, len(C), 1, rng=rng)
    fitted = approximate_value_iteration(
        states, draws, linear(products, 0.0), discount=g, n_iter=60
    )
    eye = np.eye(K)
    P = np.array([-fitted.value(eye[[i]])[0] for i in range(K)])
    return Solved(-g * P / (R + g * P), draws.rewards.size)


def _lspi(n: int, problem: LQR, w: Array, rng: np.random.Generator) -> Solved:
    K = problem.n_objectives
    Q, R = (w @ charge for charge in charges(problem))
    x, u = rng.standard_normal((2, n, K))
    features = QuadraticFeatures(K, K)

    def improve(theta: Array) -> Policy:
        gain = features.greedy(theta)
        return lambda s: s @ gain.T

    samples = Transitions(x, u, -(x**2 @ Q + u**2 @ R), x + u)
    found = lspi(features, samples, improve, np.zeros_like, discount=problem.discount, ridge=0.0)
    return Solved(np.diag(features.greedy(found.theta)), n)


def episodes(
    problem: LQR, k: Array, *, spread: float, n: int, horizon: int, rng: np.random.Generator
) -> Episodes:
    """Episodes of gains with white noise on the controls."""
    Q, R = charges(problem)
    return gaussian_episodes(
        k,
        spread=spread,
        start=np.full(len(k), problem.start),
        step=lambda x, u: x + u,
        features=lambda x, u: -(x**2 @ Q.T + u**2 @ R.T),
        n=n,
        horizon=horizon,
        rng=rng,
    )


def _gradient(
    estimate: Callable[[Episodes, float], Array], is_natural: bool, problem: LQR, w: Array,
    rng: np.random.Generator, n: int = 200, horizon: int = 60, n_iter: int = 60,
) -> Solved:  # fmt: skip
    ascent = ascend(
        np.full(problem.n_objectives, FIRST),
        w,
        lambda k: episodes(problem, k, spread=1.0, n=n, horizon=horizon, rng=rng),
        discount=problem.discount,
        estimate=estimate,
        is_natural=is_natural,
        n_iter=n_iter,
    )
    return Solved(ascent.theta, n * horizon * n_iter)


def _searched(
    search: Callable[[Objective, int, np.random.Generator], Found], problem: LQR, w: Array,
    rng: np.random.Generator,
) -> Solved:  # fmt: skip
    stable = 1 / np.sqrt(problem.discount)

    def cost(k: Array) -> float:
        if np.abs(1 + k).max() >= stable:
            return np.inf
        return -float(w @ problem.evaluate(k))

    found = search(cost, problem.n_objectives, rng)
    return Solved(found.x, 0, found.n_evaluations)


def _cross_entropy(cost: Objective, P: int, rng: np.random.Generator) -> Found:
    return cross_entropy(cost, np.full(P, FIRST), 0.3, rng=rng)


def _cma_es(cost: Objective, P: int, rng: np.random.Generator) -> Found:
    return cma_es(cost, np.full(P, FIRST), 0.3, rng=rng)


def _annealing(cost: Objective, P: int, rng: np.random.Generator) -> Found:
    return simulated_annealing(cost, [(-1.5, 0.0)] * P, rng=rng)


SOLVERS: dict[str, Solver] = {
    "Riccati equation": _riccati,
    "approximate value iteration, linear": _fitted,
    "LSPI": partial(_lspi, 1000),
    "REINFORCE": partial(_gradient, reinforce, False),
    "GPOMDP": partial(_gradient, gpomdp, False),
    "natural gradient": partial(_gradient, gpomdp, True),
    "cross-entropy": partial(_searched, _cross_entropy),
    "CMA-ES": partial(_searched, _cma_es),
    "simulated annealing": partial(_searched, _annealing),
}
