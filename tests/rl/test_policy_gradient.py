"""Policy gradients against exact gradients of the LQR and of softmax policies."""

import numpy as np
import pytest
from small_mdps import random_mdp

from walking_irl.domains.lqr import LQR
from walking_irl.errors import InvalidInputError
from walking_irl.rl.episodes import (
    Episodes,
    gaussian_episodes,
    softmax_episodes,
    softmax_gradient,
    softmax_policy,
)
from walking_irl.rl.gpomdp import gpomdp
from walking_irl.rl.natural_gradient import ascend, fisher, natural_gradient
from walking_irl.rl.reinforce import reinforce

SPREAD, HORIZON = 1.0, 120  # 0.9^120 = 3e-6 of the discounted whole is cut off
PROBLEM = LQR(3, policy_noise=SPREAD**2)
K0 = np.array([-0.4, -0.6, -0.5])


def lqr_episodes(problem, k, n, rng, spread=SPREAD, horizon=HORIZON):
    eye = np.eye(problem.n_objectives)
    Q = problem.mixing + (1 - 2 * problem.mixing) * eye
    return gaussian_episodes(
        k,
        spread=spread,
        start=np.full(len(k), problem.start),
        step=lambda x, u: x + u,
        features=lambda x, u: -(x**2 @ Q.T + u**2 @ (1 - Q).T),
        n=n,
        horizon=horizon,
        rng=rng,
    )


def exact_gradient(problem, k, h=1e-5):
    """d mu / d k by central differences of the closed form, shape (P, K)."""
    steps = h * np.eye(len(k))
    return np.array([(problem.evaluate(k + s) - problem.evaluate(k - s)) / (2 * h) for s in steps])


@pytest.mark.parametrize("estimate", [reinforce, gpomdp])
@pytest.mark.parametrize("has_baseline", [True, False])
def test_mean_estimate_is_the_exact_gradient_of_every_feature(estimate, has_baseline):
    rng = np.random.default_rng(0)
    found = np.array(
        [
            estimate(lqr_episodes(PROBLEM, K0, 500, rng), 0.9, has_baseline=has_baseline)
            for _ in range(40)
        ]
    )
    error = found.std(axis=0, ddof=1) / np.sqrt(len(found))
    exact = exact_gradient(PROBLEM, K0)
    bias = 0.01 * np.abs(exact).max()  # the baseline's, of order 1/n at n = 500
    assert (np.abs(found.mean(axis=0) - exact) <= 5 * error + has_baseline * bias).all()


def rms(estimate, n, repeats, **options):
    """Relative root mean square error of the gradients of all features."""
    exact, rng = exact_gradient(PROBLEM, K0), np.random.default_rng(1)
    errors = [
        estimate(lqr_episodes(PROBLEM, K0, n, rng), 0.9, **options) - exact for _ in range(repeats)
    ]
    return float(np.sqrt(np.mean(np.square(errors))) / np.sqrt(np.mean(exact**2)))


def test_errors_fall_with_the_square_root_of_the_number_of_episodes():
    few, many = rms(gpomdp, 100, 40), rms(gpomdp, 1600, 10)
    assert few / many == pytest.approx(4.0, rel=0.35)  # 40 and 10 repetitions of 9 entries


def test_baselines_and_causality_each_lower_the_error():
    plain, better = rms(reinforce, 200, 12, has_baseline=False), rms(reinforce, 200, 12)
    causal, best = rms(gpomdp, 200, 12, has_baseline=False), rms(gpomdp, 200, 12)
    assert better < plain / 4
    assert best < causal / 4
    assert causal < plain
    assert best < better


def softmax_world(seed=0):
    rng = np.random.default_rng(seed)
    mdp = random_mdp(rng, S=8, A=3, K=2, discount=0.8)
    return mdp, rng.standard_normal((8, 3, 5)), rng.standard_normal(5)


def test_exact_softmax_gradient_matches_differences():
    mdp, psi, theta = softmax_world()
    exact, h = softmax_gradient(mdp, psi, theta), 1e-6
    for p, step in enumerate(h * np.eye(5)):
        up, down = (
            mdp.feature_expectations(softmax_policy(psi, t)) for t in (theta + step, theta - step)
        )
        np.testing.assert_allclose(exact[p], (up - down) / (2 * h), atol=1e-8)


@pytest.mark.parametrize("estimate", [reinforce, gpomdp])
def test_softmax_estimates_agree_with_the_exact_gradient(estimate):
    mdp, psi, theta = softmax_world(1)
    rng = np.random.default_rng(2)
    found = np.array(
        [
            estimate(softmax_episodes(mdp, psi, theta, n=1000, horizon=60, rng=rng), 0.8)
            for _ in range(20)
        ]
    )
    error = found.std(axis=0, ddof=1) / np.sqrt(len(found))
    exact = softmax_gradient(mdp, psi, theta)
    assert (np.abs(found.mean(axis=0) - exact) <= 5 * error + 0.005 * np.abs(exact).max()).all()


def test_natural_steps_do_not_depend_on_the_coordinates_of_the_parameters():
    """Theta = C phi: scores become C' score, and the natural step in theta must be the same."""
    mdp, psi, theta = softmax_world(3)
    episodes = softmax_episodes(mdp, psi, theta, n=200, horizon=30, rng=np.random.default_rng(4))
    C = np.random.default_rng(5).standard_normal((5, 5))
    moved = Episodes(episodes.scores @ C, episodes.features)
    steps = [
        natural_gradient(reinforce(e, 0.8, has_baseline=False), fisher(e, 0.8))
        for e in (episodes, moved)
    ]
    np.testing.assert_allclose(C @ steps[1], steps[0], rtol=1e-8)
    plain = [reinforce(e, 0.8, has_baseline=False) for e in (episodes, moved)]
    assert np.abs(C @ plain[1] - plain[0]).max() > 0.1 * np.abs(plain[0]).max()


@pytest.mark.parametrize("estimate", [reinforce, gpomdp])
@pytest.mark.parametrize("is_natural", [True, False])
def test_ascent_on_the_lqr_ends_near_the_best_gains(estimate, is_natural):
    rng = np.random.default_rng(6)
    w = np.array([0.2, 0.5, 0.3])
    first = np.full(3, -0.15)
    ascent = ascend(
        first,
        w,
        lambda k: lqr_episodes(PROBLEM, k, 100, rng, horizon=60),
        discount=0.9,
        estimate=estimate,
        is_natural=is_natural,
        n_iter=60,
    )
    best = float(w @ PROBLEM.evaluate(PROBLEM.gains(w)))
    loss = [(best - float(w @ PROBLEM.evaluate(k))) / abs(best) for k in (first, ascent.theta)]
    assert loss[0] > 0.1
    assert 0 <= loss[1] <= 1e-3  # the last steps are 0.013 long: their mean is off by as much
    assert ascent.path.shape == (61, 3)


def test_bad_settings_are_named():
    with pytest.raises(InvalidInputError, match="a spread > 0"):
        lqr_episodes(PROBLEM, K0, 10, np.random.default_rng(0), spread=0.0)
    with pytest.raises(InvalidInputError, match="steps of positive length"):
        ascend(K0, np.ones(3), lambda k: None, discount=0.9, n_iter=0)
