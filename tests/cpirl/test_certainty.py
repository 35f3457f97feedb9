"""Intervals: what noise, an expert's sub-optimality and the solver allow, and who says so."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t as student

from walking_irl.cpirl.loop import cpirl
from walking_irl.cpirl.probes import Probing
from walking_irl.cpirl.regret_model import reduced
from walking_irl.cpirl.summary import summarise
from walking_irl.domains.lqr import LQR
from walking_irl.expert import expert_from_returns
from walking_irl.geometry.plane import plane_basis
from walking_irl.types import Expert, Gap, Status


def misled(problem, w_E, j, gap, share):
    """An expert that is sub-optimal by ``gap`` under its own weights, relative.

    The part ``share`` of that other weights explain, off along the axis of the ellipsoids
    {f <= c} at which weight j is farthest out.
    """
    best = problem.forward(w_E)
    U = plane_basis(len(w_E))
    B = reduced(best.sensitivity)
    z = np.linalg.solve(B, U.T @ np.eye(len(w_E))[j])
    delta = gap * abs(w_E @ best.mu)
    z *= np.sqrt(2.0 * share * delta / (z @ B @ z))
    pull = U @ B @ z
    return Expert(best.mu + pull - w_E @ pull - delta, np.zeros(len(w_E)))


@pytest.mark.parametrize("j", range(3))
@pytest.mark.parametrize("gap", [1e-5, 1e-4, 1e-3])
def test_intervals_hold_an_expert_twice_as_suboptimal_as_its_best_explanation(j, gap):
    problem, w_E = LQR(3), np.array([0.3, 0.5, 0.2])
    expert = misled(problem, w_E, j, gap, share=0.49)
    rng = np.random.default_rng(0)
    run = list(cpirl(problem.forward, expert, mode="minimise", rng=rng, probe=Probing()))
    found = summarise(run, expert)
    assert run[-1].status is Status.NOT_OPTIMAL and "not exactly optimal" in found.ending
    low, high = found.bracket
    least = 0.51 * gap * abs(w_E @ problem.forward(w_E).mu)
    third_order = 0.01 + 30 * gap  # of the regret: f is no quadratic
    assert 0.0 < low <= (1.0 + third_order) * least
    assert (1.0 - third_order) * least <= high <= 1.1 * least
    lower, upper = run[-1].intervals.T
    assert ((lower <= w_E) & (w_E <= upper)).all()
    half = np.where(w_E[j] > found.w[j], upper[j] - found.w[j], found.w[j] - lower[j])
    assert abs(found.w[j] - w_E[j]) > 0.5 * half, "no wider than it takes"
    assert "from the expert's possible" in found.how_sure and "as measured" in found.how_sure


def test_half_widths_follow_the_root_of_what_is_measured():
    problem, w_E, widths = LQR(3), np.array([0.3, 0.5, 0.2]), []
    for gap in (1e-5, 4e-5):
        expert = misled(problem, w_E, 0, gap, share=0.1)
        rng = np.random.default_rng(0)
        last = list(cpirl(problem.forward, expert, mode="minimise", rng=rng, probe=Probing()))[-1]
        assert last.certainty.source is Gap.MEASURED
        assert last.certainty.gap == pytest.approx(last.bracket.upper)
        widths.append(last.certainty.half_widths)
    np.testing.assert_allclose(widths[1] / widths[0], 2.0, rtol=0.05)


def test_the_parts_add_up_and_noise_has_its_own():
    problem, w_E = LQR(3), np.array([0.3, 0.5, 0.2])
    rng = np.random.default_rng(1)
    exact = problem.expert(w_E, rng)
    noisy = expert_from_returns(exact.mu * (1 + 0.01 * rng.standard_normal((40, 3))))
    for expert in (exact, noisy):
        run = list(cpirl(problem.forward, expert, rng=rng, probe=Probing()))
        sure = run[-1].certainty
        parts = sure.from_noise + sure.from_gap + sure.from_solver
        np.testing.assert_allclose(sure.half_widths, parts)
        lower, upper = run[-1].intervals.T
        assert (lower <= run[-1].estimate - sure.half_widths + 1e-12).all()
        assert (run[-1].estimate + sure.half_widths <= upper + 1e-12).all()
        assert sure.from_noise.any() == (expert is noisy)
        assert ("from noise" in summarise(run, expert).how_sure) == (expert is noisy)
        t = student.ppf(1 - 0.025 / 3, 39)  # all three weights at once
        np.testing.assert_allclose(sure.from_noise, t * sure.standard_errors)


def test_a_persons_word_replaces_what_noise_hides_and_is_told():
    problem, w_E = LQR(3), np.array([0.3, 0.5, 0.2])
    rng = np.random.default_rng(1)
    mu = problem.expert(w_E, rng).mu
    returns = mu * (1 + 0.01 * rng.standard_normal((40, 3)))
    size = abs(w_E @ mu)
    widths = {}
    for gap, who in ((1e-3, ""), (1e-3, "--expert-gap"), (0.0, "--expert-gap")):
        expert = expert_from_returns(returns, suboptimality=gap * size)
        expert = replace(expert, vouched_by=who)
        run = list(cpirl(problem.forward, expert, rng=np.random.default_rng(0), probe=Probing()))
        sure, told = run[-1].certainty, summarise(run, expert).how_sure
        widths[gap, who] = sure.from_gap
        assert sure.source is Gap.GRANTED and sure.gap == pytest.approx(gap * size)
        assert ("--expert-gap" in told) == bool(who)
    assert not widths[0.0, "--expert-gap"].any()
    assert (widths[1e-3, "--expert-gap"] > 0.0).all()


def test_a_word_that_the_bracket_refutes_does_not_count():
    problem, w_E = LQR(3), np.array([0.3, 0.5, 0.2])
    expert = replace(misled(problem, w_E, 0, 1e-4, share=0.2), vouched_by="--expert-gap")
    rng = np.random.default_rng(0)
    run = list(cpirl(problem.forward, expert, mode="minimise", rng=rng, probe=Probing()))
    assert run[-1].certainty.source is Gap.MEASURED and run[-1].certainty.gap > 0.0
    lower, upper = run[-1].intervals.T
    assert ((lower <= w_E) & (w_E <= upper)).all()


@pytest.mark.parametrize("mode", ["optimal", "set", "minimise"])
def test_whatever_ends_a_run_its_intervals_hold_experts_not_twice_as_suboptimal(mode):
    problem, seen = LQR(3, perturbation=0.15), set()
    for seed in range(30):
        rng = np.random.default_rng(seed)
        w_E = rng.dirichlet(np.ones(3))
        expert = problem.expert(w_E, rng)
        run = list(cpirl(problem.forward, expert, mode=mode, rng=rng, probe=Probing()))
        last, gap = run[-1], float(w_E @ (problem.forward(w_E).mu - expert.mu))
        assert last.bracket.lower <= gap * (1 + 1e-9), "no weights are worse than the best"
        if gap <= 2.0 * last.bracket.lower:
            seen.add(last.status)
            lower, upper = last.intervals.T
            assert ((lower <= w_E + 1e-9) & (w_E <= upper + 1e-9)).all(), (seed, last.status)
    ends = {Status.DOMINATED, Status.NOT_OPTIMAL} if mode == "minimise" else {Status.CONTRADICTED}
    assert seen == ends
