"""What the cells of the tables say, computed a second time from the algorithms themselves."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from problems import without_sensitivity

from walking_irl.baselines import BASELINES, Setting, max_margin, mwal, projection
from walking_irl.cpirl.algorithm3 import algorithm3
from walking_irl.cpirl.loop import cpirl
from walking_irl.domains.lqr import LQR
from walking_irl.domains.mdp.gridworld import Gridworld
from walking_irl.experiments import contenders, rows, runner, tasks
from walking_irl.experiments.runner import Runner
from walking_irl.experiments.tasks import Task, run_task, synthetic_expert
from walking_irl.geometry.centres.analytic import analytic
from walking_irl.geometry.game import game_lp
from walking_irl.run import stopwatch

OPTIMAL = Task("lqr", {"n_objectives": 3}, share=0.002, arguments={"centre": "ac"})
POOR = replace(OPTIMAL, options={"n_objectives": 3, "perturbation": 0.25}, criterion="dominance")


ONE_SIDED = Setting(is_signed=False)


def the_expert(task):
    rng = np.random.default_rng([task.seed, 7])
    domain = LQR(**task.options)
    w_E, expert, _ = synthetic_expert(task, domain, rng)
    return domain, w_E, expert, rng


def first(outcomes):
    return next(k for k, is_good in enumerate(outcomes, start=1) if is_good)


@pytest.mark.parametrize("seed", range(4))
def test_cutting_planes_are_scored_at_the_first_policy_within_the_share(seed):
    task = replace(OPTIMAL, seed=seed)
    domain, w_E, expert, rng = the_expert(task)
    J_E = float(w_E @ expert.mu)
    run = cpirl(without_sensitivity(domain), expert, rng=rng, max_solves=60)
    expected = first((J_E - w_E @ it.response.mu) / -J_E <= 0.002 for it in run)
    outcome = run_task(task)
    assert outcome["success"] and outcome["solves"] == expected > 1


@pytest.mark.parametrize("seed", range(4))
def test_a_dominating_mixture_comes_no_later_than_a_dominating_policy(seed):
    task = replace(POOR, seed=seed, least_advantage=0.002)
    domain, _, expert, rng = the_expert(task)
    run = list(cpirl(without_sensitivity(domain), expert, mode="minimise", rng=rng))
    d = np.array([it.response.mu - expert.mu for it in run])
    mixture = first(game_lp(d[: k + 1]).value <= 1e-9 for k in range(len(d)))
    assert run_task(replace(task, scored="mixture"))["solves"] == mixture
    assert run_task(task)["solves"] == first(d.min(axis=1) >= -1e-9) >= mixture


@pytest.mark.parametrize(
    ("name", "method"), [("projection", projection), ("max-margin", max_margin)]
)
def test_baselines_are_scored_as_mixture_and_as_last_policy(name, method):
    differ = 0
    for seed in range(4):
        task = replace(POOR, method=name, arguments={}, seed=seed, max_solves=25)
        domain, _, expert, rng = the_expert(task)
        run = list(method(domain.forward, expert, rng=rng, max_solves=25, setting=ONE_SIDED))
        for scored in ("mixture", "last"):
            mus = [a.mu if scored == "mixture" else a.last.mu for a in run]
            good = [bool((mu - expert.mu).min() >= -1e-9 * np.abs(expert.mu).max()) for mu in mus]
            outcome = run_task(replace(task, scored=scored))
            assert outcome["success"] == any(good)
            assert outcome["solves"] == (first(good) if any(good) else len(run))
            differ += outcome["success"] if scored == "mixture" else -outcome["success"]
    assert differ > 0, "mixtures succeed more often"


def test_algorithm_3_rows_run_the_utopia():
    for seed in range(4):
        task = replace(POOR, method="utopia", seed=seed, least_advantage=0.002, max_solves=60)
        domain, _, expert, rng = the_expert(task)
        run = list(algorithm3(domain.forward, expert, centre="ac", rng=rng, max_solves=60))
        good = [bool((s.response.mu - expert.mu).min() >= 0) for s in run]
        outcome = run_task(task)
        assert outcome["solves"] == (first(good) if any(good) else len(run))
    labels = {row.method: row.task for row in rows.dominance_rows("n=3", POOR)}
    for centre in ("ac", "cg", "mvie", "cc"):
        row = labels[f"CPIRL-{centre.upper()} Algorithm 3"]
        assert (row.method, row.arguments["centre"]) == ("utopia", centre)
        level = labels[f"CPIRL-{centre.upper()} level, mixture"]
        assert (level.method, level.scored) == ("cpirl", "mixture")
    newton = labels["CPIRL-AC level + Newton, single policy"]
    assert newton.arguments["has_newton"] and newton.scored == "last"


def test_baseline_rows_run_what_their_labels_say():
    made = rows.baseline_rows("x", OPTIMAL, (20, 200), is_finite=True)
    found = {r.method: r.task for r in made}
    for T in (20, 200):
        for scored in ("mixture", "last"):
            task = found[f"MWAL T={T}, {scored}"]
            assert (task.method, task.max_solves, task.scored) == ("mwal", T, scored)
    for method, label in (("projection", "Projection"), ("max-margin", "Max-margin")):
        for scored in ("mixture", "last"):
            task = found[f"{label}, {scored}"]
            assert (task.method, task.max_solves, task.scored) == (method, 60, scored)
    assert found["LPAL (one program)"].method == "lpal"
    assert rows.baseline_rows("x", OPTIMAL, (20,), is_finite=False)[-1].task is None


def test_seconds_of_the_solver_are_not_the_methods(monkeypatch):
    clock = [0.0]
    for module in (tasks, stopwatch):
        monkeypatch.setattr(module, "time", SimpleNamespace(perf_counter=lambda: clock[0]))
    forward = LQR.forward

    def slow(self, w):
        clock[0] += 1.0
        return forward(self, w)

    monkeypatch.setattr(LQR, "forward", slow)
    outcome = run_task(OPTIMAL)
    assert outcome["seconds"] == outcome["solves"] and outcome["query_seconds"] == 0.0


@pytest.mark.parametrize("n", [50, 200])
def test_figure_samples_as_often_as_it_says(monkeypatch, n):
    asked = []

    def gravity(P, *, rng, n_samples):
        asked.append(n_samples)
        return analytic(P)

    monkeypatch.setattr(contenders, "gravity", gravity)
    run_task(replace(OPTIMAL, method="samples", arguments={"n_samples": n}))
    assert set(asked) == {n}


def test_baselines_get_the_weights_and_the_span_that_their_world_allows(monkeypatch):
    given = {}

    def spy(name, method, *args, **settings):
        given[name] = settings
        return method(*args, **settings)

    for name, method in (("projection", projection), ("mwal", mwal)):
        monkeypatch.setitem(BASELINES, name, partial(spy, name, method))
    grid = Task("gridworld", {"size": 9, "cells": 3}, max_solves=5)
    for task, is_signed in ((grid, True), (replace(OPTIMAL, arguments={}), False)):
        run_task(replace(task, method="projection"))
        assert given["projection"]["setting"].is_signed is is_signed
    run_task(replace(grid, method="mwal"))
    assert given["mwal"]["setting"].span == pytest.approx(1 / (1 - Gridworld(9, 3).mdp.discount))
    assert given["mwal"]["max_solves"] == 5
    run_task(replace(OPTIMAL, method="mwal", arguments={}))
    domain, _, expert, _ = the_expert(OPTIMAL)
    largest = max(np.abs(domain.forward(e).mu - expert.mu).max() for e in np.eye(3))
    assert given["mwal"]["setting"].span == pytest.approx(largest)


def test_a_program_makes_no_forward_solve():
    outcome = run_task(Task("gridworld", {"size": 9, "cells": 3}, method="lpal", scored="mixture"))
    assert outcome["success"] and outcome["solves"] == 0


def test_cells_of_other_code_are_run_again(tmp_path, monkeypatch):
    [before] = Runner(cache=tmp_path).outcomes("x", [OPTIMAL])
    monkeypatch.setattr(runner, "code_digest", lambda: "another")
    calls = []
    monkeypatch.setattr(runner, "run_job", lambda task: calls.append(task) or before)
    Runner(cache=tmp_path).outcomes("x", [OPTIMAL])
    assert calls == [OPTIMAL]
