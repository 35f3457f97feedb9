"""Gradient-free searches for the gains of the LQR."""

import sys

import numpy as np
import pytest

from walking_irl.domains.lqr import LQR
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.rl.cma_es import cma_es
from walking_irl.rl.cross_entropy import cross_entropy
from walking_irl.rl.simulated_annealing import simulated_annealing

PROBLEM = LQR(3)
W = np.array([0.2, 0.5, 0.3])
BEST = PROBLEM.gains(W)


def cost(k):
    """Of gains k (3,); infeasible where the discounted loop is unstable."""
    if np.abs(1 + k).max() >= 1 / np.sqrt(0.9):
        return np.inf
    return -float(W @ PROBLEM.evaluate(k))


def anneal(objective, *, rng, **options):
    return simulated_annealing(objective, [(-1.5, 0.5)] * 3, rng=rng, **options)


def evolve(objective, *, rng, **options):
    pytest.importorskip("cmaes")
    return cma_es(objective, np.full(3, -0.5), 0.3, rng=rng, **options)


def sample(objective, *, rng, **options):
    return cross_entropy(objective, np.full(3, -0.5), 0.3, rng=rng, **options)


SEARCHES = {"cross-entropy": sample, "cma-es": evolve, "annealing": anneal}


@pytest.mark.parametrize("name", ["cross-entropy", "cma-es"])
def test_best_gains_are_found(name):
    for seed in range(3):
        found = SEARCHES[name](cost, rng=np.random.default_rng(seed))
        np.testing.assert_allclose(found.x, BEST, atol=1e-6)
        assert found.n_evaluations <= 2500
        assert found.cost == cost(found.x)


def test_annealing_comes_within_five_per_cent():
    for seed in range(3):
        found = anneal(cost, rng=np.random.default_rng(seed))
        assert found.cost <= 1.05 * cost(BEST)
        assert found.n_evaluations <= 2600  # SciPy looks at the budget between chains


def test_annealing_with_local_search_is_exact():
    found = anneal(cost, rng=np.random.default_rng(0), has_local_search=True)
    np.testing.assert_allclose(found.x, BEST, atol=1e-4)


@pytest.mark.parametrize("name", SEARCHES)
def test_the_same_seed_gives_the_same_answer(name):
    first, second, other = (
        SEARCHES[name](cost, rng=np.random.default_rng(s), n_evaluations=300) for s in (1, 1, 2)
    )
    np.testing.assert_array_equal(first.x, second.x)
    np.testing.assert_array_equal(first.log, second.log)
    assert (first.x != other.x).any()


@pytest.mark.parametrize("name", SEARCHES)
def test_infeasible_parameters_are_avoided_and_the_log_is_the_running_best(name):
    tried = []

    def half(k):
        tried.append(cost(k) if k[0] > BEST[0] + 0.1 else np.nan)
        return tried[-1]

    found = SEARCHES[name](half, rng=np.random.default_rng(3), n_evaluations=600)
    assert np.isnan(tried).sum() > 10
    assert found.x[0] >= BEST[0] + 0.1
    assert found.cost == np.nanmin(tried)
    lowest = np.minimum.accumulate(np.where(np.isnan(tried), np.inf, tried))
    np.testing.assert_array_equal(found.log, lowest)


@pytest.mark.parametrize("name", SEARCHES)
def test_nothing_feasible_is_an_error(name):
    with pytest.raises(SolverError, match="parameters tried was feasible"):
        SEARCHES[name](lambda k: np.inf, rng=np.random.default_rng(0), n_evaluations=200)


def test_bad_settings_are_named():
    rng = np.random.default_rng(0)
    with pytest.raises(InvalidInputError, match="finite mean"):
        cross_entropy(cost, np.array([np.nan]), 0.3, rng=rng)
    with pytest.raises(InvalidInputError, match="positive spread"):
        cross_entropy(cost, np.zeros(3), 0.0, rng=rng)
    with pytest.raises(InvalidInputError, match="needs evaluations, got 0"):
        cross_entropy(cost, np.zeros(3), 1.0, rng=rng, n_evaluations=0)
    with pytest.raises(InvalidInputError, match="2 elites"):
        cross_entropy(cost, np.zeros(3), 1.0, rng=rng, elite=0.01)
    with pytest.raises(InvalidInputError, match="finite bounds"):
        simulated_annealing(cost, [(0.0, np.inf)], rng=rng)
    with pytest.raises(InvalidInputError, match="below upper"):
        simulated_annealing(cost, [(1.0, 0.0)], rng=rng)


def test_a_missing_package_is_one_sentence_with_the_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "cmaes", None)
    with pytest.raises(InvalidInputError, match=r"pip install 'walking-irl\[methods\]'"):
        cma_es(cost, np.zeros(3), 0.3, rng=np.random.default_rng(0))
