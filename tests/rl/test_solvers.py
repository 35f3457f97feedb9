import numpy as np
import pytest
from scipy import sparse
from small_mdps import random_mdp, simulated_mu

from walking_irl.domains.lqr import LQR
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.rl import FiniteMDP, linear_program, policy_iteration, value_iteration
from walking_irl.rl.riccati import closed_loop_cost, optimal_gain


@pytest.mark.parametrize("seed", range(5))
def test_three_solvers_agree_on_values_and_features(seed):
    rng = np.random.default_rng(seed)
    mdp = random_mdp(rng)
    w = rng.dirichlet(np.ones(4))
    exact = policy_iteration(mdp, w)
    for other in (value_iteration(mdp, w, tol=1e-9), linear_program(mdp, w)):
        np.testing.assert_allclose(other.V, exact.V, atol=1e-7)
        assert w @ other.mu == pytest.approx(w @ exact.mu, abs=1e-7)


@pytest.mark.parametrize("tol", [1.0, 1e-2, 1e-6])
def test_value_iteration_keeps_its_stated_tolerance(tol):
    for seed in range(10):
        rng = np.random.default_rng(seed)
        mdp = random_mdp(rng, discount=0.95)
        w = rng.dirichlet(np.ones(4))
        loss = policy_iteration(mdp, w).V - value_iteration(mdp, w, tol=tol).V
        assert loss.max() <= tol
        assert loss.min() >= -1e-9


def test_no_single_change_of_action_improves_the_optimal_policy():
    rng = np.random.default_rng(3)
    mdp = random_mdp(rng)
    w = rng.standard_normal(4)
    solution = policy_iteration(mdp, w)
    Q = mdp.action_values(mdp.reward(w), solution.V)
    assert (Q <= solution.V + 1e-9).all()


def test_ties_keep_the_previous_action():
    rng = np.random.default_rng(0)
    mdp = random_mdp(rng)
    start = rng.integers(3, size=mdp.n_states)
    tied = policy_iteration(mdp, np.zeros(4), pi=start)
    np.testing.assert_array_equal(tied.pi, start)


def test_exact_features_match_simulation():
    rng = np.random.default_rng(1)
    mdp = random_mdp(rng)
    solution = policy_iteration(mdp, rng.dirichlet(np.ones(4)))
    mean, error = simulated_mu(mdp, solution.pi, rng)
    assert (np.abs(mean - solution.mu) <= 5 * error).all()


def test_mixture_and_its_stationary_policy_have_the_same_features():
    rng = np.random.default_rng(2)
    mdp = random_mdp(rng)
    policies = [policy_iteration(mdp, w).pi for w in np.eye(4)]
    mixture = rng.dirichlet(np.ones(4))
    pi, mu = mdp.stationary_policy(policies, mixture)
    np.testing.assert_allclose(pi.sum(axis=1), 1.0)
    expected = mixture @ [mdp.feature_expectations(p) for p in policies]
    np.testing.assert_allclose(mu, expected, atol=1e-12)


def test_visits_sum_to_the_horizon():
    mdp = random_mdp(np.random.default_rng(4))
    pi = np.zeros(mdp.n_states, dtype=int)
    assert mdp.visits(pi).sum() == pytest.approx(10.0)


def test_bad_worlds_and_weights_are_named():
    mdp = random_mdp(np.random.default_rng(0))
    with pytest.raises(InvalidInputError, match="discount"):
        FiniteMDP(mdp.T, mdp.Phi, mdp.start, 1.0)
    with pytest.raises(InvalidInputError, match="sum to 1"):
        FiniteMDP(2 * mdp.T, mdp.Phi, mdp.start, 0.9)
    with pytest.raises(InvalidInputError, match="needs transitions"):
        FiniteMDP(sparse.eye_array(7), mdp.Phi, mdp.start, 0.9)
    with pytest.raises(InvalidInputError, match="4 finite numbers"):
        policy_iteration(mdp, np.array([1.0, np.nan, 0.0, 0.0]))
    with pytest.raises(InvalidInputError, match="tol must be positive"):
        value_iteration(mdp, np.ones(4) / 4, tol=0.0)
    with pytest.raises(SolverError, match="after 1 improvements"):
        policy_iteration(mdp, np.eye(4)[0], max_iter=1)


def test_riccati_gain_is_optimal_and_its_cost_is_the_simulated_one():
    rng = np.random.default_rng(5)
    n, discount = 3, 0.9
    A, B = rng.standard_normal((n, n)) * 0.5, rng.standard_normal((n, 2))
    Q, R = np.diag([1.0, 0.5, 2.0]), np.diag([0.3, 1.0])
    k, P = optimal_gain(A, B, Q, R, discount)
    np.testing.assert_allclose(closed_loop_cost(A, B, k, Q, R, discount), P, rtol=1e-9)
    x0 = rng.standard_normal(n)
    x, cost = x0, 0.0
    for t in range(2000):
        u = k @ x
        cost += discount**t * (x @ Q @ x + u @ R @ u)
        x = A @ x + B @ u
    assert cost == pytest.approx(x0 @ P @ x0, rel=1e-10)
    for _ in range(20):
        other = k + 0.05 * rng.standard_normal(k.shape)
        assert x0 @ closed_loop_cost(A, B, other, Q, R, discount) @ x0 > cost


def test_unstable_gain_is_refused():
    eye = np.eye(2)
    with pytest.raises(InvalidInputError, match="infinite cost"):
        closed_loop_cost(eye, eye, 0.5 * eye, eye, eye, 0.9)


@pytest.mark.parametrize("n", [2, 3, 5])
def test_lqr_front_equals_the_matrix_riccati_solution(n):
    problem, eye = LQR(n), np.eye(n)
    Q_i = problem.mixing + (1 - 2 * problem.mixing) * eye
    rng = np.random.default_rng(n)
    for w in rng.dirichlet(np.ones(n), 5):
        Q, R = np.diag(w @ Q_i), np.diag(w @ (1 - Q_i))
        k, P = optimal_gain(eye, eye, Q, R, problem.discount)
        response = problem.forward(w)
        np.testing.assert_allclose(np.diag(k), response.policy, rtol=1e-9)
        x0 = np.full(n, problem.start)
        assert w @ response.mu == pytest.approx(-x0 @ P @ x0, rel=1e-9)
        for i in range(n):
            cost = closed_loop_cost(eye, eye, k, np.diag(Q_i[i]), np.diag(1 - Q_i[i]), 0.9)
            assert response.mu[i] == pytest.approx(-x0 @ cost @ x0, rel=1e-9)
