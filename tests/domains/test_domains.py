"""Properties that every domain must have."""

import numpy as np
import pytest
from small_mdps import measure

from walking_irl.domains.contract import Request
from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.domains.lqr import LQR
from walking_irl.domains.mdp.driving import Driving
from walking_irl.domains.mdp.gridworld import Gridworld
from walking_irl.domains.mdp.objectworld import Objectworld
from walking_irl.domains.mdp.random_mdp import RandomMDP
from walking_irl.domains.path.walking_path import WalkingPath
from walking_irl.errors import InvalidInputError

MAKERS = {
    "gridworld": lambda: Gridworld(12, 3),
    "gridworld-macro": lambda: Gridworld(8, 2, "macro"),
    "objectworld": lambda: Objectworld(12),
    "random-mdp": RandomMDP,
    "driving": Driving,
    "lqr": lambda: LQR(3),
    "walking-path": lambda: WalkingPath([(3.0, 2.0, 90.0), (1.5, -2.5, -90.0)], n_intervals=12),
    "humanoid-planar": lambda: Humanoid("humanoid-planar"),
}
WALKER = pytest.param("humanoid-planar", marks=pytest.mark.slow)


@pytest.fixture(scope="module", params=[*list(MAKERS)[:-1], WALKER])
def domain(request):
    return MAKERS[request.param]()


def weights(domain, n, seed=0):
    """Interior weights, shape (n, K): every objective matters."""
    K = len(domain.objectives)
    return 0.5 * np.random.default_rng(seed).dirichlet(np.ones(K), n) + 0.5 / K


def test_forward_is_deterministic_and_finite(domain):
    for w in weights(domain, 3):
        first, second = domain.forward(w), domain.forward(w)
        np.testing.assert_array_equal(first.mu, second.mu)
        assert first.mu.shape == (len(domain.objectives),)
        assert np.isfinite(first.mu).all()


def test_a_fresh_domain_gives_the_same_answer(domain, request):
    w = weights(domain, 1)[0]
    fresh = MAKERS[request.node.callspec.params["domain"]]()
    domain.forward(weights(domain, 1, seed=5)[0])
    np.testing.assert_array_equal(domain.forward(w).mu, fresh.forward(w).mu)


def test_no_feature_never_changes(domain):
    K = len(domain.objectives)
    rng = np.random.default_rng(0)
    W = 0.8 * np.eye(K) + 0.2 / K
    if not isinstance(domain, Humanoid):  # the corners suffice, and a solve takes seconds
        W = np.vstack([W, 0.8 * rng.dirichlet(np.full(K, 0.3), 12) + 0.2 / K])
    if isinstance(domain, Driving):  # leaving the road pays only if it costs next to nothing
        W = np.vstack([W, [0.499, 0.499, 0.002]])
    M = np.array([domain.forward(w).mu for w in W])
    assert (np.ptp(M, axis=0) > 1e-3 * np.abs(M).max(axis=0)).all()


def test_features_match_a_simulation(domain):
    rng = np.random.default_rng(0)
    for w in weights(domain, 2, seed=1):
        response = domain.forward(w)
        mean, tolerance = measure(domain, response, rng)
        assert (np.abs(mean - response.mu) <= tolerance).all()


def test_value_is_convex_along_lines(domain):
    ends = weights(domain, 6, seed=2).reshape(3, 2, -1)
    for a, b in ends:
        V = [float(w @ domain.forward(w).mu) for w in (a, 0.7 * a + 0.3 * b, b)]
        assert V[1] <= 0.7 * V[0] + 0.3 * V[2] + 1e-7 * max(map(abs, V))


def test_solver_is_never_beaten_by_an_archived_policy(domain):
    W = weights(domain, 8, seed=3)
    M = np.array([domain.forward(w).mu for w in W])
    values = W @ M.T
    own = np.diag(values)
    assert (values <= own[:, None] + 1e-8 * np.abs(own).max()).all()


def test_expert_is_at_least_as_good_as_any_answer(domain):
    rng = np.random.default_rng(4)
    w_E = weights(domain, 1, seed=4)[0]
    if isinstance(domain, Humanoid):  # a search among local optima admits a gap of its own
        request = Request(w_E, options={"rollouts": 0})
        expert = domain.demonstrate(request, rng=rng).expert
        assert 0.0 < expert.suboptimality <= 1e-4 * np.abs(expert.mu).mean()
    else:
        expert = domain.expert(w_E, rng)
        assert expert.suboptimality == 0.0
    assert not expert.error.any()
    slack = expert.suboptimality + 1e-8 * abs(w_E @ expert.mu)
    for w in [w_E, *weights(domain, 3, seed=5)]:
        assert w_E @ (domain.forward(w).mu - expert.mu) <= slack


def test_weights_off_the_simplex_are_refused(domain):
    K = len(domain.objectives)
    bad = [np.full(K + 1, 1 / (K + 1)), np.full(K, np.nan)]
    if not isinstance(domain, Humanoid):  # the walker's are normalised
        bad += [np.full(K, 2.0 / K), 2 * np.eye(K)[0]]
    negative = np.full(K, 1 / K)
    negative[:2] = -0.5, 0.5 + 2 / K
    for w in [*bad, negative]:
        with pytest.raises(InvalidInputError, match="weights"):
            domain.forward(w)
