import numpy as np
import pytest
from problems import polyhedron_around
from scipy.optimize import linprog

from walking_irl.errors import SolverError
from walking_irl.geometry import dual_simplex
from walking_irl.geometry.dual_simplex import maximise


def box_and_cuts(seed, n, m):
    """Programs over the box [0, 1]^n with m cuts, and the corner of the box that each one wants."""
    rng = np.random.default_rng(seed)
    normals = rng.standard_normal((m, n))
    A = np.r_[-np.eye(n), np.eye(n), normals]
    b = np.r_[np.zeros(n), np.ones(n), normals @ np.full(n, 0.5) + rng.uniform(0.01, 0.3, m)]
    C = rng.standard_normal((4, n))
    return C, A, b, np.arange(n) + n * (C > 0.0)


@pytest.mark.parametrize("n", [1, 2, 7, 15])
def test_optima_agree_with_highs_and_are_proven_by_their_multipliers(n):
    C, A, b, corners = box_and_cuts(n, n, 4 * n)
    found = maximise(C, A, b, corners)
    assert (found.x @ A.T - b).max() <= 1e-11
    assert found.multipliers.min() >= 0.0
    np.testing.assert_allclose(found.multipliers @ A, C, atol=1e-9)
    for i, c in enumerate(C):
        oracle = -linprog(-c, A_ub=A, b_ub=b, bounds=(None, None)).fun
        assert c @ found.x[i] == pytest.approx(oracle, abs=1e-8)
        assert found.multipliers[i] @ b == pytest.approx(oracle, abs=1e-8)
        alone = maximise(C[i : i + 1], A, b, corners[i : i + 1])
        np.testing.assert_allclose(alone.x[0], found.x[i], atol=1e-9)


def test_optima_that_are_not_proven_come_from_highs(monkeypatch):
    C, A, b, corners = box_and_cuts(0, 5, 20)
    expected = maximise(C, A, b, corners)
    monkeypatch.setattr(dual_simplex, "_MOST_PIVOTS", 1)
    asked = []
    highs = dual_simplex._highs
    monkeypatch.setattr(dual_simplex, "_highs", lambda *a: asked.append(0) or highs(*a))
    found = maximise(C, A, b, corners)
    assert asked
    np.testing.assert_allclose(found.x, expected.x, atol=1e-9)
    np.testing.assert_allclose(found.multipliers, expected.multipliers, atol=1e-7)


def test_rows_that_no_point_satisfies_are_named():
    C, A, b, corners = box_and_cuts(0, 3, 0)
    for count in (1, 4):
        with pytest.raises(SolverError, match="7 rows failed"):
            maximise(C[:count], np.r_[A, np.ones((1, 3))], np.r_[b, -1.0], corners[:count])


def test_programs_of_weight_polyhedra_never_need_highs(monkeypatch):
    monkeypatch.setattr(dual_simplex, "_highs", None)
    for seed in range(300):
        rng = np.random.default_rng(seed)
        K, width = int(rng.integers(2, 17)), 10.0 ** rng.uniform(-6, 0)
        P, _ = polyhedron_around(rng, K, int(rng.integers(0, 5 * K)), width)
        assert P.ball.radius > 0.0
        assert np.all(P.intervals()[:, 0] <= P.intervals()[:, 1])
