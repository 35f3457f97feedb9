"""The thesis's own way with sub-optimal experts."""

import numpy as np
import pytest
from problems import TWO_POLICIES

from walking_irl.cpirl.algorithm3 import algorithm3, utopia
from walking_irl.domains.lqr import LQR
from walking_irl.experiments.cutting import cutting_planes
from walking_irl.geometry.centres import centre_rule
from walking_irl.geometry.game import game_lp
from walking_irl.types import Expert


def test_utopia_is_a_pareto_point_above_the_expert():
    W, M = np.eye(2), np.array([[1.0, 0.0], [0.0, 1.0]])
    mu_E = np.array([0.4, 0.4])
    x = utopia(W, M, mu_E)
    assert (x >= mu_E).all()
    np.testing.assert_allclose(x, 1.0)
    x = utopia(np.vstack([W, [0.5, 0.5]]), np.vstack([M, [1.0, 0.0]]), mu_E)
    assert x.sum() == pytest.approx(1.0)


def test_algorithm_3_gives_up_where_only_a_mixture_dominates():
    expert = Expert(np.array([0.4, 0.4]), np.zeros(2))
    steps = list(
        algorithm3(TWO_POLICIES.forward, expert, rng=np.random.default_rng(0), max_solves=20)
    )
    assert 2 <= len(steps) < 20, "both policies are found, and then nothing is left to ask"
    M = np.array([s.response.mu for s in steps])
    assert {tuple(mu) for mu in M} == {(1.0, 0.0), (0.0, 1.0)}
    assert game_lp(M - expert.mu).value == pytest.approx(-0.1), "their mixture dominates"


@pytest.mark.parametrize("centre", ["ac", "cg", "mvie"])
def test_without_a_utopia_it_is_bare_cutting_planes(centre):
    """Of an optimal expert the cuts always leave its weights, so that step 5 is never taken."""
    rng = np.random.default_rng(0)
    w_E, problem = rng.dirichlet(np.ones(3)), LQR(3)
    expert = problem.expert(w_E, rng)
    settings = {"rng": rng, "max_solves": 8}
    steps = list(algorithm3(problem.forward, expert, centre=centre, **settings))
    bare = list(cutting_planes(problem.forward, expert, centre_rule(centre), **settings))
    np.testing.assert_array_equal([s.w for s in steps], [s.w for s in bare])
    assert len(steps) == 8 and all(s.polyhedron.contains(w_E) for s in steps)


def test_a_suboptimal_expert_is_dominated_beyond_the_point_where_its_cuts_are_empty():
    problem, beyond = LQR(3, perturbation=0.25), 0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        expert = problem.expert(rng.dirichlet(np.ones(3)), rng)
        settings = {"rng": rng, "max_solves": 30}
        M = np.array([s.response.mu for s in algorithm3(problem.forward, expert, **settings)])
        n_bare = len(list(cutting_planes(problem.forward, expert, centre_rule("ac"), **settings)))
        beyond += len(M) > n_bare
        assert game_lp(M - expert.mu).value <= 1e-9 * np.abs(expert.mu).max()
    assert beyond >= 3
