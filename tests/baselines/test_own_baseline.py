"""Drill: a baseline of one's own is one function with its rule, and one line in the registry."""

import numpy as np
from problems import random_menu

from walking_irl.baselines import BASELINES
from walking_irl.baselines.loop import USUAL, Move, apprentices
from walking_irl.experiments.runner import Row, Runner
from walking_irl.experiments.tasks import Task
from walking_irl.types import Status


def at_random(forward, expert, *, rng, setting=USUAL, tol=1e-6, max_solves=60):
    """Ask for weights at random, and mix all answers evenly."""

    def rule(W, M):
        is_found = bool((M[-1] >= expert.mu - tol).all())
        status = Status.MATCHED if is_found else Status.CUT
        return Move(np.full(len(M), 1 / len(M)), rng.dirichlet(np.ones(len(expert.mu))), status)

    first = rng.dirichlet(np.ones(len(expert.mu)))
    return apprentices(forward, expert, first, rule, tol=tol, max_solves=max_solves)


def test_its_rule_is_all_that_it_has_to_say():
    rng = np.random.default_rng(0)
    menu = random_menu(rng, 3)
    expert = menu.expert(np.array([0.2, 0.5, 0.3]))
    found = list(at_random(menu.forward, expert, rng=rng, max_solves=50))
    assert [len(a.responses) for a in found] == list(range(1, len(found) + 1))
    assert all(a.status is Status.CUT for a in found[:-1])
    assert found[-1].status is Status.MATCHED and (found[-1].last.mu >= expert.mu - 1e-6).all()


def test_a_budget_ends_it():
    rng = np.random.default_rng(0)
    menu = random_menu(rng, 3)
    better = menu.expert(np.eye(3)[0])
    never = type(better)(better.mu + 1.0, better.error)
    *_, last = at_random(menu.forward, never, rng=rng, max_solves=4)
    assert last.status is Status.BUDGET and len(last.responses) == 4


def test_tables_know_it_by_name(monkeypatch):
    monkeypatch.setitem(BASELINES, "at-random", at_random)
    task = Task("lqr", {"n_objectives": 2}, method="at-random", share=0.2, max_solves=30)
    table = Runner().table("x", "", [Row("n=2", "at random", task)], 2)
    assert not any("failed on" in note for note in table.notes)
    assert all(outcome["solves"] >= 1 for outcome in table.raw)
