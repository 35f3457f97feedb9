"""Stop rules on made-up iterations."""

import numpy as np
import pytest

from walking_irl.cpirl.endings import CertificateBelow, EstimateSettled, IntervalsNarrowerThan
from walking_irl.cpirl.loop import cpirl
from walking_irl.domains.lqr import LQR
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.types import Iteration, Response, Rule, Status


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
