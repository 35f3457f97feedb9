import numpy as np
import pytest
from problems import TWO_POLICIES, Menu, random_menu
from small_mdps import random_mdp

from walking_irl.baselines import Setting, kelley, lpal, max_margin, mwal, projection
from walking_irl.baselines.apprentice import closest_mixture
from walking_irl.baselines.mwal import regret_bound
from walking_irl.domains.lqr import LQR
from walking_irl.domains.mdp.finite import FiniteDomain
from walking_irl.errors import InvalidInputError
from walking_irl.geometry.game import game_lp
from walking_irl.types import Expert, Objective, Status

RNG = np.random.default_rng(0)
ONE_SIDED = Setting(is_signed=False)


def finite_domain(seed=0):
    rng = np.random.default_rng(seed)
    names = tuple(Objective(str(i), "", 1.0, "") for i in range(4))
    return FiniteDomain("random", names, random_mdp(rng)), rng


def achievable_expert(domain, rng):
    """A stochastic policy: inside the hull, optimal for no weights."""
    M = np.array([domain.forward(w).mu for w in rng.dirichlet(np.ones(4), 6)])
    mu = rng.dirichlet(np.ones(6)) @ M
    return Expert(mu, np.zeros(4))


@pytest.mark.parametrize("is_signed", [True, False])
def test_mixing_program_satisfies_its_optimality_conditions(is_signed):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        M, mu_E = rng.standard_normal((12, 4)), 2 * rng.standard_normal(4)
        mixture = closest_mixture(M, mu_E, is_signed=is_signed)
        assert mixture.min() >= 0 and mixture.sum() == pytest.approx(1.0)
        gap = mu_E - mixture @ M
        gap = gap if is_signed else np.maximum(gap, 0.0)
        assert (M @ gap).max() <= mixture @ M @ gap + 1e-9  # no vertex lies further along w


def test_mixing_program_finds_a_known_foot():
    M = np.array([[0.0, 0.0], [2.0, 0.0]])
    np.testing.assert_allclose(closest_mixture(M, np.array([0.5, 3.0])), [0.75, 0.25], atol=1e-12)


@pytest.mark.parametrize("method", [projection, max_margin])
def test_abbeel_and_ng_approach_an_achievable_expert(method):
    domain, rng = finite_domain(1)
    expert = achievable_expert(domain, rng)
    found = list(method(domain.solve, expert, rng=rng, max_solves=60, tol=1e-3))
    distances = [np.linalg.norm(a.mu - expert.mu) for a in found]
    assert (np.diff(distances) <= 1e-9).all()
    assert distances[-1] <= 0.01 * np.linalg.norm(expert.mu)
    assert distances[0] > 5 * distances[-1]


@pytest.mark.parametrize("method", [projection, max_margin])
def test_abbeel_and_ng_answer_with_the_closest_mixture_of_all_policies(method):
    domain, rng = finite_domain(2)
    expert = achievable_expert(domain, rng)
    for a in method(domain.solve, expert, rng=rng, max_solves=15):
        assert a.mixture.min() >= 0 and a.mixture.sum() == pytest.approx(1.0)
        gap = expert.mu - a.mu
        assert (a.M @ gap).max() <= a.mu @ gap + 1e-9, "no mixture is closer"


def test_max_margin_needs_no_more_solves_than_projection():
    totals = {}
    for method in (projection, max_margin):
        totals[method] = 0
        for seed in range(5):
            domain, rng = finite_domain(seed)
            expert = achievable_expert(domain, rng)
            found = list(method(domain.solve, expert, rng=rng, max_solves=80, tol=1e-2))
            assert found[-1].status is Status.MATCHED
            totals[method] += len(found)
    assert totals[max_margin] <= totals[projection]


@pytest.mark.parametrize("method", [projection, max_margin])
def test_one_sided_variants_query_only_the_simplex(method):
    problem = LQR(3)
    rng = np.random.default_rng(0)
    w_E = np.array([0.2, 0.3, 0.5])
    expert = problem.expert(w_E, rng)
    found = list(method(problem.forward, expert, rng=rng, max_solves=40, setting=ONE_SIDED))
    for a in found:
        assert a.W.min() >= 0
        np.testing.assert_allclose(a.W.sum(axis=1), 1.0)
    J_E = w_E @ expert.mu
    assert w_E @ found[-1].mu >= J_E - 0.02 * abs(J_E)


@pytest.mark.parametrize("n_rounds", [100, 1000])
def test_mwal_keeps_its_regret_bound(n_rounds):
    menu, expert = Menu(np.eye(4)), Expert(np.array([0.1, 0.2, 0.25, 0.25]), np.zeros(4))
    *_, last = mwal(menu.forward, expert, rng=RNG, setting=Setting(span=0.9), max_solves=n_rounds)
    loss = 0.05 - (last.mu - expert.mu).min()  # the value of the game is 0.05
    assert -1e-12 <= loss <= regret_bound(4, n_rounds, 0.9)
    assert regret_bound(4, n_rounds, 0.9) < 0.4
    assert len({r.policy for r in last.responses}) == 4


def test_mwal_takes_the_published_step():
    menu = random_menu(np.random.default_rng(0), 3)
    expert = menu.expert(np.array([0.2, 0.5, 0.3]))
    *_, last = mwal(menu.forward, expert, rng=RNG, setting=Setting(span=20.0), max_solves=2)
    d = last.responses[0].mu - expert.mu
    beta = 1 / (1 + np.sqrt(2 * np.log(3) / 2))
    factor = beta ** ((0.1 * d + 2) / 4)  # the paper's form at gamma = 0.9
    np.testing.assert_allclose(last.W[1], factor / factor.sum(), rtol=1e-12)


def test_mwal_refuses_a_span_that_a_policy_exceeds():
    menu = random_menu(np.random.default_rng(0), 3)
    with pytest.raises(InvalidInputError, match="too small"):
        expert = menu.expert(np.eye(3)[0])
        list(mwal(menu.forward, expert, rng=RNG, setting=Setting(span=1e-3)))


def test_lpal_and_kelley_find_the_value_of_the_game():
    for seed in range(4):
        domain, rng = finite_domain(seed)
        expert = achievable_expert(domain, rng)
        setting = Setting(mdp=domain.mdp)
        (apprentice,) = lpal(domain.forward, expert, rng=rng, setting=setting)
        margin = apprentice.last.info["margin"]
        assert (apprentice.mu - expert.mu).min() == pytest.approx(margin, abs=1e-7)
        assert margin >= -1e-7
        *_, last = kelley(domain.forward, expert, rng=rng, tol=1e-7, max_solves=200)
        assert last.status is Status.GAP_CLOSED
        assert -game_lp(last.M - expert.mu).value == pytest.approx(margin, abs=1e-5)
        assert (last.mu - expert.mu).min() == pytest.approx(margin, abs=1e-5)
        _, mu = last.stationary_policy(domain.mdp)
        np.testing.assert_allclose(mu, last.mu, atol=1e-10)


def test_kelley_ends_on_the_two_policy_problem_with_the_even_mixture():
    expert = Expert(np.array([0.4, 0.4]), np.zeros(2))
    *_, last = kelley(TWO_POLICIES.forward, expert, rng=RNG)
    np.testing.assert_allclose(last.mu, 0.5, atol=1e-9)
    assert last.certificate == pytest.approx(-0.1)


def test_lpal_says_that_it_needs_a_finite_world():
    problem = LQR(2)
    with pytest.raises(InvalidInputError, match="finitely many states"):
        list(lpal(problem.forward, problem.expert(np.array([0.5, 0.5]), RNG), rng=RNG))


def test_budgets_must_make_sense():
    expert = Expert(np.array([0.4, 0.4]), np.zeros(2))
    with pytest.raises(InvalidInputError, match="max_solves"):
        list(kelley(TWO_POLICIES.forward, expert, rng=RNG, max_solves=0))
