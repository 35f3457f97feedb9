"""Rules that end a run, on made-up iterations and bundles."""

from types import SimpleNamespace

import numpy as np
import pytest

from walking_irl.cpirl import endings
from walking_irl.cpirl.bundle import Bundle
from walking_irl.cpirl.levels import levels_of
from walking_irl.cpirl.loop import cpirl
from walking_irl.cpirl.outlook import DeadEnd, Outlook, Progress
from walking_irl.cpirl.stops import CertificateBelow, EstimateSettled, IntervalsNarrowerThan
from walking_irl.domains.lqr import LQR
from walking_irl.errors import EmptyPolyhedronError, FlatPolyhedronError, InvalidInputError
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.types import Expert, Iteration, Response, Rule, Status


def made_up(certificate=1.0, width=1.0, w=0.5):
    P = WeightPolyhedron.simplex(2)
    mu = estimate = np.array([w, 1.0 - w])
    intervals = np.array([[0.0, 0.1 * width], [0.5, 0.5 + width]])
    return Iteration(
        0, P, mu, Rule.CENTRE, Response(None, mu), 0.1, 0.1, certificate, intervals, estimate,
        Status.CUT,
    )  # fmt: skip


def test_certificate_is_compared_with_the_newest_iteration():
    rule = CertificateBelow(0.1)
    assert rule([made_up(certificate=0.05), made_up(certificate=0.2)]) is None
    assert rule([made_up(certificate=0.2), made_up(certificate=0.1)]) is Status.GAP_CLOSED


def test_the_widest_interval_counts():
    rule = IntervalsNarrowerThan(0.2)
    assert rule([made_up(width=0.3)]) is None
    assert rule([made_up(width=0.3), made_up(width=0.2 - 1e-12)]) is Status.CONVERGED


@pytest.mark.parametrize("n", [1, 2, 3])
def test_estimate_must_stay_for_n_iterations(n):
    rule = EstimateSettled(0.01, n)
    still = [made_up(w=0.3)] * n
    assert rule(still) is None, "there must be n moves to look at"
    assert rule([made_up(w=0.5), *still]) is None
    assert rule([made_up(w=0.304), *still]) is Status.CONVERGED


def test_a_rule_ends_the_run_with_its_status():
    rng = np.random.default_rng(0)
    expert = LQR(4).expert(rng.dirichlet(np.ones(4)), rng)
    run = list(cpirl(LQR(4).forward, expert, rng=rng, stop=[CertificateBelow(1.0)]))
    assert run[-1].status is Status.GAP_CLOSED and run[-1].certificate <= 1.0
    assert all(it.certificate > 1.0 and it.status is Status.CUT for it in run[:-1])


def outlook(*policies, mode="optimal", mu_E=(1.0, 1.0), **known):
    """After one query at the middle for each policy, features of shape (2,)."""
    bundle = Bundle.of(Expert(np.array(mu_E), np.zeros(2)))
    for mu in policies:
        bundle = bundle.add(np.full(2, 0.5), Response(None, np.array(mu)))
    return Outlook(bundle, levels_of(mode, 1e-6), Rule.NEWTON, **known)


def status(rule, seen):
    end = rule(seen)
    return None if end is None else end.status


def test_weights_whose_best_policy_does_not_beat_the_expert_match():
    rule = endings.Matched(0.02)
    assert status(rule, outlook((1.6, 0.39))) is Status.MATCHED
    assert status(rule, outlook((1.6, 0.42))) is Status.MATCHED, "within the tolerance"
    assert status(rule, outlook((1.6, 0.5))) is None
    gauge = outlook((1.6, 0.4))
    assert status(rule, gauge) is None, "equal weights explain everyone where sums are constant"


def test_one_policy_dominates_only_if_it_is_nowhere_worse_and_somewhere_better():
    rule = endings.Dominated(1e-6)
    seen = {(1.2, 0.9): None, (1.0, 1.0): None, (1.1, 1.0): Status.DOMINATED}
    for mu, expected in seen.items():
        assert status(rule, outlook((2.0, 0.0), mu, mode="minimise")) is expected


def test_gap_between_the_best_regret_and_the_mixtures_value_closes():
    rule = endings.GapCloses(1e-3)
    gap = outlook((2.0, 0.5), (0.5, 2.0), mode="minimise")  # 0.25 by either, 0.25 by their mixture
    assert status(rule, gap) is Status.MIXTURE_DOMINATES
    assert status(rule, outlook((2.0, 0.5), mode="minimise")) is None
    assert status(rule, outlook((1.5, 0.5), (0.5, 1.5), mode="minimise")) is Status.GAP_CLOSED


@pytest.fixture
def dominated():
    """Policies between effort and time, and an expert that is worse than one of them in both."""
    pace = np.linspace(0.0, 1.0, 101)
    costs = np.c_[pace**2, (1.0 - pace) ** 2] + 0.2

    def forward(w):
        best = int(np.argmin(costs @ w))
        return Response(best, mu=-costs[best])

    return forward, costs, Expert(-(costs[70] + [0.05, 0.02]), np.zeros(2))


@pytest.mark.parametrize("bracket", [0.02, 0.001])
def test_a_bracket_is_closed_although_a_policy_dominates(dominated, bracket):
    forward, costs, expert = dominated
    run = {"mode": "minimise", "rng": np.random.default_rng(0)}
    assert list(cpirl(forward, expert, **run))[-1].status is Status.DOMINATED
    found = list(cpirl(forward, expert, bracket=bracket, **run))[-1]
    assert found.status is Status.NOT_OPTIMAL and found.status.is_success
    W = np.c_[np.linspace(0, 1, 2001), 1 - np.linspace(0, 1, 2001)]
    least = float((W @ -expert.mu - (W @ costs.T).min(axis=1)).min())
    w = found.estimate
    regret = float(w @ -expert.mu - (costs @ w).min())
    assert least - 1e-9 <= regret <= least + bracket * float(w @ -expert.mu)


@pytest.mark.parametrize(("mode", "bracket"), [("optimal", 0.01), ("minimise", 0.0)])
def test_a_bracket_is_asked_for_where_there_is_one(dominated, mode, bracket):
    forward, _, expert = dominated
    with pytest.raises(InvalidInputError, match="bracket"):
        next(cpirl(forward, expert, mode=mode, bracket=bracket, rng=np.random.default_rng(0)))


def test_newton_ends_where_its_step_does_nothing_or_leads_to_the_demonstration():
    short, long = (
        Progress(np.array([0.6, 0.4]), length=length, n_poor=0) for length in (1e-5, 0.2)
    )
    step = endings.StepsEnd(1e-4)
    model = SimpleNamespace(best=0)
    assert status(step, outlook((1.3, 0.8), model=model, progress=short)) is Status.CONVERGED
    assert status(step, outlook((1.3, 0.8), model=model, progress=long)) is None
    assert status(step, outlook((1.0, 1.0), model=model, progress=short)) is None
    at_middle = Progress(np.full(2, 0.5), length=0.2, n_poor=0)
    found = endings.MatchIsBest(1e-4)(outlook((1.0, 1.0), progress=at_middle))
    np.testing.assert_array_equal(found.estimate, [0.5, 0.5])
    assert endings.MatchIsBest(1e-4)(outlook((1.3, 0.8), progress=at_middle)) is None


@pytest.mark.parametrize("gap", [1e-6, 1e-2])
@pytest.mark.parametrize("n_poor", [1, 2])
def test_poor_steps_end_a_run_only_near_the_minimum(n_poor, gap):
    progress = Progress(np.full(2, 0.5), 0.2, n_poor, gap)
    is_over = endings.gains_nothing(outlook((1.3, 0.8), progress=progress)) is not None
    assert is_over == (n_poor == 2 and gap == 1e-6)


def test_noise_explains_a_step_only_once_the_defect_is_measured():
    rule = endings.NoiseExplains(1e-3)
    step = Progress(np.full(2, 0.5), length=0.05, n_poor=0, noise=0.1)
    assert status(rule, outlook((1.3, 0.8), progress=step)) is Status.CONVERGED
    for other in ({"is_measured": False}, {"noise": 0.01}):
        assert status(rule, outlook((1.3, 0.8), progress=step._replace(**other))) is None
    stalled = step._replace(noise=0.01, has_stalled=True)
    assert status(rule, outlook((1.3, 0.8), progress=stalled)) is Status.CONVERGED


def test_a_dead_end_says_why():
    beaten, lone = ((2.0, 0.5), (0.5, 2.0)), ((1.5, 0.6),)
    cases = [
        (DeadEnd(None, np.array([0.3, 0.7])), lone, "optimal", Status.STALLED),
        (DeadEnd(FlatPolyhedronError("flat")), lone, "optimal", Status.GAP_CLOSED),
        (DeadEnd(EmptyPolyhedronError("empty")), lone, "optimal", Status.EMPTY),
        (DeadEnd(EmptyPolyhedronError("empty")), beaten, "optimal", Status.CONTRADICTED),
        (DeadEnd(EmptyPolyhedronError("empty")), beaten, "minimise", Status.MIXTURE_DOMINATES),
    ]
    for dead_end, policies, mode, expected in cases:
        rules = endings.endings_of(levels_of(mode, 1e-6), True, 1e-6).dead_end
        seen = outlook(*policies, mode=mode, dead_end=dead_end)
        assert endings.ending(rules, seen).status is expected
    rules = endings.endings_of(levels_of("optimal", 1e-6), True, 1e-6).dead_end
    np.testing.assert_array_equal(
        endings.ending(rules, outlook(*lone, dead_end=cases[0][0])).estimate, [0.3, 0.7]
    )
