import os
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from problems import polyhedron_around

from walking_irl.errors import (
    EmptyPolyhedronError,
    FlatPolyhedronError,
    InvalidInputError,
    SolverError,
)
from walking_irl.geometry.centres import CENTRES, centre_rule
from walking_irl.geometry.centres.chebyshev import chebyshev
from walking_irl.geometry.centres.ellipsoid import cvxpy_ellipsoid, inscribed_ellipsoid
from walking_irl.geometry.centres.gravity import gravity, hit_and_run
from walking_irl.geometry.halfspaces import barrier_centre
from walking_irl.geometry.plane import plane_basis
from walking_irl.geometry.polyhedron import WeightPolyhedron


def is_strictly_inside(P, centre):
    return float(np.min(P.b - P.A @ centre.z)) > 0.0


KINDS = {
    **dict.fromkeys([1.0, 1e-2, 1e-4, 1e-6, 3e-7], None),  # widths of sets with interior
    **dict.fromkeys([1e-7, 1e-8], EmptyPolyhedronError),  # on the border: interior or flat
    "flat": FlatPolyhedronError,
    "empty by 1e-6": EmptyPolyhedronError,
    "empty by 0.1": EmptyPolyhedronError,
    "contradiction": EmptyPolyhedronError,
}
"""What a set is, and the error that its centres may raise."""
DIMENSIONS = [*range(1, 5)] * 6 + [*range(5, 9)] * 3 + [*range(9, 16)]


def degenerate(rng, n, kind, stretch):
    """A polyhedron of that kind around some weights, with repeated and near-parallel rows."""
    width = kind if isinstance(kind, float) else 1.0
    P, w = polyhedron_around(rng, n + 1, int(rng.integers(0, 4 * n + 4)), width, stretch)
    twins = np.repeat(P.cuts[:2], 2, axis=0)
    P = P.cut_all(np.r_[P.cuts, twins + 1e-7 * width * rng.random(twins.shape)])
    if isinstance(kind, float):
        return P
    d = plane_basis(n + 1) @ rng.standard_normal(n)
    d /= np.linalg.norm(d)
    gap = {"flat": 0.0, "empty by 1e-6": 1e-6, "empty by 0.1": 0.1, "contradiction": 3.0}[kind]
    return P.cut_all(np.array([d - d @ w + gap, -d + d @ w + gap]))


def check_all_centres(seed, n, kind, stretch):
    """Every centre lies inside; where there is none, all say so by the right error."""
    rng = np.random.default_rng(seed)
    P = degenerate(rng, n, kind, stretch)
    rules = {**CENTRES, "cg": partial(gravity, n_samples=100)}
    errors = []
    for rule in rules.values():
        try:
            centre = rule(replace(P), rng=rng)  # a copy that has nothing computed yet
        except EmptyPolyhedronError as error:
            errors.append(error)
            continue
        assert is_strictly_inside(P, centre)
        assert P.contains(centre.w, 1e-12)
    assert len(errors) in (0, len(rules)), "either every centre exists or none"
    if KINDS[kind] is None:
        assert not errors
    for error in errors:
        is_flat = abs(error.radius) <= 1e-7
        assert type(error) is (FlatPolyhedronError if is_flat else EmptyPolyhedronError)
        assert error.radius <= 1e-7
    if isinstance(kind, str):
        assert [type(e) for e in errors] == [KINDS[kind]] * len(rules)


cases = given(
    seed=st.integers(0, 2**31),
    n=st.sampled_from(DIMENSIONS),
    kind=st.sampled_from(list(KINDS)),
    stretch=st.sampled_from([1.0, 1e3, 1e6]),
)
relaxed = {"deadline": None, "suppress_health_check": list(HealthCheck), "derandomize": True}


@settings(max_examples=200, **relaxed)
@cases
def test_every_centre_is_inside_or_its_absence_is_named(seed, n, kind, stretch):
    check_all_centres(seed, n, kind, stretch)


@pytest.mark.slow
@settings(max_examples=int(os.environ.get("CENTRE_CASES", "4000")), **relaxed)
@cases
def test_every_centre_is_inside_or_its_absence_is_named_in_many_cases(seed, n, kind, stretch):
    """4,000 polyhedra (CENTRE_CASES=10000 for more) of dimension 1 to 15, each through all centres.

    Thin down to a radius of 1.5e-7, on the border of flatness, flat, empty and contradictory;
    up to 4 n + 9 cuts, in random directions or within 1e-3 or 1e-6 of one axis, two of them twice
    more in nearly parallel copies. Half of them have fewer than 5 dimensions.
    """
    check_all_centres(seed, n, kind, stretch)


@pytest.mark.parametrize("K", [2, 4, 6])
def test_centre_of_gravity_is_inside_at_small_scale(K):
    rng = np.random.default_rng(K)
    P, _ = polyhedron_around(rng, K, 20, 1e-6)
    assert is_strictly_inside(P, gravity(P, rng=rng))


@pytest.mark.parametrize("name", ["ac", "cg", "mvie"])
def test_ellipsoids_lie_inside_and_around(name):
    rng = np.random.default_rng(3)
    for K in (3, 4, 5):
        P, _ = polyhedron_around(rng, K, 12, 0.2)
        c = CENTRES[name](P, rng=rng)
        reach = np.sqrt(np.einsum("ij,jk,ik->i", P.A, c.shape, P.A))
        assert np.all(P.A @ c.z + c.inner * reach <= P.b + 1e-9)
        offset = P.to_plane(P.vertices()) - c.z
        distance = np.sqrt(np.einsum("ij,ij->i", offset, np.linalg.solve(c.shape, offset.T).T))
        assert distance.max() <= c.outer * (1 + 1e-9)


@pytest.mark.parametrize("K", [3, 4, 5])
def test_gruenbaum_bound_on_the_volume(K):
    rng = np.random.default_rng(K)
    n = K - 1
    for _ in range(10):
        P, _ = polyhedron_around(rng, K, 8, 0.2)
        w = gravity(P, rng=rng).w
        d = rng.standard_normal(K)
        assert P.cut(d - d @ w).volume() <= P.volume() * (1 - (n / K) ** n) * (1 + 1e-6)


def test_samples_have_the_moments_of_the_triangulated_set():
    rng = np.random.default_rng(0)
    for _ in range(3):
        P, _ = polyhedron_around(rng, 5, 8, 0.2)
        exact = gravity(P, rng=rng)
        rows = P.whitened.rows
        y = hit_and_run(rows, 20_000, rng)
        assert (y @ rows.T).max() < 1.0
        z = P.barrier.z + np.linalg.solve(P.barrier.R, y.T).T
        root = np.linalg.cholesky(exact.shape)
        unit = np.linalg.solve(root, (z - exact.z).T)
        # Four standard errors of independent samples, twice over because they are not.
        assert np.abs(unit.mean(axis=1)).max() <= 8 / np.sqrt(20_000)
        np.testing.assert_allclose(np.cov(unit), np.eye(4), atol=0.08)


@pytest.mark.parametrize("K", [6, 7])
def test_gruenbaum_bound_on_the_volume_with_a_sampled_centre(K):
    rng = np.random.default_rng(K)
    n, n_samples = K - 1, 1000
    for _ in range(3):
        P, _ = polyhedron_around(rng, K, 8, 0.2)
        w = gravity(P, rng=rng, n_samples=n_samples).w
        d = rng.standard_normal(K)
        missed = 2 * np.sqrt(n / n_samples)  # Bertsimas and Vempala: 1 - 1/e + missed
        assert P.cut(d - d @ w).volume() <= P.volume() * (1 - 1 / np.e + missed)


@pytest.mark.parametrize("K", [3, 4, 6])
def test_inscribed_ellipsoid_shrinks_by_tarasov_khachiyan_erlikh(K):
    rng = np.random.default_rng(K)
    for _ in range(10):
        P, _ = polyhedron_around(rng, K, 8, 0.2)
        before = CENTRES["mvie"](P, rng=rng)
        d = rng.standard_normal(K)
        after = CENTRES["mvie"](P.cut(d - d @ before.w), rng=rng)
        ratio = np.sqrt(np.linalg.det(after.shape) / np.linalg.det(before.shape))
        assert ratio <= 0.843 + 1e-3


@pytest.mark.parametrize("width", [0.3, 1e-6])
def test_inscribed_ellipsoid_agrees_with_cvxpy(width):
    P, _ = polyhedron_around(np.random.default_rng(0), 4, 15, width)
    rows = P.whitened.rows
    ours, oracle = inscribed_ellipsoid(rows), cvxpy_ellipsoid(rows)
    np.testing.assert_allclose(ours.centre, oracle.centre, atol=1e-4)
    assert np.linalg.slogdet(ours.square)[1] == pytest.approx(
        np.linalg.slogdet(oracle.square)[1], abs=1e-5
    )


SCALES = pytest.mark.parametrize("scale", [1.0, 1e-4])
"""Of the image, whose inscribed radius is 4e-3 to 7e-3 and 4e-7 to 7e-7."""


def mapped_pair(n, T, seed=0):
    """Two polytopes off the bounds of the weights, the second the image of the first under T."""
    rng = np.random.default_rng(seed)
    U = plane_basis(n + 1)
    N = np.r_[np.eye(n), -np.eye(n), rng.standard_normal((3 * n, n))]
    N /= np.linalg.norm(N, axis=1, keepdims=True)
    h = 0.3 / (n + 1) * rng.uniform(0.5, 1.0, len(N))
    pair = []
    for normals in (N, N @ np.linalg.inv(T)):  # T z with N z <= h
        pair.append(WeightPolyhedron.simplex(n + 1).cut_all(normals @ U.T - h[:, None]))
    return pair


def random_map(n):
    """A linear map that stretches some directions ten times more than others, none above 1."""
    rng = np.random.default_rng(n)
    left, _ = np.linalg.qr(rng.standard_normal((n, n)))
    right, _ = np.linalg.qr(rng.standard_normal((n, n)))
    return left * np.geomspace(0.1, 1.0, n) @ right


@pytest.mark.parametrize("n", [2, 3, 6])
@SCALES
def test_inscribed_ellipsoid_moves_with_an_affine_map(n, scale):
    T = scale * random_map(n)
    before, after = (CENTRES["mvie"](P, rng=None) for P in mapped_pair(n, T))
    image = T @ before.shape @ T.T
    root = np.linalg.cholesky(image)
    off = np.linalg.solve(root, after.z - T @ before.z)
    assert np.linalg.norm(off) <= 1e-7
    ratio = np.linalg.solve(root, np.linalg.solve(root, after.shape).T)
    np.testing.assert_allclose(ratio, np.eye(n), atol=1e-7)


@pytest.mark.parametrize("n", [1, 2, 3, 4])
@SCALES
def test_centre_of_gravity_moves_with_an_affine_map(n, scale):
    T = scale * random_map(n)
    before, after = (gravity(P, rng=None) for P in mapped_pair(n, T))
    root = np.linalg.cholesky(T @ before.shape @ T.T)
    assert np.linalg.norm(np.linalg.solve(root, after.z - T @ before.z)) <= 1e-8
    ratio = np.linalg.solve(root, np.linalg.solve(root, after.shape).T)
    np.testing.assert_allclose(ratio, np.eye(n), atol=1e-8)


@pytest.mark.parametrize("n", [1, 3, 8])
@SCALES
def test_analytic_centre_moves_with_an_affine_map_and_ignores_the_scale_of_rows(n, scale):
    rng = np.random.default_rng(n)
    T, shift = scale * random_map(n), rng.standard_normal(n)
    P, _ = polyhedron_around(rng, n + 1, 3 * n, 0.2)
    before = P.barrier
    A = P.A @ np.linalg.inv(T)
    rows = rng.uniform(0.1, 10.0, len(A)) / np.linalg.norm(A, axis=1)
    after = barrier_centre(A * rows[:, None], (P.b + A @ shift) * rows, shift + T @ P.ball.z)
    off = np.linalg.solve(T, after.z - shift) - before.z
    assert np.linalg.norm(before.R @ off) <= 1e-7


@pytest.mark.parametrize("n", [2, 3, 6])
def test_chebyshev_centre_does_not_move_with_an_affine_map(n):
    T = random_map(n)
    before, after = (chebyshev(P) for P in mapped_pair(n, T))
    assert np.linalg.norm(np.linalg.solve(T, after.z) - before.z) > 0.5 * before.shape[0, 0] ** 0.5


@pytest.mark.parametrize("width", [1.0, 1e-3, 1e-6])
@pytest.mark.parametrize("n", [1, 4, 12])
def test_analytic_centre_is_the_same_from_any_start(n, width):
    rng = np.random.default_rng(n)
    P, _ = polyhedron_around(rng, n + 1, 4 * n, width)
    feasible = barrier_centre(P.A, P.b, P.ball.z)
    outside = rng.standard_normal((5, n))
    outside *= 2.0 / np.linalg.norm(outside, axis=1, keepdims=True)
    assert np.all((outside @ P.A.T > P.b).any(axis=1))
    for start in (np.zeros(n), *outside):
        off = barrier_centre(P.A, P.b, start).z - feasible.z
        assert np.linalg.norm(feasible.R @ off) <= 1e-9


def test_newton_without_an_interior_ends_with_an_error():
    P = WeightPolyhedron.simplex(3).cut_all(np.array([[0.6, -0.4, 0.1], [-0.4, 0.6, 0.1]]))
    assert P.ball.radius < 0.0
    with pytest.raises(SolverError, match="analytic centre"):
        barrier_centre(P.A, P.b, np.zeros(2))


def test_analytic_centre_balances_its_rows():
    P, _ = polyhedron_around(np.random.default_rng(0), 5, 20, 0.1)
    z = CENTRES["ac"](P, rng=np.random.default_rng(0)).z
    assert np.abs(P.A.T @ (1 / (P.b - P.A @ z))).max() <= 1e-6 / P.ball.radius


@pytest.mark.parametrize(("K", "last"), [(3, 0.41421), (5, 1 / 3), (10, 0.25)])
def test_chebyshev_centre_of_drop_last_coordinates_favours_the_last_weight(K, last):
    P = WeightPolyhedron.simplex(K)
    assert last == pytest.approx(1 / (1 + np.sqrt(K - 1)), abs=1e-5)
    assert chebyshev(P).w[-1] == pytest.approx(1 / K, abs=1e-9)
    assert chebyshev(P, coordinates="drop-last").w[-1] == pytest.approx(last, abs=1e-5)


@pytest.mark.parametrize(("K", "fewest"), [(3, 50), (40, 80)])
def test_too_few_samples_are_named(K, fewest):
    P, rng = WeightPolyhedron.simplex(K), np.random.default_rng(0)
    gravity(P, rng=rng, n_samples=fewest)
    with pytest.raises(InvalidInputError, match=f"at least {fewest}, got {fewest - 1}"):
        gravity(P, rng=rng, n_samples=fewest - 1)


def test_unknown_centre_lists_the_names():
    with pytest.raises(
        InvalidInputError, match="unknown centre 'acc'; choose from ac, cc, cg, mvie"
    ):
        centre_rule("acc")
