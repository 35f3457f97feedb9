import numpy as np
import pytest

from walking_irl.baselines.registry import (
    EVERYWHERE,
    FINITE,
    LQR,
    METHODS,
    PATH,
    Needs,
    run_method,
)
from walking_irl.domains.lqr import LQR as LQRDomain
from walking_irl.domains.mdp.random_mdp import RandomMDP
from walking_irl.domains.path.walking_path import WalkingPath
from walking_irl.errors import InvalidInputError
from walking_irl.rl.demonstrations import Demonstrations, demonstrate
from walking_irl.rl.soft import soft_policy
from walking_irl.rl.tabular import best_policy, loss, uniform_policy
from walking_irl.types import Expert, Response

W_E = np.array([0.5, 0.3, 0.2])
WORLD = RandomMDP(n_states=20, n_actions=3, n_objectives=3)
REWARD = WORLD.mdp.reward(W_E)
EXPERT = WORLD.expert(W_E, np.random.default_rng(0))
SHORT = {
    "policywalk": {"n_samples": 300},
    "gpirl": {"n_starts": 1, "max_iter": 30},
    "mmp-boost": {"n_rounds": 6},
    "maxent": {"max_iter": 100},
    "relative-entropy": {"n_samples": 500},
}


def rng():
    return np.random.default_rng(0)


def seen(n=40):
    return demonstrate(WORLD.mdp, EXPERT.demonstration, n, 30, rng=rng())


@pytest.mark.parametrize("name", [m.name for m in METHODS.values() if FINITE in m.worlds])
def test_every_method_learns_a_small_world(name):
    if METHODS[name].extra:
        pytest.importorskip("sklearn")
    data = EXPERT if METHODS[name].needs is Needs.POLICY else seen()
    found = run_method(name, WORLD, data, rng=rng(), **SHORT.get(name, {}))
    assert loss(WORLD.mdp, REWARD, found.policy) <= 0.5  # chance is 1
    np.testing.assert_allclose(
        found.mu, WORLD.mdp.feature_expectations(np.asarray(found.policy)), atol=1e-8
    )
    again = run_method(name, WORLD.mdp, data, rng=rng(), **SHORT.get(name, {}))
    np.testing.assert_array_equal(found.policy, again.policy)
    if found.w is not None and METHODS[name].is_linear:
        np.testing.assert_allclose(found.reward, WORLD.mdp.Phi @ found.w)
        if found.space == "simplex":
            assert found.w.min() >= 0 and found.w.sum() == pytest.approx(1.0)
    assert found.info["solves"] >= 0


@pytest.mark.parametrize("name", [m.name for m in METHODS.values() if LQR in m.worlds])
def test_methods_of_continuous_worlds_run_on_the_lqr(name):
    problem = LQRDomain(3)
    expert = problem.expert(W_E, rng())
    found = run_method(name, problem, expert, rng=rng())
    if found.w is not None and name not in ("projection", "max-margin", "mwal", "ng-russell-3"):
        # temperature and width of a posterior bias weights by some per cent; GIRL is exact
        np.testing.assert_allclose(found.w, W_E, atol=1e-9 if name == "girl" else 0.08)
    elif name != "ng-russell-3":  # mixtures: what they promise is a return, not weights
        assert W_E @ found.mu >= 1.1 * W_E @ expert.mu


@pytest.mark.parametrize("name", [m.name for m in METHODS.values() if FINITE in m.worlds])
@pytest.mark.parametrize("world", [LQR, PATH])
def test_where_a_method_cannot_run_one_sentence_says_why(name, world):
    if world in METHODS[name].worlds:
        pytest.skip("it can")
    problem = LQRDomain(3) if world == LQR else WalkingPath()
    expert = Expert(np.zeros(len(problem.objectives)), np.zeros(len(problem.objectives)))
    with pytest.raises(InvalidInputError, match="needs finitely many states"):
        run_method(name, problem, expert, rng=rng())


def test_what_the_expert_lacks_is_said():
    features = Expert(EXPERT.mu, EXPERT.error)
    for method in METHODS.values():
        if FINITE not in method.worlds or method.needs is Needs.FEATURES:
            continue
        message = "complete policy" if method.needs is Needs.POLICY else "states and actions"
        with pytest.raises(InvalidInputError, match=message):
            run_method(method.name, WORLD, features, rng=rng())
    with pytest.raises(InvalidInputError, match="offers no policy_gradient"):
        run_method("girl", WORLD, EXPERT, rng=rng())
    with pytest.raises(InvalidInputError, match="with its demonstration"):
        run_method("girl", LQRDomain(3), features, rng=rng())
    with pytest.raises(InvalidInputError, match="forward solver"):
        run_method("cpirl", object(), features, rng=rng())


def test_bad_data_and_names_are_named():
    with pytest.raises(InvalidInputError, match="unknown method 'irl'; choose from ng-russell-1"):
        run_method("irl", WORLD, EXPERT, rng=rng())
    with pytest.raises(InvalidInputError, match="Demonstrations or an Expert"):
        run_method("mmp", WORLD, [1, 2], rng=rng())
    with pytest.raises(InvalidInputError, match="takes no option speed; choose from max_iter"):
        run_method("mce-likelihood", WORLD, seen(), rng=rng(), speed=1)
    with pytest.raises(InvalidInputError, match="archive, log_q, temperature"):
        run_method("mce-matching", LQRDomain(3), EXPERT, rng=rng(), ridge=1.0)
    far = Demonstrations(np.array([[99]]), np.array([[0]]))
    for method in METHODS.values():
        if method.needs in (Needs.ACTIONS, Needs.FEATURES) and FINITE in method.worlds:
            with pytest.raises(InvalidInputError, match="states must lie from 0 to 19"):
                run_method(method.name, WORLD, far, rng=rng())
    odd = Demonstrations(np.array([[0]]), np.array([[9]]))
    for method in METHODS.values():
        if method.needs is Needs.ACTIONS:
            with pytest.raises(InvalidInputError, match="actions must lie from 0 to 2"):
                run_method(method.name, WORLD, odd, rng=rng())
    lost = Expert(np.full(3, np.nan), np.zeros(3))
    with pytest.raises(InvalidInputError, match="finite mu"):
        run_method("cpirl", WORLD, lost, rng=rng())


def test_one_trajectory_is_enough():
    one = demonstrate(WORLD.mdp, EXPERT.demonstration, 1, 60, rng=rng())
    for name in ("mmp", "projection", "mce-likelihood", "cpirl-actions"):
        assert run_method(name, WORLD, one, rng=rng()).policy is not None


def test_soft_experts_are_seen_through_by_likelihood_and_copied_by_matching():
    copied, seen_through = [], []
    for seed in range(4):
        domain = RandomMDP(seed=seed)
        draw = np.random.default_rng(seed)
        r = domain.mdp.reward(draw.dirichlet(np.ones(5)))
        D = demonstrate(domain.mdp, soft_policy(domain.mdp, 20 * r).pi, 100, 50, rng=draw)
        likely = run_method("mce-likelihood", domain, D, rng=draw)
        mixture = run_method("projection", domain, D, rng=draw)
        seen_through.append(loss(domain.mdp, r, likely.policy))
        copied.append(loss(domain.mdp, r, mixture.policy))
    assert np.mean(seen_through) <= 0.02 < 0.08 <= np.mean(copied)


def test_the_registry_says_what_a_table_prints():
    assert len(METHODS) == 21
    for name, method in METHODS.items():
        assert method.name == name and method.source and method.guarantee and method.worlds
        assert set(method.worlds) <= set(EVERYWHERE)


def test_a_given_archive_spares_the_forward_solves():
    problem = LQRDomain(3)
    expert = problem.expert(W_E, rng())
    M = np.array([problem.forward(w).mu for w in rng().dirichlet(np.ones(3), 200)])

    class Silent:
        name = "silent"

        def forward(self, w: np.ndarray) -> Response:
            raise AssertionError("no solve is needed")

    for name in ("policywalk", "mce-matching", "relative-entropy"):
        found = run_method(name, Silent(), expert, rng=rng(), archive=M)
        np.testing.assert_allclose(found.w, W_E, atol=0.05)


def test_chance_is_what_the_bound_of_these_tests_says():
    assert loss(WORLD.mdp, REWARD, uniform_policy(WORLD.mdp)) == pytest.approx(1.0)
    assert loss(WORLD.mdp, REWARD, best_policy(WORLD.mdp, REWARD).pi) == pytest.approx(0.0)
