"""Splines through gait cycles, against SciPy's."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from walking_irl.domains.humanoid.gait.cycles import drifting_spline


@pytest.mark.parametrize("n", [3, 8, 41])
def test_the_spline_is_scipys_periodic_one_plus_a_drift(n):
    rng = np.random.default_rng(n)
    period, drift = 1.1, np.array([1.3, 0.0])
    times = np.linspace(0, period, n + 1)
    repeated = rng.normal(size=(n, 2))
    oracle = CubicSpline(times, np.vstack([repeated, repeated[:1]]), bc_type="periodic")
    at = drifting_spline(repeated + np.outer(times[:-1], drift), period, drift)
    asked = rng.uniform(-2 * period, 3 * period, size=200)
    values, slopes = at(asked)
    np.testing.assert_allclose(values, oracle(asked) + np.outer(asked, drift), atol=1e-12)
    np.testing.assert_allclose(slopes, oracle(asked, 1) + drift, atol=1e-11)
