"""Ground-truth weights of the walker are recovered, and the learner has no way to peek at them."""

import pickle
from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from walking_irl.run import session
from walking_irl.run.problem import pose
from walking_irl.run.session import run
from walking_irl.run.setup import Setup
from walking_irl.types import Rule, Status
from walking_irl.workers import workers

PLANAR = Setup(domain="humanoid-planar", options={"rollouts": 0}, seed=0)


def recover(setup):
    """Report of a run, and the problem behind it."""
    problems = []
    with workers() as executor:
        report = run(setup, executor=executor, on_expert=problems.append)
    return report, problems[0]


@pytest.fixture(scope="module")
def planar():
    return recover(PLANAR)


@pytest.fixture(scope="module")
def recorded():
    return recover(replace(PLANAR, options={}))


def assert_recovered(report, l1_error, solves):
    assert report.is_success and report.ending is not Status.EMPTY
    assert report.contains_expert
    assert report.l1_error <= l1_error
    assert report.to_json()["forward_solves"] <= solves
    # Below zero the learner found a walk cheaper than the expert's: no search here is global.
    assert -5e-3 < report.relative_loss(report.recovered_mu) < 1e-3


def assert_never_cut(report):
    for it in report.iterations:
        if it.rule is not Rule.PROBE:  # those are of the set {f <= level}, whatever the expert's f
            assert it.polyhedron.contains(report.w_expert, tol=1e-7), it.k
        assert np.all(it.intervals[:, 0] <= report.w_expert + 1e-9), it.k
        assert np.all(it.intervals[:, 1] >= report.w_expert - 1e-9), it.k


def test_planar_walker_recovered_exactly(planar):
    report, _ = planar
    assert_recovered(report, l1_error=0.005, solves=16)
    assert_never_cut(report)


def test_same_seed_gives_same_weights(planar):
    again, _ = recover(PLANAR)
    assert np.abs(again.w - planar[0].w).max() < 1e-9
    assert len(again.iterations) == len(planar[0].iterations)


def test_other_weights_for_scoring_change_nothing_that_is_learnt(planar, monkeypatch):
    report, problem = planar
    shown = problem.demonstration
    truth = replace(shown.truth, w=np.roll(shown.truth.w, 1))
    other = replace(shown, truth=truth)
    monkeypatch.setattr(
        session, "prepare", lambda setup, executor, on_step: pose(setup, other, executor, on_step)
    )
    again, _ = recover(PLANAR)
    assert not np.allclose(again.w_expert, report.w_expert) and again.l1_error > 0.1
    for a, b in zip(again.iterations, report.iterations, strict=True):
        assert np.abs(a.w - b.w).max() < 1e-9
        assert np.abs(a.response.mu - b.response.mu).max() < 1e-9
        assert np.abs(a.estimate - b.estimate).max() < 1e-9
        assert a.status is b.status


def numbers(content, sizes=(8, 4)):
    """All floats that any bytes of a pickle can be read as."""
    for size in sizes:
        for offset in range(size):
            n = (len(content) - offset) // size
            yield np.frombuffer(content, f"<f{size}", n, offset).astype(float)


def holds(content, w):
    """Whether a pickle holds any of the numbers, as they are or as text."""
    with np.errstate(all="ignore"):
        as_bytes = any(np.any(np.abs(x - v) < 1e-7 * v) for x in numbers(content) for v in w)
    return as_bytes or any(repr(float(v))[:8].encode() in content for v in w)


@pytest.mark.parametrize("knowledge", ["planar", "recorded"])
def test_learner_never_sees_the_ground_truth_weights(knowledge, request):
    _, problem = request.getfixturevalue(knowledge)
    learner, w_E = problem.learner, problem.w_expert
    given = {"expert": problem.expert, "forward": learner.forward}
    if learner.measure is not None:
        given["measure"] = copy(learner.measure)
        given["measure"].executor = None  # a process pool cannot be pickled, and knows nothing
    peeking = pickle.dumps((problem.expert, w_E))
    assert holds(peeking, w_E)  # the search finds what is there
    for name, part in given.items():
        assert not holds(pickle.dumps(part), w_E), name


def test_planar_walker_recovered_from_recorded_walks(recorded):
    report, problem = recorded
    shown = problem.demonstration
    assert len(shown.trajectories) == 20 and shown.expert.covariance is not None
    assert_recovered(report, l1_error=0.005, solves=20)


@pytest.mark.slow
def test_spatial_walker_recovered_exactly():
    report, _ = recover(Setup(options={"rollouts": 0}, seed=100))
    assert_recovered(report, l1_error=0.005, solves=16)
    assert_never_cut(report)
