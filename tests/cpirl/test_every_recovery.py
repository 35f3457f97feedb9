"""Every small domain with every centre, mode and kind of expert ends, and says something true."""

import numpy as np
import pytest

from walking_irl.geometry.centres import CENTRES
from walking_irl.run.session import run
from walking_irl.run.setup import Setup
from walking_irl.types import MODES, Status

slow = pytest.mark.slow
DOMAINS = ["lqr", "driving", "gridworld", pytest.param("walking-path", marks=slow)]


@pytest.mark.parametrize("domain", DOMAINS)
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("expert", ["optimal", "suboptimal"])
def test_every_combination_ends_with_weights_and_intervals(domain, mode, expert):
    for centre in CENTRES if domain != "walking-path" else ["ac"]:
        report = run(Setup(domain=domain, centre=centre, mode=mode, expert=expert, seed=1))
        is_told = report.ending in (Status.EMPTY, Status.BUDGET, Status.CONTRADICTED)
        assert report.is_success or is_told, centre
        if report.ending is Status.CONTRADICTED:
            assert expert == "suboptimal" and mode != "minimise", centre
            assert report.summary.bracket[0] > 0.0 and "minimise" in report.status, centre
        elif report.is_success and mode != "minimise":  # its premise: optimal for some weights
            assert report.summary.bracket[0] <= 1e-6 * np.abs(report.expert.mu).max(), centre
        assert report.w.min() >= 0 and report.w.sum() == pytest.approx(1)
        lower, upper = report.last.intervals.T
        assert (lower <= report.w + 1e-6).all() and (report.w <= upper + 1e-6).all(), centre
        if expert == "optimal":
            assert report.contains_expert, centre
        if report.ending is Status.DOMINATED:
            assert any((it.response.mu >= report.expert.mu).all() for it in report.iterations)
        if report.ending in (Status.DOMINATED, Status.MIXTURE_DOMINATES):
            assert expert == "suboptimal" and report.last.certificate < 0, centre
        low, high = report.summary.bracket
        assert low <= high + 1e-9 * np.abs(report.expert.mu).max(), centre


@pytest.mark.parametrize("centre", CENTRES)
def test_levels_close_the_gap_where_few_policies_meet_in_the_minimum(centre):
    setup = Setup(domain="driving", centre=centre, mode="minimise", expert="suboptimal", seed=1)
    report = run(setup)
    low, high = report.summary.bracket
    assert report.ending is Status.GAP_CLOSED and len(report.iterations) <= 15
    assert high - low <= 1e-6 * np.abs(report.expert.mu).max()
    assert np.all(np.diff([it.best_regret for it in report.iterations]) <= 1e-12)
