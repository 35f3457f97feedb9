"""Hidden weights of the walker are recovered, and the learner has no way to peek at them."""

import pickle
from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from walking_irl.run import session
from walking_irl.run.case import Setup
from walking_irl.run.session import run, workers
from walking_irl.types import Status

PLANAR = Setup(domain="humanoid-planar", rollouts=0, seed=0)


def recover(setup):
    """Report of a run, and the case behind it."""
    cases = []
    with workers() as executor:
        report = run(setup, executor=executor, on_expert=cases.append)
    return report, cases[0]


@pytest.fixture(scope="module")
def planar():
    return recover(PLANAR)


@pytest.fixture(scope="module")
def recorded():
    return recover(replace(PLANAR, rollouts=20))


def assert_recovered(report, l1_error, solves):
    assert report.is_success and report.ending is not Status.EMPTY
    assert report.contains_expert
    assert report.l1_error <= l1_error
    assert report.to_json()["forward_solves"] <= solves
    # Below zero the learner found a walk cheaper than the expert's: no search here is global.
    assert -5e-3 < report.relative_loss(report.recovered_mu) < 1e-3


def assert_never_cut(report):
    for it in report.iterations:
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


def test_other_hidden_weights_for_scoring_change_nothing_that_is_learnt(planar, monkeypatch):
    report, case = planar
    forward = case.domain.learner(case.subject.expert, case.forward.threads)
    subject = replace(case.subject, w_expert=np.roll(case.subject.w_expert, 1))
    other = replace(case, subject=subject, forward=forward)
    monkeypatch.setattr(session, "prepare", lambda setup, executor: other)
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
def test_learner_never_sees_the_hidden_weights(knowledge, request):
    _, case = request.getfixturevalue(knowledge)
    given = {"expert": case.subject.expert, "forward": case.forward}
    if case.measure is not None:
        given["measure"] = copy(case.measure)
        given["measure"].executor = None  # a process pool cannot be pickled, and knows nothing
    peeking = pickle.dumps((case.subject.expert, case.subject.w_expert))
    assert holds(peeking, case.subject.w_expert)  # the search finds what is there
    for name, part in given.items():
        assert not holds(pickle.dumps(part), case.subject.w_expert), name


def test_planar_walker_recovered_from_recorded_walks(recorded):
    report, case = recorded
    assert len(case.subject.trajectories) == 20 and case.subject.expert.covariance is not None
    assert_recovered(report, l1_error=0.005, solves=20)


@pytest.mark.slow
def test_spatial_walker_recovered_exactly():
    report, _ = recover(Setup(rollouts=0, seed=100))
    assert_recovered(report, l1_error=0.005, solves=16)
    assert_never_cut(report)
