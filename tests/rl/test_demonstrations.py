import numpy as np
import pytest
from small_mdps import random_mdp

from walking_irl.domains.mdp.gridworld import Gridworld
from walking_irl.errors import InvalidInputError
from walking_irl.rl.demonstrations import Demonstrations, demonstrate

TWO = Demonstrations(np.array([[0, 1, 1], [2, 0, 1]]), np.array([[0, 1, 1], [0, 0, 1]]))


def test_counts_visits_and_features_of_a_small_example():
    np.testing.assert_array_equal(TWO.counts(3, 2), [[2, 0], [0, 3], [1, 0]])
    np.testing.assert_array_equal(TWO.start(3), [0.5, 0.0, 0.5])
    Phi = np.eye(3)
    np.testing.assert_allclose(TWO.features(Phi, 0.5), [[1, 0.75, 0], [0.5, 0.25, 1]])
    mass = 1 - 0.5**3
    np.testing.assert_allclose(TWO.visits(3, 0.5), np.array([0.75, 0.5, 0.5]) / mass)
    np.testing.assert_allclose(TWO.feature_expectations(Phi, 0.5), TWO.visits(3, 0.5))
    expert = TWO.expert(Phi, 0.5)
    np.testing.assert_allclose(expert.mu, TWO.visits(3, 0.5))
    assert expert.n_samples == 2 and (expert.error > 0).all()


def test_drawn_frequencies_are_those_of_policy_and_world():
    rng = np.random.default_rng(0)
    mdp = random_mdp(rng, S=4, A=2, K=2)
    policy = rng.dirichlet(np.ones(2), 4)
    D = demonstrate(mdp, policy, 20_000, 3, rng=rng)
    start, n = mdp.start, 20_000
    assert np.abs(D.start(4) - start).max() <= 5 * 0.5 / np.sqrt(n)
    T = mdp.T.toarray().reshape(2, 4, 4)
    pairs = np.zeros((2, 4, 4))
    np.add.at(pairs, (D.actions[:, 0], D.states[:, 0], D.states[:, 1]), 1 / n)
    expected = start[None, :, None] * policy.T[:, :, None] * T
    assert np.abs(pairs - expected).max() <= 5 * 0.5 / np.sqrt(n)


def test_mean_features_of_long_trajectories_are_the_exact_ones():
    rng = np.random.default_rng(1)
    mdp = random_mdp(rng)
    pi = rng.integers(3, size=25)
    D = demonstrate(mdp, pi, 2000, 100, rng=rng)
    expert = D.expert(mdp.Phi, mdp.discount)
    assert (np.abs(expert.mu - mdp.feature_expectations(pi)) <= 2 * expert.error).all()


def test_a_deterministic_world_is_followed_step_by_step():
    mdp = Gridworld(8, 2, success=1.0).mdp
    right = np.zeros(64, dtype=int)
    start = np.eye(64)[16]
    D = demonstrate(mdp, right, 1, 10, rng=np.random.default_rng(2), start=start)
    np.testing.assert_array_equal(D.states[0], [16, 17, 18, 19, 20, 21, 22, 23, 23, 23])


def test_the_same_seed_gives_the_same_demonstrations():
    mdp = random_mdp(np.random.default_rng(3))
    pi = np.zeros(25, dtype=int)
    one, two = (demonstrate(mdp, pi, 5, 6, rng=np.random.default_rng(0)) for _ in range(2))
    np.testing.assert_array_equal(one.states, two.states)


def test_bad_demonstrations_are_named():
    ok = np.zeros((2, 3), dtype=int)
    with pytest.raises(InvalidInputError, match="at least one trajectory"):
        Demonstrations(np.empty((0, 3), dtype=int), np.empty((0, 3), dtype=int))
    with pytest.raises(InvalidInputError, match="needs one action"):
        Demonstrations(ok, ok[:, :2])
    with pytest.raises(InvalidInputError, match="whole numbers"):
        Demonstrations(ok + 0.5, ok)
    with pytest.raises(InvalidInputError, match="finite"):
        Demonstrations(np.full((1, 2, 3), np.nan), np.zeros((1, 2, 1)))
    with pytest.raises(InvalidInputError, match="states must lie from 0 to 1"):
        TWO.counts(2, 2)
    with pytest.raises(InvalidInputError, match="actions must lie from 0 to 0"):
        TWO.counts(3, 1)
    with pytest.raises(InvalidInputError, match="finite world"):
        Demonstrations(np.zeros((1, 2, 3)), np.zeros((1, 2, 1))).counts(3, 2)
    mdp = random_mdp(np.random.default_rng(4))
    rng = np.random.default_rng(0)
    with pytest.raises(InvalidInputError, match="at least one trajectory"):
        demonstrate(mdp, np.zeros(25, dtype=int), 0, 3, rng=rng)
    with pytest.raises(InvalidInputError, match="from 0 to 2"):
        demonstrate(mdp, np.full(25, 3), 1, 3, rng=rng)
    with pytest.raises(InvalidInputError, match="each of 25 states"):
        demonstrate(mdp, np.zeros(24, dtype=int), 1, 3, rng=rng)
    with pytest.raises(InvalidInputError, match="sum to 1"):
        demonstrate(mdp, np.ones((25, 3)), 1, 3, rng=rng)
