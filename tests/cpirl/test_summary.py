"""What is said of a finished run: where its weights come from, and how sure they are."""

import numpy as np
import pytest
from problems import random_menu, without_sensitivity

from walking_irl.cpirl.loop import cpirl
from walking_irl.cpirl.summary import summarise
from walking_irl.domains.lqr import LQR
from walking_irl.domains.path.walking_path import WalkingPath
from walking_irl.types import Status


def found(forward, expert, **settings):
    run = list(cpirl(forward, expert, rng=np.random.default_rng(0), **settings))
    return run, summarise(run, expert)


def test_rule_says_where_the_weights_come_from():
    rng = np.random.default_rng(0)
    problem, w_E = LQR(3), np.array([0.2, 0.3, 0.5])
    expert = problem.expert(w_E, rng)
    run, stepped = found(problem.forward, expert, tol=1e-12)
    assert run[-1].status is Status.CONVERGED and "Newton step" in stepped.rule
    run, centred = found(without_sensitivity(problem), expert, max_solves=3)
    P = run[-1].polyhedron.cut(run[-1].response.mu - expert.mu)
    assert P.contains(centred.w) and "centre" in centred.rule
    assert centred.condition_number is None and centred.weakest is None
    menu = random_menu(rng, 3)
    run, matched = found(menu.forward, menu.expert(w_E))
    assert run[-1].status is Status.MATCHED and "query" in matched.rule
    assert any(np.array_equal(it.w, matched.w) for it in run)


def test_rounding_is_reported_as_nothing():
    menu = random_menu(np.random.default_rng(1), 4)
    run, matched = found(menu.forward, menu.expert(np.full(4, 0.25)))
    assert abs(run[-1].certificate) <= 1e-12 and abs(run[-1].best_regret) <= 1e-12
    assert matched.certificate == 0.0 and matched.bracket == (0.0, 0.0)
    assert str(matched.bracket) == "(0.0, 0.0)", "no negative zeros"


def test_volume_and_physical_intervals_are_those_of_the_last_iteration():
    domain = WalkingPath([(3.0, 2.0, 90.0)], n_intervals=8)
    rng = np.random.default_rng(2)
    expert = domain.expert(np.full(5, 0.2), rng)
    run = list(cpirl(domain.forward, expert, rng=rng, max_solves=4))
    recovery = summarise(run, expert, domain.objectives)
    scales = np.array([o.scale for o in domain.objectives])
    np.testing.assert_allclose(recovery.physical_intervals * scales[:, None], run[-1].intervals)
    whole = run[0].polyhedron.volume()
    assert recovery.volume_ratio == pytest.approx(run[-1].polyhedron.volume() / whole)
    assert recovery.n_solves == len(run)
