"""Approximate value iteration and LSPI against their exact special cases."""

import numpy as np
import pytest
from small_mdps import random_mdp

from walking_irl.domains.lqr import LQR
from walking_irl.domains.mdp.gridworld import Gridworld
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.rl import policy_iteration
from walking_irl.rl.approximate_value_iteration import approximate_value_iteration, greedy
from walking_irl.rl.approximators import linear, nearest_neighbours, radial_basis
from walking_irl.rl.generative import (
    Draws,
    exact_draws,
    generative_model,
    next_states,
    sampled_draws,
)
from walking_irl.rl.lspi import Ending, Transitions, lspi
from walking_irl.rl.q_features import BlockFeatures, QuadraticFeatures
from walking_irl.rl.riccati import optimal_gain


def loss(mdp, w, pi):
    """Share of the way from optimal to uniformly random, under reward w.phi."""
    best = w @ policy_iteration(mdp, w).mu
    chance = w @ mdp.feature_expectations(np.full((mdp.n_states, mdp.n_actions), 1 / mdp.n_actions))
    return (best - w @ mdp.feature_expectations(pi)) / (best - chance)


def places(size):
    return lambda s: np.stack(np.divmod(s, size), axis=1) / (size - 1)


@pytest.fixture(scope="module")
def grid():
    world = Gridworld(16, 3)
    w = np.random.default_rng(1).dirichlet(np.full(9, 0.3))
    return world.mdp, w, world.mdp.reward(w)


def test_one_hot_features_with_exact_expectations_are_value_iteration():
    mdp = random_mdp(np.random.default_rng(0))
    r = mdp.reward(np.array([0.1, 0.2, 0.3, 0.4]))
    states = np.arange(mdp.n_states)
    fitted = approximate_value_iteration(
        states,
        exact_draws(mdp, r),
        linear(np.eye(mdp.n_states).__getitem__, ridge=0.0),
        discount=mdp.discount,
        n_iter=50,
    )
    V = np.zeros(mdp.n_states)
    for _ in range(50):
        V = mdp.action_values(r, V).max(axis=0)
    np.testing.assert_allclose(fitted.value(states), V, rtol=0, atol=1e-12)


def test_random_next_states_follow_the_transition_matrix():
    mdp = random_mdp(np.random.default_rng(1), S=8)
    rng = np.random.default_rng(2)
    n = 20_000
    for s, a in [(0, 0), (3, 1), (7, 2)]:
        drawn = next_states(mdp, np.full(n, s), np.full(n, a), rng)
        p = mdp.T.toarray()[a * 8 + s]
        share = np.bincount(drawn, minlength=8) / n
        assert (np.abs(share - p) <= 5 * np.sqrt(p * (1 - p) / n)).all()


def test_nearest_neighbours_contract_by_the_discount(grid):
    mdp, _, r = grid
    rng = np.random.default_rng(0)
    states = rng.choice(256, 128, replace=False)
    draws = sampled_draws(generative_model(mdp, r), states, 4, 5, rng=rng)
    fitted = approximate_value_iteration(
        states, draws, nearest_neighbours(places(16), 3), discount=mdp.discount, n_iter=60
    )
    change = fitted.change
    assert (change[1:] <= mdp.discount * change[:-1] + 1e-12).all()


def test_more_draws_make_a_better_policy(grid):
    mdp, w, r = grid
    centres = np.stack(np.meshgrid(*2 * [np.linspace(0, 1, 7)]), axis=-1).reshape(-1, 2)
    basis = radial_basis(centres, 1 / 6)
    where, states, losses = places(16), np.arange(256), []
    for n_draws in (1, 10, 100):
        rng = np.random.default_rng(3)
        draws = sampled_draws(generative_model(mdp, r), states, 4, n_draws, rng=rng)
        fitted = approximate_value_iteration(
            states, draws, linear(lambda s: basis(where(s))), discount=0.9, n_iter=80
        )
        losses.append(loss(mdp, w, greedy(draws, fitted.value, 0.9)))
    assert losses[0] > losses[1] > losses[2]
    assert losses[2] <= 0.01  # 0.005 is usual: what 49 basis functions cost


def test_redrawn_outcomes_are_used(grid):
    mdp, _, r = grid
    rng = np.random.default_rng(4)
    states, calls = np.arange(256), []

    def redraw():
        calls.append(1)
        return sampled_draws(generative_model(mdp, r), states, 4, 2, rng=rng)

    fit = nearest_neighbours(places(16), 1)
    approximate_value_iteration(states, redraw(), fit, discount=0.9, n_iter=10, redraw=redraw)
    assert len(calls) == 10


def test_divergence_is_an_error_that_says_what_to_do():
    """Features 1 and 2, both states lead to the second (Tsitsiklis & Van Roy 1996, figure 1)."""
    states = np.array([0, 1])
    after = np.array([[[1], [1]]])
    draws = Draws(after, np.full((1, 2, 1), 1e-3), np.ones((1, 2, 1)))
    feature = np.array([[1.0], [2.0]])
    with pytest.raises(SolverError, match="diverges"):
        approximate_value_iteration(
            states, draws, linear(feature.__getitem__, 0.0), discount=0.95, n_iter=500
        )


def test_lspi_with_exact_rows_is_policy_iteration():
    mdp = random_mdp(np.random.default_rng(5))
    w = np.array([0.4, 0.1, 0.2, 0.3])
    S, A = mdp.n_states, mdp.n_actions
    rows, after = mdp.T.nonzero()
    actions, states = np.divmod(rows, S)
    r = mdp.reward(w)
    samples = Transitions(states, actions, r[states], after, mdp.T.tocsr().data)
    features = BlockFeatures(np.eye(S), A)
    found = lspi(
        features,
        samples,
        lambda theta: features.greedy(theta).__getitem__,
        np.zeros(S, dtype=int).__getitem__,
        discount=mdp.discount,
        ridge=0.0,
    )
    exact = policy_iteration(mdp, w)
    Q = mdp.action_values(r, exact.V)
    np.testing.assert_allclose(found.theta.reshape(A, S), Q, rtol=1e-12)
    np.testing.assert_array_equal(features.greedy(found.theta), exact.pi)
    assert found.ending is Ending.CONVERGED
    assert len(found.change) <= exact.n_iter + 1


def test_lspi_improves_with_samples():
    mdp = random_mdp(np.random.default_rng(6), S=30)
    w, losses = np.array([0.4, 0.1, 0.2, 0.3]), []
    r, rng = mdp.reward(w), np.random.default_rng(7)
    features = BlockFeatures(np.eye(30), 3)
    for n in (300, 3000, 30_000):
        s, a = rng.integers(30, size=n), rng.integers(3, size=n)
        samples = Transitions(s, a, r[s], next_states(mdp, s, a, rng))
        found = lspi(
            features,
            samples,
            lambda theta: features.greedy(theta).__getitem__,
            np.zeros(30, dtype=int).__getitem__,
            discount=mdp.discount,
        )
        losses.append(loss(mdp, w, features.greedy(found.theta)))
    assert losses[0] > losses[1] > losses[2]
    assert losses[2] <= 0.02  # of the order of the noise in 30000 / 90 samples of each row


@pytest.mark.parametrize("seed", range(3))
def test_lspi_finds_the_riccati_gains_from_noise_free_samples(seed):
    problem, rng = LQR(3), np.random.default_rng(seed)
    w = rng.dirichlet(np.ones(3))
    Q_i = problem.mixing + (1 - 2 * problem.mixing) * np.eye(3)
    Q, R = np.diag(w @ Q_i), np.diag(w @ (1 - Q_i))
    x, u = rng.standard_normal((2, 200, 3))
    r = -(x**2 @ np.diag(Q) + u**2 @ np.diag(R))
    features = QuadraticFeatures(3, 3)

    def improve(theta):
        k = features.greedy(theta)
        return lambda s: s @ k.T

    found = lspi(
        features, Transitions(x, u, r, x + u), improve, np.zeros_like, discount=0.9, ridge=0.0
    )
    exact, _ = optimal_gain(np.eye(3), np.eye(3), Q, R, 0.9)
    np.testing.assert_allclose(features.greedy(found.theta), exact, atol=1e-10)
    assert found.ending is Ending.CONVERGED
    assert len(found.change) <= 8  # quadratic convergence


def test_noisy_worlds_need_the_constant_feature():
    """Noise of +-0.1 on each axis, every combination listed: expectations are exact."""
    problem, rng = LQR(2), np.random.default_rng(0)
    w = np.array([0.3, 0.7])
    x, u = np.repeat(rng.standard_normal((2, 100, 2)), 4, axis=1)
    noise = np.tile([(-0.1, -0.1), (-0.1, 0.1), (0.1, -0.1), (0.1, 0.1)], (100, 1))
    r = -(x**2 @ (problem.mixing + 0.8 * w) + u**2 @ (0.9 - 0.8 * w))
    errors = []
    for has_constant in (False, True):
        features = QuadraticFeatures(2, 2, has_constant)

        def improve(theta, features=features):
            k = features.greedy(theta)
            return lambda s: s @ k.T

        samples = Transitions(x, u, r, x + u + noise)
        found = lspi(features, samples, improve, np.zeros_like, discount=0.9, ridge=0.0)
        errors.append(np.abs(np.diag(features.greedy(found.theta)) - problem.gains(w)).max())
    assert errors[1] <= 1e-10
    assert errors[0] >= 1e-3


def test_lspi_reports_policies_that_cycle():
    features = lambda s, a: np.where(a == 0, 1.0, -1.0)[:, None]  # noqa: E731
    here = np.zeros(4, dtype=int)
    samples = Transitions(here, np.array([0, 0, 0, 1]), np.array([1.0, 1.0, 1.0, 0.0]), here)
    answers = iter([1, 0, 1, 0, 1])

    def improve(theta):
        a = next(answers)
        return lambda s: np.full(len(s), a)

    found = lspi(features, samples, improve, lambda s: np.zeros(len(s), int), discount=0.9)
    assert found.ending is Ending.CYCLES
    assert len(found.change) == 2


def test_bad_input_is_named(grid):
    mdp, _, r = grid
    draws = exact_draws(mdp, r)
    with pytest.raises(InvalidInputError, match="draws of 3 states"):
        fit = linear(np.eye(3).__getitem__)
        approximate_value_iteration(np.arange(3), draws, fit, discount=0.9)
    with pytest.raises(InvalidInputError, match="k >= 1, got 0"):
        nearest_neighbours(places(16), 0)
    with pytest.raises(InvalidInputError, match="as many samples, got 2"):
        nearest_neighbours(places(16), 3)(np.arange(2), np.zeros(2))
    with pytest.raises(InvalidInputError, match="256 finite numbers"):
        generative_model(mdp, np.full(256, np.nan))
    none = Transitions(np.zeros(0, int), np.zeros(0, int), np.zeros(0), np.zeros(0, int))
    with pytest.raises(InvalidInputError, match="expected 0 > 0 states"):
        lspi(BlockFeatures(np.eye(2), 2), none, lambda t: np.sign, np.sign, discount=0.9)
    with pytest.raises(SolverError, match="no maximum over the controls"):
        QuadraticFeatures(1, 1).greedy(np.zeros(3))
