"""Default budgets suit their domains: recoveries end by themselves, whoever the expert is."""

import pytest

from walking_irl.run import session
from walking_irl.run.setup import Setup
from walking_irl.types import Rule


@pytest.fixture(autouse=True)
def without_probes(monkeypatch):
    """They are beyond the budget, and cost most."""
    monkeypatch.setattr(session, "Probing", lambda **_: None)


@pytest.mark.parametrize(
    ("domain", "expert", "mode"),
    [
        ("lqr", "optimal", "optimal"),
        ("lqr", "suboptimal", "minimise"),
        ("driving", "optimal", "optimal"),
        ("driving", "suboptimal", "minimise"),
        pytest.param("gridworld", "optimal", "optimal", marks=pytest.mark.slow),
        pytest.param("gridworld", "suboptimal", "minimise", marks=pytest.mark.slow),
    ],
)
def test_toy_domains_end_with_success_for_20_seeds(domain, expert, mode):
    most = 0
    for seed in range(20):
        report = session.run(Setup(domain=domain, expert=expert, mode=mode, seed=seed))
        assert report.is_success, (seed, report.status)
        most = max(most, sum(it.rule is not Rule.PROBE for it in report.iterations))
    assert 1 < most <= report.problem.max_solves / 2


@pytest.mark.slow
def test_levels_of_walking_paths_end_with_success():
    report = session.run(Setup(domain="walking-path", mode="minimise", seed=0))
    assert report.is_success, report.status
