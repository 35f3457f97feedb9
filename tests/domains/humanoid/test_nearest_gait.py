import numpy as np
import pytest

from walking_irl.baselines.inverse_optimal_control import bilevel_gauss_newton, kkt_residual
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.inverse_optimal_control import (
    NearestGait,
    root_jacobian,
    stationarity,
)
from walking_irl.domains.humanoid.learner import solver_for
from walking_irl.domains.humanoid.spec import HUMANOID, PLANAR

BODIES = pytest.mark.parametrize("spec", [PLANAR, HUMANOID], ids=lambda s: s.body)


def optimal(spec, name="typical 2"):
    """Weights and their optimal gait."""
    known, solver = load_library(spec.body)[name], solver_for(spec)
    x = known.gait.to_vector()
    x = solver.solve(known.w, x, root=solver.dual(x)).x
    return known.w, Gait.from_vector(x, len(spec.walker.joints))


@BODIES
def test_derivatives_of_the_root_forces_are_those_of_differences(spec):
    solver, (_, gait) = solver_for(spec), optimal(spec)
    x = gait.to_vector()
    dx = 1e-7 * np.random.default_rng(0).standard_normal(x.size)
    up, down = (solver.problem.evaluate(x + s * dx).root.ravel() for s in (1, -1))
    got = root_jacobian(solver.linearise(x)) @ dx
    np.testing.assert_allclose(got, (up - down) / 2, atol=1e-6 * np.abs(got).max())


@BODIES
def test_an_optimal_gait_is_stationary_for_its_weights_only(spec):
    """1e-5: the gradient that the solver leaves, its stop being 1e-10 of the cost."""
    w, gait = optimal(spec)
    found = kkt_residual(*stationarity(spec, gait))
    np.testing.assert_allclose(found.w, w, atol=1e-5)


@pytest.mark.slow
def test_a_gait_with_noise_is_explained_by_the_nearest_optimal_one():
    """Half a degree in 440 angles leaves weights uncertain by some thousandths."""
    w, gait = optimal(PLANAR)
    noise = np.random.default_rng(3).standard_normal((gait.n_knots, 11))
    gait.q[:, 3:] += np.deg2rad(0.5) * noise
    near = NearestGait(PLANAR, gait)
    found = bilevel_gauss_newton(near, 6)
    assert np.abs(found.w - w).sum() <= 0.02
    assert near.n_solves <= 15
    assert np.abs(kkt_residual(*stationarity(PLANAR, gait)).w - w).sum() > 0.5


def test_slope_of_the_angles_is_that_of_solves_for_other_weights():
    """1 %: the difference quotient of two optima, and what a later start explains."""
    w, gait = optimal(PLANAR)
    near = NearestGait(PLANAR, gait)
    change = np.array([1, -1, 0, 0, 0, 0]) * 1e-4
    here = near(w)
    difference = near(w - change).residual - near(w + change).residual
    expected = 2 * here.slope() @ change
    assert np.linalg.norm(difference - expected) <= 0.01 * np.linalg.norm(expected)
