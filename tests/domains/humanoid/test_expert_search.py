"""The expert's search is at least as good as every gait that is known."""

import numpy as np
import pytest

from walking_irl.domains.humanoid import expert_search
from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.learner import Start, known_gaits, solver_for

SPEC = Humanoid("humanoid-planar").spec


@pytest.fixture
def searched():
    """A search for weights of a shipped gait that has only looked at the worst of all gaits."""
    shipped = max(load_library(SPEC.body).values(), key=lambda g: float(np.ptp(g.w)))
    job = expert_search._Search(SPEC, shipped.w, None)
    known = sorted(known_gaits(SPEC), key=lambda s: float(s.total_costs @ shipped.w))
    worst = solver_for(SPEC).solve(shipped.w, known[-1].x, ())
    return job, known, worst


def test_shipped_gaits_that_beat_what_was_found_are_finished(searched):
    job, known, worst = searched
    found = expert_search._cheaper(job, known[:2], [worst])
    assert len(found) == 2
    assert min(map(job.cost, found)) <= float(known[0].total_costs @ job.w) * (1 + 1e-9)


def test_nothing_is_searched_again_where_no_known_gait_is_better(searched):
    job, known, worst = searched
    dearer = [Start(s.x, s.total_costs + worst.total_costs) for s in known[:2]]
    assert expert_search._cheaper(job, dearer, [worst]) == [] and job.starts == 0
