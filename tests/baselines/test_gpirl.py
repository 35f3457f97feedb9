from dataclasses import replace

import numpy as np
import pytest

from walking_irl.baselines.gpirl import (
    JITTER,
    gpirl,
    inducing_states,
    kernel,
    log_posterior,
)
from walking_irl.baselines.mce import mce_likelihood
from walking_irl.domains.mdp.objectworld import Objectworld
from walking_irl.errors import InvalidInputError
from walking_irl.rl.demonstrations import demonstrate
from walking_irl.rl.soft import mce_loglik
from walking_irl.rl.tabular import best_policy, loss


def seen(n=10, size=8, density=0.1, seed=0):
    world = Objectworld(size, density=density, seed=seed)
    rng = np.random.default_rng(seed)
    return world, demonstrate(world.mdp, world.own_policy(1.0), n, 8, rng=rng), rng


def test_gradient_of_every_block_is_the_one_of_differences():
    world, D, rng = seen()
    counts, X = D.counts(64, 5), world.mdp.Phi
    inducing = np.arange(0, 64, 4)
    x = np.r_[rng.random(16), 0.3 * rng.standard_normal(4) + 1, 1.0]
    L, h = log_posterior(x, world.mdp, counts, X, inducing), 1e-5
    difference = np.array(
        [
            (
                log_posterior(x + h * e, world.mdp, counts, X, inducing).value
                - log_posterior(x - h * e, world.mdp, counts, X, inducing).value
            )
            / (2 * h)
            for e in np.eye(len(x))
        ]
    )
    for block in (slice(0, 16), slice(16, 20), slice(20, 21)):
        size = np.abs(L.gradient[block]).max()
        assert np.abs(difference - L.gradient)[block].max() <= 1e-6 * size


def test_with_every_state_inducing_and_a_fixed_kernel_it_is_a_ridge_on_the_reward():
    world, D, _ = seen()
    mdp, counts = world.mdp, D.counts(64, 5)
    _, distinct = np.unique(world.mdp.Phi, axis=0, return_index=True)
    inducing = np.sort(distinct)
    relevance, beta = np.array([2.0, 1.0, 3.0, 1.0]), 4.0
    tail = np.r_[np.log(relevance), np.log(beta)]
    K = kernel(mdp.Phi[inducing], mdp.Phi[inducing], relevance, beta, is_same=True).K
    K += JITTER * beta * np.eye(len(inducing))
    u = np.random.default_rng(1).standard_normal(len(inducing))

    def through(v):
        L = log_posterior(np.r_[v, tail], mdp, counts, mdp.Phi, inducing)
        return L.value, L.reward

    value, reward = through(u)
    zero, nothing = through(np.zeros_like(u))
    ridge = 0.5 * u @ np.linalg.solve(K, u)
    likelihood = mce_loglik(mdp, reward, counts).value - mce_loglik(mdp, nothing, counts).value
    assert value - zero == pytest.approx(likelihood - ridge, rel=1e-9)


@pytest.mark.slow
def test_objectworld_rewards_are_found_where_linear_ones_are_not():
    gaussian, linear, transfer = [], [], []
    for seed in range(3):
        world = Objectworld(16, seed=seed)
        binary = Objectworld(16, seed=seed, features="binary").mdp
        rng = np.random.default_rng(seed)
        D = demonstrate(world.mdp, world.own_policy(1.0), 32, 8, rng=rng)
        found = gpirl(world.mdp, D, rng=rng, n_starts=3)
        gaussian.append(loss(world.mdp, world.reward, found.policy))
        linear.append(loss(world.mdp, world.reward, mce_likelihood(binary, D).policy))
        process = found.info["process"]
        np.testing.assert_allclose(process.predict(world.mdp.Phi), found.reward, atol=1e-6)
        other = Objectworld(16, seed=seed + 100)
        pi = best_policy(other.mdp, process.predict(other.mdp.Phi)).pi
        transfer.append(loss(other.mdp, other.reward, pi))
    assert np.mean(gaussian) <= 0.6 * np.mean(linear)
    assert np.mean(transfer) <= 0.3


def test_features_that_do_not_matter_lose_their_relevance():
    world = Objectworld(16, seed=1)
    rng = np.random.default_rng(1)
    D = demonstrate(world.mdp, world.own_policy(1.0), 64, 8, rng=rng)
    relevance = gpirl(world.mdp, D, rng=rng, n_starts=3).info["process"].relevance
    assert relevance[:2].max() <= 0.02 * relevance.max()  # inner colours are distractors


def test_inducing_states_are_the_seen_ones_without_twins():
    rng = np.random.default_rng(2)
    X, counts = np.arange(20.0)[:, None] // 2, np.zeros((20, 2))
    counts[[0, 1, 5, 8], 0] = 1
    filled = inducing_states(X, counts, 12, rng)
    assert len(np.unique(X[filled], axis=0)) == len(filled)
    assert {0, 2, 4} <= set(X[filled].ravel()) and len(filled) <= 10
    counts[:, 0] = 1
    assert len(inducing_states(np.arange(20.0)[:, None], counts, 7, rng)) == 7


def test_equal_features_do_not_make_the_kernel_singular():
    world, D, rng = seen(n=3)
    flat = replace(world.mdp, Phi=np.round(world.mdp.Phi, 1))
    found = gpirl(flat, D, rng=rng, n_starts=1, max_iter=5)
    assert np.isfinite(found.reward).all()


def test_features_of_another_world_are_refused():
    world, D, rng = seen(n=2)
    with pytest.raises(InvalidInputError, match=r"shape \(64, d\)"):
        gpirl(world.mdp, D, rng=rng, features=np.ones((3, 2)))
