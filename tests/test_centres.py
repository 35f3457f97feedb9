import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from problems import polyhedron_around

from walking_irl.centres import CENTRES, centre_rule
from walking_irl.centres.chebyshev import chebyshev
from walking_irl.centres.ellipsoid import cvxpy_ellipsoid, inscribed_ellipsoid
from walking_irl.centres.gravity import gravity
from walking_irl.errors import EmptyPolyhedronError, InvalidInputError
from walking_irl.halfspaces import whitened_rows
from walking_irl.polyhedron import WeightPolyhedron


def is_strictly_inside(P, centre):
    return float(np.min(P.b - P.A @ centre.z)) > 0.0


def check_degenerate(seed, name, n, width, stretch):
    """A centre lies inside, or the error names why there is none."""
    rng = np.random.default_rng(seed)
    P, _ = polyhedron_around(rng, n + 1, int(rng.integers(0, 4 * n + 4)), width, stretch)
    if len(P.cuts):  # duplicated and near-parallel rows
        P = P.cut_all(
            np.r_[P.cuts, P.cuts[:2] + 1e-7 * width * rng.random((len(P.cuts[:2]), n + 1))]
        )
    try:
        centre = CENTRES[name](P, rng=rng)
    except EmptyPolyhedronError as error:
        assert error.radius <= 1e-7
        return
    assert is_strictly_inside(P, centre)
    assert P.contains(centre.w, 1e-12)


cases = given(
    seed=st.integers(0, 2**31),
    name=st.sampled_from(["ac", "cc", "mvie"]),
    n=st.integers(1, 15),
    width=st.sampled_from([1.0, 1e-2, 1e-4, 1e-6, 1e-7, 1e-8]),
    stretch=st.sampled_from([1.0, 1e3, 1e6]),
)
relaxed = {"deadline": None, "suppress_health_check": list(HealthCheck), "derandomize": True}


@settings(max_examples=150, **relaxed)
@cases
def test_centre_is_inside_or_its_absence_is_named(seed, name, n, width, stretch):
    check_degenerate(seed, name, n, width, stretch)


@settings(max_examples=60, **relaxed)
@given(
    seed=st.integers(0, 2**31),
    n=st.integers(1, 6),
    width=st.sampled_from([1.0, 1e-3, 1e-6, 1e-8]),
    stretch=st.sampled_from([1.0, 1e3, 1e6]),
)
def test_centre_of_gravity_is_inside_or_its_absence_is_named(seed, n, width, stretch):
    check_degenerate(seed, "cg", n, width, stretch)


@pytest.mark.slow
@settings(max_examples=10_000, **relaxed)
@cases
def test_centre_is_inside_or_its_absence_is_named_in_10000_cases(seed, name, n, width, stretch):
    check_degenerate(seed, name, n, width, stretch)


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
    rows = whitened_rows(P.A, P.barrier, P.b)
    ours, oracle = inscribed_ellipsoid(rows), cvxpy_ellipsoid(rows)
    np.testing.assert_allclose(ours.centre, oracle.centre, atol=1e-4)
    assert np.linalg.slogdet(ours.square)[1] == pytest.approx(
        np.linalg.slogdet(oracle.square)[1], abs=1e-5
    )


def test_analytic_centre_balances_its_rows():
    P, _ = polyhedron_around(np.random.default_rng(0), 5, 20, 0.1)
    z = CENTRES["ac"](P, rng=np.random.default_rng(0)).z
    assert np.abs(P.A.T @ (1 / (P.b - P.A @ z))).max() <= 1e-6 / P.ball.radius


def test_chebyshev_centre_of_drop_last_coordinates_favours_the_last_weight():
    P = WeightPolyhedron.simplex(3)
    assert chebyshev(P).w[-1] == pytest.approx(1 / 3, abs=1e-6)
    assert chebyshev(P, coordinates="drop-last").w[-1] == pytest.approx(np.sqrt(2) - 1, abs=1e-6)


def test_unknown_centre_lists_the_names():
    with pytest.raises(
        InvalidInputError, match="unknown centre 'acc'; choose from ac, cc, cg, mvie"
    ):
        centre_rule("acc")
