"""What is known of an expert: error bars, paired evaluation, its own gap."""

from dataclasses import replace

import numpy as np
import pytest
from problems import without_sensitivity

from walking_irl.cpirl.bundle import Bundle
from walking_irl.cpirl.loop import cpirl
from walking_irl.domains.lqr import LQR
from walking_irl.errors import InvalidInputError
from walking_irl.expert import (
    expert_from_returns,
    half_widths,
    paired_half_widths,
    suboptimality_from_restarts,
)
from walking_irl.types import Expert, Response


@pytest.mark.parametrize("bound", ["student", "bernstein", "hoeffding"])
def test_half_widths_cover_the_mean_of_all_features_at_once(bound):
    rng = np.random.default_rng(0)
    inside = [
        np.all(np.abs(x.mean(0) - 0.5) <= half_widths(x, bound=bound, ranges=np.ones(3)))
        for x in rng.random((1000, 20, 3))
    ]
    # 95 % less three standard deviations of the count; only Student's bars are not wider
    assert np.mean(inside) >= 0.95 - 3 * np.sqrt(0.95 * 0.05 / 1000)


def test_half_widths_follow_their_formulas():
    X = np.array([[0.0, 1.0], [1.0, 1.5], [0.5, 0.5], [0.25, 2.0]])
    hoeffding = half_widths(X, bound="hoeffding", ranges=np.array([1.0, 2.0]), n_policies=3)
    np.testing.assert_allclose(hoeffding, np.sqrt(np.log(240) / 8) * np.array([1, 2]))
    L = np.log(4 * 2 / 0.05)
    expected = X.std(axis=0, ddof=1) * np.sqrt(2 * L / 4) + 7 * np.array([1.0, 2.0]) * L / 9
    np.testing.assert_allclose(
        half_widths(X, bound="bernstein", ranges=np.array([1.0, 2.0])), expected
    )


def test_common_random_numbers_narrow_the_difference():
    rng = np.random.default_rng(1)
    shared = rng.standard_normal((50, 3))
    learner, expert = 1.02 * shared + 0.1, shared + 0.01 * rng.standard_normal((50, 3))
    paired = paired_half_widths(learner, expert)
    assert np.all(np.abs((learner - expert).mean(axis=0) - 0.1) <= paired)
    assert np.all(paired < 0.1 * half_widths(expert))
    with pytest.raises(InvalidInputError, match="differ in shape"):
        paired_half_widths(learner, expert[:40])


def test_trajectories_become_an_expert():
    X = np.random.default_rng(2).random((30, 4))
    expert = expert_from_returns(X, suboptimality=0.1)
    np.testing.assert_allclose(expert.mu, X.mean(axis=0))
    np.testing.assert_allclose(expert.covariance, np.cov(X.T) / 30)
    assert expert.n_samples == 30 and expert.suboptimality == 0.1
    with pytest.raises(InvalidInputError, match="m >= 2"):
        expert_from_returns(X[:1])
    with pytest.raises(InvalidInputError, match="at least 2 restarts"):
        suboptimality_from_restarts(np.full(4, 0.25), expert.mu, [])


def sloppy(problem, rng, tries=3, spread=0.05):
    """A forward solver that keeps the best of some gains near the optimal ones."""

    def forward(w):
        best = problem.gains(w)
        gains = [best * (1 + spread * rng.standard_normal(len(w))) for _ in range(tries)]
        mu = max((problem.evaluate(np.clip(k, -0.99, -0.1)) for k in gains), key=lambda m: w @ m)
        return Response(None, mu)

    return forward


def is_kept(w_E, forward, expert, rng):
    """Whether no cut of a run takes the expert's weights away."""
    run = cpirl(forward, expert, rng=rng, max_solves=20)
    cuts = [i.response.mu - expert.mu - expert.suboptimality for i in run]
    return bool((np.array(cuts) @ w_E).max() <= 1e-9)


@pytest.mark.parametrize("K", [4, 8])
def test_an_experts_own_gap_must_be_known_and_restarts_tell_it(K):
    """A sloppy solver never costs an optimal expert its weights, but a sloppy expert its own."""
    problem, n = LQR(K), 40
    exact = without_sensitivity(problem)
    kept = np.zeros(3, dtype=int)
    for seed in range(n):
        rng = np.random.default_rng(seed)
        w_E = 0.2 / K + 0.8 * rng.dirichlet(np.ones(K))
        solve = sloppy(problem, rng)
        found = Expert(solve(w_E).mu, np.zeros(K))
        gap = suboptimality_from_restarts(w_E, found.mu, [solve(w_E) for _ in range(10)])
        kept += [
            is_kept(w_E, solve, problem.expert(w_E, rng), rng),
            is_kept(w_E, exact, found, rng),
            is_kept(w_E, exact, replace(found, suboptimality=gap), rng),
        ]
    optimal, naive, lifted = kept
    assert optimal == n
    assert naive <= 0.2 * n
    assert lifted >= 0.95 * n


def test_robust_cuts_are_lifted_by_error_and_gap():
    rng = np.random.default_rng(3)
    problem, w_E = LQR(3), rng.dirichlet(np.ones(3))
    exact = problem.expert(w_E, rng)
    bounded = Expert(exact.mu, np.full(3, 0.5), suboptimality=0.25)
    first, second, *_ = cpirl(without_sensitivity(problem), bounded, rng=rng)
    cut = first.response.mu - (bounded.mu + 0.5 + 0.25)
    expected = first.polyhedron.cut(cut)
    np.testing.assert_allclose(second.polyhedron.A, expected.A, atol=1e-12)
    np.testing.assert_allclose(second.polyhedron.b, expected.b, atol=1e-12)


@pytest.mark.parametrize(
    "change",
    [{"mu": np.empty(0), "error": np.empty(0)}, {"suboptimality": np.nan}],
    ids=["no features", "suboptimality"],
)
def test_experts_without_numbers_are_named(change):
    expert = Expert(**{"mu": np.ones(3), "error": np.zeros(3), **change})
    with pytest.raises(InvalidInputError, match="the expert"):
        next(cpirl(LQR(3).forward, expert, rng=np.random.default_rng(0)))


def test_a_measured_defect_never_narrows_the_experts_error_bars():
    rng = np.random.default_rng(4)
    X = rng.standard_normal((20, 3)) - 5.0
    for bound in ("student", "bernstein", "hoeffding"):
        expert = expert_from_returns(X, bound=bound, ranges=np.full(3, 6.0))
        lowered = Bundle.of(expert).corrected(np.full(3, 0.1), expert.covariance)
        assert np.all(lowered.error > expert.error)
        np.testing.assert_allclose(lowered.mu, expert.mu - 0.1)
        again = lowered.corrected(np.zeros(3), np.zeros((3, 3)))
        np.testing.assert_allclose(again.error, expert.error)
