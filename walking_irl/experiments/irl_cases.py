"""The finite worlds of table 3.1b: a ground-truth reward, its expert and what is seen of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.mdp.gridworld import Gridworld
from walking_irl.domains.mdp.objectworld import Objectworld
from walking_irl.domains.mdp.random_mdp import RandomMDP
from walking_irl.domains.mdp.soft_expert import SCALE
from walking_irl.rl.demonstrations import Demonstrations, demonstrate
from walking_irl.rl.finite_mdp import Actions, FiniteMDP
from walking_irl.rl.soft import soft_policy
from walking_irl.rl.tabular import best_policy


@dataclass(frozen=True)
class Case:
    """One expert to be learnt from.

    Attributes:
        mdp: The world with the features that linear methods get.
        raw: Features that non-linear methods get, shape (S, d).
        reward: The true reward, for scoring only, shape (S,).
        policy: The expert's own policy, (S,) or (S, A); methods that need a complete policy see it.
        demonstrations: What the others see.
        is_nonnegative: Whether the true weights are known to be >= 0.
    """

    mdp: FiniteMDP
    raw: Array
    reward: Array
    policy: Array | Actions
    demonstrations: Demonstrations
    is_nonnegative: bool


def random_mdp(is_soft: bool, n: int, seed: int) -> Case:
    """Another random world for each seed, weights uniform on the simplex, n trajectories of 50."""
    mdp, rng = RandomMDP(seed=seed).mdp, np.random.default_rng([seed, 31])
    return _linear(mdp, rng.dirichlet(np.ones(mdp.n_objectives)), mdp.Phi, is_soft, n, rng)


def gridworld(is_soft: bool, n: int, seed: int) -> Case:
    """Nine patches on 16 x 16 cells with sparse weights, n trajectories of 50."""
    world, rng = Gridworld(16, 3), np.random.default_rng([seed, 32])
    rows, columns = np.divmod(np.arange(world.mdp.n_states), world.size)
    places = np.stack([rows, columns], axis=1) / world.size
    raw = np.hstack([world.mdp.Phi, places])
    return _linear(world.mdp, world.random_weights("sparse", rng), raw, is_soft, n, rng)


def _linear(
    mdp: FiniteMDP, w: Array, raw: Array, is_soft: bool, n: int, rng: np.random.Generator
) -> Case:
    r = mdp.reward(w)
    policy = soft_policy(mdp, SCALE * r).pi if is_soft else best_policy(mdp, r).pi
    return Case(mdp, raw, r, policy, demonstrate(mdp, policy, n, 50, rng=rng), True)


def objectworld(is_soft: bool, n: int, seed: int) -> Case:
    """Another Objectworld for each seed, n trajectories of 8 steps as in the paper."""
    world, rng = Objectworld(16, features="binary", seed=seed), np.random.default_rng([seed, 33])
    policy = world.own_policy(1.0 if is_soft else 0.0)
    seen = demonstrate(world.mdp, policy, n, 8, rng=rng)
    raw = world.distances / world.size
    return Case(world.mdp, raw, world.reward, policy, seen, False)


CASES: dict[str, Callable[[bool, int, int], Case]] = {
    "random MDP": random_mdp,
    "gridworld": gridworld,
    "Objectworld": objectworld,
}
"""Each takes: whether the expert is soft, the number of trajectories, the seed."""
