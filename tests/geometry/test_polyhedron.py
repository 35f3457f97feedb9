import math

import numpy as np
import pytest
from problems import polyhedron_around

from walking_irl.errors import EmptyPolyhedronError, FlatPolyhedronError, InvalidInputError
from walking_irl.geometry.centres.analytic import analytic
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.geometry.rows import pruned, with_relevant


@pytest.mark.parametrize("K", [2, 3, 4, 5, 6, 7])
def test_simplex_has_its_known_volume_vertices_and_inradius(K):
    P = WeightPolyhedron.simplex(K)
    assert P.volume() == pytest.approx(math.sqrt(K) / math.factorial(K - 1), rel=1e-9)
    assert P.chebyshev().radius == pytest.approx(1 / math.sqrt(K * (K - 1)), rel=1e-9)
    V = P.vertices()
    assert sorted(map(tuple, V.round(9))) == sorted(map(tuple, np.eye(K)))


@pytest.mark.parametrize("width", [1.0, 1e-3, 1e-6])
@pytest.mark.parametrize("K", [2, 3, 6])
def test_intervals_agree_with_vertices_at_every_scale(K, width):
    P, w = polyhedron_around(np.random.default_rng(K), K, 25, width)
    V, intervals = P.vertices(), P.intervals()
    assert P.contains(w)
    size = np.ptp(V, axis=0).max()
    assert np.abs(np.c_[V.min(axis=0), V.max(axis=0)] - intervals).max() <= 1e-6 * size
    assert max(float((P.A @ P.to_plane(v) - P.b).max()) for v in V) <= 1e-6 * size


def test_pruning_keeps_the_set():
    P, _ = polyhedron_around(np.random.default_rng(0), 5, 60, 0.2)
    Q = pruned(P)
    assert len(Q.cuts) < len(P.cuts)
    assert Q.volume() == pytest.approx(P.volume(), rel=1e-9)


@pytest.mark.parametrize("K", [3, 6, 11])
def test_a_large_relevance_proves_that_a_cut_is_implied(K):
    n_implied = 0
    for seed in range(5):
        P, w = polyhedron_around(np.random.default_rng(seed), K, 2, 0.05)
        far = np.random.default_rng(seed).standard_normal((20, K))  # from inside to far outside
        far -= far.mean(axis=1, keepdims=True)
        far /= np.linalg.norm(far, axis=1, keepdims=True)
        P = P.cut_all(far - (far @ w + np.geomspace(0.05, 0.9, 20))[:, None], np.ones(20, bool))
        relevance, m = P.whitened.relevance(), len(P.barrier.slack)
        implied = np.flatnonzero(relevance >= math.sqrt(m * (m - 1)))
        assert not set(implied) & set(P.whitened.active_rows())
        n_implied += len(implied)
        in_barrier = P.whitened.relevance()[: K + 2]  # bounds and eager cuts
        assert in_barrier.min() >= 1.0 - 1e-9
    assert n_implied > 0


def test_fewer_relevant_cuts_are_the_same_set_and_a_centre_inside_it():
    rng = np.random.default_rng(0)
    P, _ = polyhedron_around(rng, 5, 60, 0.2)
    for most in (0, 4, 12, 60):
        Q = with_relevant(P, most)
        assert Q.volume() == pytest.approx(P.volume(), rel=1e-9)
        w = analytic(P, most=most).w
        assert P.contains(w, -1e-6), "strictly inside, though most cuts are ignored"
        assert 5 + most <= len(Q.barrier.slack) <= 65
    np.testing.assert_allclose(analytic(P, most=60).w, analytic(P).w, atol=1e-9)
    with pytest.raises(InvalidInputError, match="must not be negative"):
        with_relevant(P, -1)


def test_cuts_never_enlarge_the_volume():
    rng = np.random.default_rng(1)
    P, volume = WeightPolyhedron.simplex(4), math.inf
    for _ in range(15):
        P = P.cut(rng.standard_normal(4) - 0.5)
        assert P.volume() <= volume * (1 + 1e-9)
        volume = P.volume()


def test_repeated_and_empty_rows_are_dropped():
    d = np.array([1.0, -2.0, 0.5])
    P = WeightPolyhedron.simplex(3).cut_all(np.array([d, 3.0 * d, 0.0 * d, d]))
    assert len(P.cuts) == 1


def test_flat_and_empty_sets_are_named():
    d = np.array([1.0, -1.0, 0.0])
    flat = WeightPolyhedron.simplex(3).cut_all(np.array([d, -d]))
    assert flat.is_flat
    with pytest.raises(FlatPolyhedronError, match="flat"):
        flat.chebyshev()
    np.testing.assert_allclose(flat.intervals(), [[0, 0.5], [0, 0.5], [0, 1]], atol=1e-6)
    empty = WeightPolyhedron.simplex(2).cut_all(np.array([[0.6, -0.4], [-0.4, 0.6]]))
    for P in (empty, WeightPolyhedron.simplex(2).cut(np.ones(2))):
        with pytest.raises(EmptyPolyhedronError):
            P.chebyshev()
        with pytest.raises(EmptyPolyhedronError):
            P.intervals()


def test_bad_input_is_named():
    P = WeightPolyhedron.simplex(4)
    with pytest.raises(InvalidInputError, match=r"shape \(4,\), got \(3,\)"):
        P.cut(np.zeros(3))
    with pytest.raises(InvalidInputError, match="min_weight"):
        WeightPolyhedron.simplex(4, 0.25)
    with pytest.raises(InvalidInputError, match="finite"):
        P.cut(np.array([np.nan, 0, 0, 0]))


@pytest.mark.parametrize("K", [2, 4, 6])
def test_whitened_set_holds_the_unit_ball_and_maps_back(K):
    P, _ = polyhedron_around(np.random.default_rng(K), K, 12, 0.1)
    W = P.whitened
    assert W.relevance().min() >= 1.0 - 1e-9, "every row is eager: the Dikin ellipsoid is inside"
    distance = (P.b - P.A @ W.centre.z) / np.linalg.norm(P.A @ np.linalg.inv(W.centre.R), axis=1)
    np.testing.assert_allclose(W.relevance(), distance, rtol=1e-9)
    y = W.vertices()
    np.testing.assert_allclose((W.rows @ y.T).max(axis=0), 1.0, atol=1e-9)
    z = W.to_plane(y)
    np.testing.assert_allclose((z - W.centre.z) @ W.centre.R.T, y, atol=1e-9)
