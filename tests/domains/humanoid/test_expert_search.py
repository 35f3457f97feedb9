"""The expert's search is at least as good as every gait that is known."""

import numpy as np
import pytest

from walking_irl.domains.humanoid import expert_search
from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.learner import Start, known_gaits, solver_for
from walking_irl.domains.humanoid.optimiser.perturbation import shifted

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


class Line:
    """A search over numbers instead of gaits, best at ``best``."""

    def __init__(self, best):
        self.best, self.asked = best, []

    def run(self, jobs):
        self.asked += [x for x, _, _ in jobs]
        return [x for x, _, _ in jobs]

    def shifted(self, x, knots):
        return x + knots

    def search_cost(self, x):
        return 1.0 + (x - self.best) ** 2


def test_shifts_go_on_as_long_as_they_help_and_no_further():
    job = Line(best=1.4)
    assert min(expert_search._shifted(job, [0.0]), key=job.search_cost) == 1.5
    assert job.asked == [-0.5, 0.5, 1.0, 1.5, 2.0]
    far = Line(best=100.0)
    reached = max(expert_search._shifted(far, [0.0]))
    assert reached == expert_search.MAX_SHIFTS * expert_search.SHIFT, "it ends all the same"


def test_the_dearer_of_two_basins_is_shifted_too():
    job = Line(best=0.1)
    assert 2.5 in expert_search._shifted(job, [0.0, 3.0, 7.0]) and 6.5 not in job.asked


@pytest.mark.parametrize("knots", [1, 3])
def test_a_gait_shifted_by_whole_knots_is_the_gait_further_on(knots):
    walker, x = SPEC.walker, known_gaits(SPEC)[0].x
    nv = len(walker.joints)
    q, later = x[:-2].reshape(-1, nv), shifted(walker, x, knots)
    ahead = q[:knots] @ walker.mirror.T
    ahead[:, 0] += x[-2]
    expected = np.vstack([q[knots:], ahead])
    expected[:, 0] -= knots * x[-2] / len(q)
    np.testing.assert_allclose(later[:-2].reshape(-1, nv), expected, atol=1e-12)
    np.testing.assert_array_equal(later[-2:], x[-2:])


def test_shifts_undo_each_other_and_keep_the_walk():
    """Up to the highest harmonic, which knots cannot tell from its mirror image in time."""
    walker, x = SPEC.walker, known_gaits(SPEC)[0].x
    there = shifted(walker, x, 0.5)
    assert np.abs(there - x).max() > 1e-3
    np.testing.assert_allclose(shifted(walker, there, -0.5), x, atol=1e-4)
