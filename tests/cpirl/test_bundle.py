"""What is learnt is kept in one immutable record, which computes what it implies once."""

import numpy as np
import pytest
from problems import TWO_POLICIES, random_menu

from walking_irl.cpirl import bundle as module
from walking_irl.cpirl.bundle import Bundle
from walking_irl.cpirl.loop import cpirl
from walking_irl.domains.lqr import LQR
from walking_irl.expert import expert_from_returns
from walking_irl.geometry.game import game_lp
from walking_irl.types import Expert, Response


def test_adding_an_answer_leaves_the_bundle_as_it_was():
    rng = np.random.default_rng(0)
    menu = random_menu(rng, 3)
    before = Bundle.of(menu.expert(np.full(3, 1 / 3)))
    w = rng.dirichlet(np.ones(3))
    one = before.add(w, menu.forward(w))
    value = one.game.value
    extra = Response(0, menu.M[0], evaluated=np.r_[menu.M[1:3], [[np.nan] * 3]])
    two = one.add(np.eye(3)[0], extra)
    assert (len(before.W), len(one.W), len(two.W)) == (0, 1, 2)
    assert two.policies.shape == (4, 3), "an evaluated policy without numbers is left out"
    assert one.game.value == value >= two.game.value
    np.testing.assert_array_equal(two.M, [menu.forward(w).mu, menu.M[0]])


def test_bounded_game_is_that_of_the_allowed_weights():
    free, bounded = (Bundle.of(Expert(np.full(2, 0.4), np.zeros(2)), low) for low in (0.0, 0.3))
    for w in np.eye(2):
        free, bounded = (b.add(w, TWO_POLICIES.forward(w)) for b in (free, bounded))
    assert free.bounded_game is free.game
    assert bounded.game.value == free.game.value
    assert bounded.bounded_game.value == game_lp(bounded.differences, 0.3).value
    assert bounded.bounded_game.w.min() >= 0.3


@pytest.mark.parametrize("mode", ["optimal", "set", "minimise"])
@pytest.mark.parametrize("is_noisy", [False, True])
def test_the_games_programs_are_solved_once_an_iteration(mode, is_noisy, monkeypatch):
    calls = []
    monkeypatch.setattr(module, "game_lp", lambda *a: calls.append(0) or game_lp(*a))
    rng = np.random.default_rng(1)
    problem = LQR(3, perturbation=0.1)
    expert = problem.expert(rng.dirichlet(np.ones(3)), rng)
    if is_noisy:
        expert = expert_from_returns(expert.mu * (1 + 0.01 * rng.standard_normal((20, 3))))
    run = list(cpirl(problem.forward, expert, mode=mode, rng=rng, max_solves=8, probe=1e-3))
    games = 2 if is_noisy else 1  # with error bars, and without
    assert len(calls) == games * len(run) > 2
