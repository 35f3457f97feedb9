import numpy as np
import pytest
from scipy.optimize import minimize
from small_mdps import random_mdp

from walking_irl.baselines.mce import mce_likelihood, mce_matching, soft_regret
from walking_irl.domains.mdp.gridworld import Gridworld
from walking_irl.errors import InvalidInputError
from walking_irl.rl.demonstrations import demonstrate
from walking_irl.rl.policy_iteration import policy_iteration
from walking_irl.rl.soft import soft_policy
from walking_irl.rl.tabular import loss
from walking_irl.types import Expert, Status


def exact(mu):
    return Expert(mu, np.zeros_like(mu))


def test_matching_recovers_a_soft_expert_from_exact_features():
    rng = np.random.default_rng(0)
    mdp = random_mdp(rng)
    w_E = 5 * rng.dirichlet(np.ones(4))
    mu_E = mdp.feature_expectations(soft_policy(mdp, mdp.Phi @ w_E).pi)
    found = mce_matching(mdp, exact(mu_E), ridge=0.0)
    np.testing.assert_allclose(found.w, w_E, atol=1e-5)
    assert found.info["residual"] <= 1e-6
    assert found.space == "free" and found.status is Status.CONVERGED
    np.testing.assert_allclose(found.reward, mdp.Phi @ found.w)


def test_likelihood_recovers_a_soft_expert_the_better_the_more_it_sees():
    rng = np.random.default_rng(1)
    mdp = random_mdp(rng)
    w_E = 5 * rng.dirichlet(np.ones(4))
    pi = soft_policy(mdp, mdp.Phi @ w_E).pi
    errors = []
    for n in (30, 30_000):
        D = demonstrate(mdp, pi, n, 10, rng=rng)
        errors.append(np.abs(mce_likelihood(mdp, D, ridge=0.0).w - w_E).max())
    assert errors[1] < 0.1 * errors[0]  # the rate n^-1/2 says 1/32
    assert errors[1] < 0.1


def test_a_deterministic_expert_stays_finite_and_is_explained():
    mdp = Gridworld(8, 2).mdp
    w_E = np.array([0.1, 0.2, 0.3, 0.4])
    solution = policy_iteration(mdp, w_E)
    small, large = (mce_matching(mdp, exact(solution.mu), ridge=r) for r in (1e-3, 1e-1))
    assert np.abs(large.w).max() < np.abs(small.w).max() < 1e3
    assert loss(mdp, mdp.Phi @ w_E, small.policy) <= 1e-3
    assert not small.notes
    far = mce_matching(mdp, exact(solution.mu), ridge=1e-12)
    assert "infinity" in far.notes[0]


def test_soft_regret_lies_between_the_regret_and_its_temperature_bound():
    rng = np.random.default_rng(2)
    mdp = random_mdp(rng)
    mu_E = policy_iteration(mdp, np.array([0.4, 0.3, 0.2, 0.1])).mu
    for tau in (1.0, 0.1, 0.01):
        bound = tau * np.log(3) / (1 - 0.9)
        for w in rng.dirichlet(np.ones(4), 10):
            f = w @ policy_iteration(mdp, w).mu - w @ mu_E
            f_tau = soft_regret(mdp, w, mu_E, temperature=tau)[0]
            assert f - 1e-9 <= f_tau <= f + bound + 1e-9


def test_minimiser_of_the_soft_regret_has_at_most_the_bounds_regret():
    rng = np.random.default_rng(3)
    mdp = random_mdp(rng)
    mu_E = policy_iteration(mdp, np.array([0.4, 0.3, 0.2, 0.1])).mu  # least regret is 0
    regrets = []
    for tau in (1.0, 0.1, 0.01):
        result = minimize(
            lambda w, tau=tau: soft_regret(mdp, w, mu_E, temperature=tau)[:2],
            np.full(4, 0.25),
            jac=True,
            bounds=[(0, 1)] * 4,
            constraints={"type": "eq", "fun": lambda w: w.sum() - 1, "jac": np.ones_like},
            method="SLSQP",
        )
        w = result.x / result.x.sum()
        regrets.append(w @ policy_iteration(mdp, w).mu - w @ mu_E)
        assert regrets[-1] <= tau * np.log(3) / (1 - 0.9)
    assert regrets[-1] <= regrets[0]


def test_soft_regrets_gradient_is_its_derivative():
    rng = np.random.default_rng(4)
    mdp = random_mdp(rng)
    w, mu_E = rng.standard_normal(4), rng.standard_normal(4)
    _, gradient, _ = soft_regret(mdp, w, mu_E, temperature=0.3)
    h = 1e-5
    difference = [
        (
            soft_regret(mdp, w + h * e, mu_E, temperature=0.3)[0]
            - soft_regret(mdp, w - h * e, mu_E, temperature=0.3)[0]
        )
        / (2 * h)
        for e in np.eye(4)
    ]
    np.testing.assert_allclose(difference, gradient, atol=1e-6 * np.abs(gradient).max())


def test_negative_ridges_are_refused():
    mdp = random_mdp(np.random.default_rng(5))
    with pytest.raises(InvalidInputError, match="ridge"):
        mce_matching(mdp, exact(np.zeros(4)), ridge=-1.0)
