import numpy as np
import pytest
from small_mdps import random_mdp

from walking_irl.errors import InvalidInputError
from walking_irl.rl.chain import Chain
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.rl.policy_iteration import policy_iteration
from walking_irl.rl.soft import boltzmann, mce_loglik, soft_policy
from walking_irl.rl.successor import successor
from walking_irl.rl.tabular import best_policy, loss, policy_value, uniform_policy


def stochastic(mdp: FiniteMDP, rng: np.random.Generator) -> np.ndarray:
    return rng.dirichlet(np.ones(mdp.n_actions), mdp.n_states)


def system(mdp: FiniteMDP, policy: np.ndarray) -> np.ndarray:
    """I - gamma T_pi, entry by entry."""
    chances = np.einsum("sa,ast->st", mdp.probabilities(policy), mdp.dense)
    return np.eye(mdp.n_states) - mdp.discount * chances


@pytest.mark.parametrize("n_states", [25, 320])  # dense and sparse
def test_chain_solves_the_system_of_the_mdp(n_states):
    rng = np.random.default_rng(0)
    mdp = random_mdp(rng, S=n_states)
    b = rng.standard_normal((n_states, 2))
    for policy in (stochastic(mdp, rng), rng.integers(3, size=n_states)):
        matrix, chain = system(mdp, policy), Chain(mdp, policy)
        np.testing.assert_allclose(chain.solve(b), np.linalg.solve(matrix, b), atol=1e-10)
        expected = np.linalg.solve(matrix.T, b[:, 0])
        np.testing.assert_allclose(chain.solve_transposed(b[:, 0]), expected, atol=1e-10)


def test_best_policy_agrees_with_policy_iteration_and_takes_rewards_of_actions():
    rng = np.random.default_rng(1)
    mdp = random_mdp(rng)
    w = rng.standard_normal(4)
    exact = policy_iteration(mdp, w)
    np.testing.assert_allclose(best_policy(mdp, mdp.reward(w)).V, exact.V, atol=1e-9)
    bonus = np.zeros((25, 3))
    bonus[:, 2] = 100.0
    assert (best_policy(mdp, mdp.reward(w)[:, None] + bonus).pi == 2).all()


def test_loss_is_0_for_the_best_and_1_for_chance_whatever_the_scale():
    rng = np.random.default_rng(2)
    mdp = random_mdp(rng)
    r = rng.standard_normal(25)
    pi = rng.integers(3, size=25)
    assert loss(mdp, r, best_policy(mdp, r).pi) == pytest.approx(0.0, abs=1e-12)
    assert loss(mdp, r, uniform_policy(mdp)) == pytest.approx(1.0)
    assert loss(mdp, 7 * r - 3, pi) == pytest.approx(loss(mdp, r, pi), abs=1e-9)
    with pytest.raises(InvalidInputError, match="as good as chance"):
        loss(mdp, np.ones(25), pi)


def test_soft_values_satisfy_their_bellman_equation_and_equal_sweeps():
    rng = np.random.default_rng(3)
    mdp = random_mdp(rng)
    r = 5 * rng.standard_normal(25)
    soft = soft_policy(mdp, r)
    V = np.zeros(25)
    for _ in range(400):  # 0.9^400 = 5e-19
        V = np.log(np.exp(mdp.action_values(r, V)).sum(axis=0))
    np.testing.assert_allclose(soft.V, V, atol=1e-8)
    np.testing.assert_allclose(soft.pi, np.exp(soft.Q - soft.V).T, atol=1e-9)
    again = soft_policy(mdp, r, V=soft.V)
    np.testing.assert_allclose(again.V, V, atol=1e-8)


def test_soft_value_is_the_policys_return_and_entropy():
    rng = np.random.default_rng(4)
    mdp = random_mdp(rng)
    r = rng.standard_normal(25)
    soft = soft_policy(mdp, r)
    entropy = -(soft.pi * np.log(soft.pi)).sum(axis=1)
    np.testing.assert_allclose(policy_value(mdp, soft.pi, r + entropy), soft.V, atol=1e-8)


def test_boltzmann_experts_range_from_chance_to_optimal():
    rng = np.random.default_rng(5)
    mdp = random_mdp(rng)
    r = rng.standard_normal(25)
    np.testing.assert_allclose(boltzmann(mdp, r, 0.0), uniform_policy(mdp))
    losses = [loss(mdp, r, boltzmann(mdp, r, beta)) for beta in (0.0, 1.0, 10.0, 1e4)]
    assert losses == sorted(losses, reverse=True)
    assert losses[-1] < 1e-6
    with pytest.raises(InvalidInputError, match="beta"):
        boltzmann(mdp, r, -1.0)


def test_likelihoods_gradient_is_its_derivative():
    rng = np.random.default_rng(6)
    mdp = random_mdp(rng)
    r, counts = rng.standard_normal(25), rng.integers(5, size=(25, 3)).astype(float)
    L = mce_loglik(mdp, r, counts)
    h = 1e-5
    difference = [
        (mce_loglik(mdp, r + h * e, counts).value - mce_loglik(mdp, r - h * e, counts).value)
        / (2 * h)
        for e in np.eye(25)
    ]
    size = np.abs(L.gradient).max()
    np.testing.assert_allclose(difference, L.gradient, atol=1e-6 * size)


def test_successor_features_give_the_values_of_any_weights():
    rng = np.random.default_rng(7)
    mdp = random_mdp(rng)
    pi = rng.integers(3, size=25)
    Psi = successor(mdp, pi)
    for w in rng.standard_normal((3, 4)):
        V = np.linalg.solve(system(mdp, pi), mdp.reward(w))
        np.testing.assert_allclose((Psi @ w).T, mdp.action_values(mdp.reward(w), V), atol=1e-9)


@pytest.mark.parametrize("solve", [best_policy, soft_policy])
def test_rewards_that_are_not_finite_are_refused(solve):
    mdp = random_mdp(np.random.default_rng(8))
    for bad in (np.full(25, np.nan), np.zeros(24)):
        with pytest.raises(InvalidInputError, match="reward must be finite with shape"):
            solve(mdp, bad)
