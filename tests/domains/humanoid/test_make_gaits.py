"""The shipped gaits can be made again: their search begins at no gait, and ends at minima."""

import importlib.util
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.learner import solver_for
from walking_irl.domains.humanoid.optimiser.solver import SMOOTH_DECREMENT
from walking_irl.domains.humanoid.spec import HUMANOID, PLANAR
from walking_irl.files import model_path


@pytest.fixture(scope="module")
def make_gaits():
    spec = importlib.util.spec_from_file_location("make_gaits", model_path("make_gaits.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_mean_angles_of_adults_become_a_walk_without_any_gait_to_start_from(make_gaits):
    """Nearly the shipped reference before any basin is hopped: within 5 % of its cost."""
    solver, w = solver_for(PLANAR), PLANAR.stack.reference_weights
    start = make_gaits.guess(PLANAR.walker)
    assert solver.dual(start) is None  # no walk
    with ThreadPoolExecutor(1) as pool:
        maker = make_gaits.Maker(PLANAR, pool)
        x = maker.finish(w, maker.walk(start), np.random.default_rng(0))
    assert abs(maker.decrement(w, x)) < SMOOTH_DECREMENT
    best = w @ load_library("humanoid-planar")["reference"].total_costs
    assert best * (1 - 1e-6) < w @ solver.problem.evaluate(x).total_costs() < 1.05 * best


@pytest.mark.parametrize("spec", [HUMANOID, PLANAR], ids=["spatial", "planar"])
def test_shipped_gaits_are_smooth_minima_for_the_weights_that_they_are_shipped_for(
    make_gaits, spec
):
    library, solver = load_library(spec.body), solver_for(spec)
    weights = make_gaits.weights_to_ship(spec)
    assert list(library) == list(weights)
    for name, known in library.items():
        np.testing.assert_allclose(known.w, weights[name], rtol=1e-9)
        x = known.gait.to_vector()
        assert solver.decrement(known.w, solver.linearise(x), solver.dual(x)) < SMOOTH_DECREMENT, (
            name
        )
