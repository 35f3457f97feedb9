import itertools

import numpy as np
import pytest
from small_mdps import random_mdp

from walking_irl.baselines.maxent import backward, expected_visits, maxent
from walking_irl.baselines.relative_entropy import relative_entropy, reweight, thresholds
from walking_irl.domains.mdp.gridworld import Gridworld
from walking_irl.errors import InvalidInputError
from walking_irl.rl.demonstrations import demonstrate
from walking_irl.rl.tabular import uniform_policy

S, A, K, H = 3, 2, 2, 4


def small():
    rng = np.random.default_rng(0)
    mdp = random_mdp(rng, S=S, A=A, K=K)
    return mdp, demonstrate(mdp, uniform_policy(mdp), 40, H, rng=rng), rng


def paths(mdp):
    """Every path of H states and actions: first state, product of transitions, states (n, H)."""
    T = mdp.T.toarray().reshape(A, S, S)
    found = []
    for actions in itertools.product(range(A), repeat=H):
        for states in itertools.product(range(S), repeat=H):
            p = np.prod([T[actions[t], states[t], states[t + 1]] for t in range(H - 1)])
            found.append((states[0], p, states))
    first, p, states = zip(*found, strict=True)
    return np.array(first), np.array(p), np.array(states)


@pytest.mark.parametrize("discount", [1.0, 0.8])
def test_partition_function_and_visits_equal_the_sum_over_all_paths(discount):
    mdp, demonstrations, rng = small()
    r = rng.standard_normal(S)
    first, p, states = paths(mdp)
    powers = discount ** np.arange(H)
    weight = p * np.exp(r[states] @ powers)
    Z = np.bincount(first, weight, S)
    passed = backward(mdp, r, H, discount)
    np.testing.assert_allclose(passed.log_Z[0], np.log(Z), atol=1e-12)
    start = demonstrations.start(S)
    visits = np.zeros(S)
    for t in range(H):
        np.add.at(visits, states[:, t], powers[t] * (start / Z)[first] * weight)
    got = expected_visits(mdp, passed, start, "paths", discount)
    np.testing.assert_allclose(got, visits, atol=1e-12)


def test_visits_of_the_path_measure_are_the_gradient():
    mdp, demonstrations, rng = small()
    r, start, h = rng.standard_normal(S), demonstrations.start(S), 1e-6
    visits = expected_visits(mdp, backward(mdp, r, H), start, "paths")
    difference = [
        start
        @ (backward(mdp, r + h * e, H).log_Z[0] - backward(mdp, r - h * e, H).log_Z[0])
        / (2 * h)
        for e in np.eye(S)
    ]
    np.testing.assert_allclose(difference, visits, atol=1e-6)
    true = expected_visits(mdp, backward(mdp, r, H), start, "dynamics")
    assert true.sum() == pytest.approx(H)
    assert np.abs(true - visits).max() > 1e-3  # algorithm 1 follows no gradient here


def test_both_readings_agree_where_the_world_is_deterministic():
    mdp = Gridworld(8, 2, success=1.0).mdp
    r = np.random.default_rng(1).standard_normal(64)
    passed = backward(mdp, r, 6)
    one, two = (expected_visits(mdp, passed, mdp.start, v) for v in ("paths", "dynamics"))
    np.testing.assert_allclose(one, two, atol=1e-12)


def test_features_are_matched_and_stochastic_worlds_are_pointed_out():
    mdp, demonstrations, _ = small()
    found = maxent(mdp, demonstrations, ridge=0.0)
    assert found.info["residual"] <= 1e-3  # tolerance of L-BFGS
    assert "stochastic" in found.notes[0]
    assert np.diff(np.maximum.accumulate(found.objective)).min() >= 0
    printed = maxent(mdp, demonstrations, visits="dynamics", ridge=0.0, max_iter=300)
    assert printed.info["residual"] <= 0.05
    deterministic = Gridworld(8, 2, success=1.0).mdp
    D = demonstrate(
        deterministic, uniform_policy(deterministic), 5, 4, rng=np.random.default_rng(0)
    )
    assert not maxent(deterministic, D, max_iter=3).notes


def test_relative_entropy_of_all_paths_is_maxent():
    mdp, demonstrations, _ = small()
    first, p, states = paths(mdp)
    start = demonstrations.start(S)
    keep = (p > 0) & (start[first] > 0)
    # MaxEnt 2008 is conditional on the first state; with one first state both are the same
    s0 = int(np.argmax(start))
    D = type(demonstrations)(
        demonstrations.states[demonstrations.states[:, 0] == s0],
        demonstrations.actions[demonstrations.states[:, 0] == s0],
    )
    keep &= first == s0
    F, F_E = mdp.Phi[states[keep]].sum(axis=1), D.features(mdp.Phi, 1.0).mean(axis=0)
    scale = F.std(axis=0)
    both = reweight(F, F_E, log_ratio=np.log(p[keep]), ridge=0.0)
    path = maxent(mdp, D, ridge=0.0)
    np.testing.assert_allclose(both.w * scale, path.w * scale, atol=1e-3)  # L-BFGS tolerances
    np.testing.assert_allclose(both.p @ F, F_E, atol=1e-6)


def test_reweighting_satisfies_its_optimality_conditions():
    rng = np.random.default_rng(2)
    F = rng.standard_normal((300, 4)) * [1.0, 2.0, 0.5, 1.0]
    F_E, eps = np.array([0.5, -0.4, 0.01, 0.3]), np.array([0.1, 0.0, 0.2, 0.8])
    found = reweight(F, F_E, eps=eps)
    residual = F_E - found.p @ F
    assert (np.abs(residual) <= eps + 1e-6).all()
    active = np.abs(found.w) > 1e-6
    np.testing.assert_allclose(residual[active], (np.sign(found.w) * eps)[active], atol=1e-6)
    np.testing.assert_array_equal(active, [True, True, False, False])
    assert 1 <= found.n_effective <= 300


def test_a_feature_that_no_sample_varies_gets_no_weight():
    F = np.random.default_rng(3).standard_normal((50, 3))
    F[:, 1] = 2.0
    found = reweight(F, np.array([0.3, 5.0, 0.1]))
    assert found.w[1] == 0 and np.isfinite(found.w).all() and found.w[0] != 0


def test_the_papers_thresholds_make_all_weights_zero():
    eps = thresholds(20, np.ones(2), 0.9, 50, confidence=0.5)
    assert eps[0] == pytest.approx(np.sqrt(np.log(2) / 40) * (1 - 0.9**51) / 0.1)
    mdp, demonstrations, rng = small()
    found = relative_entropy(mdp, demonstrations, rng=rng, n_samples=200, confidence=0.95)
    assert not found.w.any()
    assert "exceeds every difference" in found.notes[0]


def test_relative_entropy_matches_features_on_its_samples_and_counts_them():
    mdp, demonstrations, rng = small()
    found = relative_entropy(mdp, demonstrations, rng=rng, n_samples=500, ridge=0.0)
    assert found.info["residual"] <= 1e-4
    assert 1 <= found.info["effective_sample_size"] <= 500
    far = reweight(np.array([[0.0], [1.0]] + [[0.01]] * 98), np.array([0.99]))
    assert far.n_effective < 2


def test_bad_settings_are_named():
    mdp, demonstrations, rng = small()
    with pytest.raises(InvalidInputError, match="unknown visits"):
        maxent(mdp, demonstrations, visits="both")
    with pytest.raises(InvalidInputError, match="finite features"):
        reweight(np.empty((0, 2)), np.zeros(2))
    with pytest.raises(InvalidInputError, match="confidence"):
        thresholds(20, np.ones(2), 0.9, 50, confidence=1.5)
