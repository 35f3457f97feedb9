import numpy as np
import pytest
from small_mdps import random_mdp

from walking_irl.baselines.girl import girl
from walking_irl.baselines.policy_matching import (
    boltzmann_policy,
    match_policy,
    natural_step,
    policy_matching,
)
from walking_irl.domains.lqr import LQR
from walking_irl.domains.path.walking_path import WalkingPath
from walking_irl.errors import InvalidInputError
from walking_irl.rl.demonstrations import demonstrate
from walking_irl.types import Status


def boltzmann_expert(seed, beta=1.0, scale=5.0):
    rng = np.random.default_rng(seed)
    mdp = random_mdp(rng)
    w_E = scale * rng.dirichlet(np.ones(4))
    policy = boltzmann_policy(mdp, w_E, beta)[0]
    return mdp, w_E, policy, mdp.visits(policy) * (1 - mdp.discount), rng


def test_policys_derivative_is_the_one_of_differences():
    mdp, w, _, _, _ = boltzmann_expert(0)
    dP, h = boltzmann_policy(mdp, w, 2.0)[1], 1e-6
    for k, e in enumerate(np.eye(4)):
        up, down = (boltzmann_policy(mdp, w + s * h * e, 2.0)[0] for s in (1, -1))
        difference = (up - down) / (2 * h)
        assert np.abs(difference - dP[:, :, k]).max() <= 1e-7 * np.abs(dP).max() + 1e-9


def test_natural_gradient_is_the_gauss_newton_step():
    mdp, w_E, policy, visits, rng = boltzmann_expert(1)
    w = w_E + 0.3 * rng.standard_normal(4)
    P, dP, _ = boltzmann_policy(mdp, w, 1.0)
    gradient = 2 * np.einsum("s,sa,sak->k", visits, P - policy, dP)
    metric = np.einsum("s,sak,sal->kl", visits, dP, dP)

    def J(v):
        return (visits[:, None] * (boltzmann_policy(mdp, v, 1.0)[0] - policy) ** 2).sum()

    h = 1e-6
    difference = [(J(w + h * e) - J(w - h * e)) / (2 * h) for e in np.eye(4)]
    np.testing.assert_allclose(difference, gradient, atol=1e-6 * np.abs(gradient).max())
    natural = -0.5 * np.linalg.pinv(metric) @ gradient
    root = np.sqrt(visits)[:, None]
    step = natural_step((root * (P - policy)).ravel(), (root[:, :, None] * dP).reshape(-1, 4))
    np.testing.assert_allclose(step, natural, rtol=1e-6)


@pytest.mark.parametrize(("step", "solves"), [("natural", 8), ("trust-region", 12)])
def test_boltzmann_experts_are_recovered_in_a_few_solves(step, solves):
    for seed in range(3):
        mdp, w_E, policy, visits, _ = boltzmann_expert(seed)
        found = match_policy(mdp, policy, visits, step=step)
        np.testing.assert_allclose(found.w, w_E, atol=1e-6)
        assert found.info["solves"] <= solves + 1
        assert found.status is Status.CONVERGED


@pytest.mark.parametrize("step", ["natural", "gradient"])
def test_the_distance_of_policies_never_rises(step):
    mdp, _, policy, visits, rng = boltzmann_expert(4)
    w, values = rng.standard_normal(4), []
    for n in range(2, 40, 6):  # more of the same deterministic search
        values.append(match_policy(mdp, policy, visits, step=step, w=w, max_solves=n).info["J"])
    assert (np.diff(values) <= 1e-15).all()
    assert values[-1] < values[0]


def test_demonstrated_shares_stand_for_the_policy():
    mdp, w_E, policy, _, rng = boltzmann_expert(5)
    D = demonstrate(mdp, policy, 4000, 20, rng=rng)
    found = policy_matching(mdp, D)
    np.testing.assert_allclose(found.w, w_E, atol=0.3)
    with pytest.raises(InvalidInputError, match="unknown step"):
        policy_matching(mdp, D, step="newton")


@pytest.mark.parametrize("K", [2, 3, 5, 8])
def test_girl_finds_the_weights_of_an_lqr_to_rounding(K):
    problem = LQR(K)
    for seed in range(3):
        w_E = np.random.default_rng(seed).dirichlet(np.ones(K))
        found = girl(problem.policy_gradient(problem.gains(w_E)))
        np.testing.assert_allclose(found.w, w_E, atol=1e-9)
        assert found.info["residual"] <= 1e-9
        assert found.info["singular_values"][-2] > 1e-6  # identifiable


def test_girls_gradient_of_the_lqr_is_the_one_of_its_evaluation():
    problem, h = LQR(3, policy_noise=0.3), 1e-6
    k = problem.gains(np.array([0.2, 0.3, 0.5]))
    difference = [
        (problem.evaluate(k + h * e) - problem.evaluate(k - h * e)) / (2 * h) for e in np.eye(3)
    ]
    np.testing.assert_allclose(difference, problem.policy_gradient(k), rtol=1e-6, atol=1e-4)


def test_girl_finds_the_weights_of_walking_paths_to_rounding():
    domain = WalkingPath()
    for seed in range(2):
        rng = np.random.default_rng(seed)
        w_E = 0.5 * rng.dirichlet(np.ones(5)) + 0.1
        paths = domain.expert(w_E, rng).demonstration
        np.testing.assert_allclose(girl(domain.policy_gradient(paths)).w, w_E, atol=1e-9)


def test_girl_keeps_weights_on_the_simplex_where_no_policy_is_stationary():
    rng = np.random.default_rng(0)
    for _ in range(20):
        G = rng.standard_normal((6, 4)) + 1.0
        w = girl(G).w
        assert w.min() >= 0 and w.sum() == pytest.approx(1.0)
        for other in rng.dirichlet(np.ones(4), 200):  # none of the simplex is shorter
            assert np.linalg.norm(G @ w) <= np.linalg.norm(G @ other) + 1e-12


def test_gradients_that_say_nothing_are_refused():
    with pytest.raises(InvalidInputError, match="all gradients are 0"):
        girl(np.zeros((3, 2)))
    with pytest.raises(InvalidInputError, match="finite"):
        girl(np.full((3, 2), np.inf))
