import numpy as np
import pytest
from problems import TWO_POLICIES, polyhedron_around, random_menu
from scipy.optimize import linprog

from walking_irl.cpirl import certificates as cert
from walking_irl.cpirl.loop import cpirl
from walking_irl.domains.lqr import LQR
from walking_irl.errors import InvalidInputError
from walking_irl.geometry.centres import CENTRES
from walking_irl.geometry.game import game_lp
from walking_irl.geometry.plane import plane_basis
from walking_irl.geometry.polyhedron import WeightPolyhedron


@pytest.mark.parametrize("seed", range(4))
def test_every_bound_holds_on_random_menus(seed):
    rng = np.random.default_rng(seed)
    K = 3 + seed % 3
    menu, w_E = random_menu(rng, K), rng.dirichlet(np.ones(K))
    expert = menu.expert(w_E)
    simplex, rows, t_before, tol = WeightPolyhedron.simplex(K), [], np.inf, 1e-7
    for it in cpirl(menu.forward, expert, rng=rng, max_solves=12):
        d = it.response.mu - expert.mu
        rows.append(d)
        D = np.array(rows)
        assert (D @ w_E).max() <= 1e-12, "the expert's weights are never cut"
        P = simplex.cut_all(D)
        losses, game = -D @ w_E, game_lp(D)
        assert game.value <= t_before + tol
        t_before = game.value
        assert losses.min() <= game.value + tol
        assert -tol <= w_E @ (expert.mu - game.mixture @ (D + expert.mu)) <= game.value + tol
        assert losses[-1] <= cert.loss_bound(w_E, it.w, d, float(it.w @ d)) + tol
        if P.ball.radius <= 1e-6:
            break
        U = cert.single_policy_bounds(P, D)
        assert np.all(losses <= U + tol)
        assert cert.least_certificate(P, D) - tol <= game.value <= U.min() + tol
        assert U[-1] <= cert.radius_bound(P, it.w, d, float(it.w @ d)) + tol
        assert game.value <= cert.volume_bound(D, P.volume() / simplex.volume()) + tol
        lo, hi = P.intervals().T
        assert np.all((lo <= w_E + tol) & (w_E <= hi + tol))


@pytest.mark.parametrize("name", ["ac", "cg", "mvie"])
def test_ellipsoids_bracket_losses_intervals_and_diameter(name):
    rng = np.random.default_rng(5)
    P, _ = polyhedron_around(rng, 4, 12, 0.2)
    centre = CENTRES[name](P, rng=rng)
    for d in rng.standard_normal((5, 4)):
        low, high = cert.ellipsoid_bounds(centre, d)
        assert low - 1e-9 <= cert.single_policy_bounds(P, d[None])[0] <= high + 1e-9
    outer, inner = cert.ellipsoid_intervals(centre), P.intervals()
    assert np.all(outer[:, 0] <= inner[:, 0] + 1e-9)
    assert np.all(inner[:, 1] <= outer[:, 1] + 1e-9)
    V = P.vertices()
    diameter = np.linalg.norm(V[:, None] - V[None], axis=2).max()
    low, high = cert.diameter_bounds(centre)
    assert low <= diameter + 1e-9
    assert diameter <= high + 1e-9


@pytest.mark.parametrize("K", [2, 3, 6, 12])
def test_certificate_over_the_simplex_equals_that_over_the_polyhedron(K):
    rng = np.random.default_rng(K)
    before = np.inf
    w_E = rng.dirichlet(np.ones(K))
    D = rng.standard_normal((4 * K, K))
    D -= np.maximum(D @ w_E, 0.0)[:, None]  # as of an expert that is optimal for w_E
    for n in (1, K, 4 * K):
        P = WeightPolyhedron.simplex(K).cut_all(D[:n])
        game = game_lp(D[:n])
        oracle = linprog(
            np.r_[np.zeros(K), -1.0],
            A_ub=np.r_[np.c_[D[:n], np.ones(n)], np.c_[P.cuts, np.zeros(len(P.cuts))]],
            b_ub=np.zeros(n + len(P.cuts)),
            A_eq=np.r_[np.ones(K), 0.0][None],
            b_eq=[1.0],
            bounds=[(0.0, None)] * K + [(None, None)],
        )
        assert game.value == pytest.approx(-oracle.fun, abs=1e-7)
        assert np.min(-D[:n] @ game.w) == pytest.approx(game.value, abs=1e-9)
        assert P.contains(game.w, 1e-9)
        assert game.value <= before + 1e-9
        before = game.value


def test_sign_of_the_certificate_tells_interior_from_flat_from_empty():
    rng = np.random.default_rng(0)
    seen = {"interior": 0, "flat": 0, "empty": 0}
    for i in range(300):
        K = int(rng.integers(2, 7))
        D = rng.standard_normal((2 * K, K)) - 0.1
        if i % 3 == 0:  # two policies on either side of the expert, the rest worse than it is
            w = rng.dirichlet(np.ones(K))
            D -= np.maximum(D @ w, 0.0)[:, None]
            d = rng.standard_normal(K)
            d -= d @ w
            D = np.r_[D, [d, -d]]
        game, P = game_lp(D), WeightPolyhedron.simplex(K).cut_all(D)
        mixed = game.mixture @ D
        if P.is_flat:
            seen["flat"] += 1
            assert abs(game.value) <= 1e-9
            assert mixed.min() >= -1e-9, "a mixture is nowhere worse than the expert"
        elif P.ball.radius > 0.0:
            seen["interior"] += 1
            assert game.value > 1e-7
        else:
            seen["empty"] += 1
            assert game.value < -1e-7
            assert mixed.min() > 0.0, "a mixture beats the expert in every feature"
    assert min(seen.values()) >= 20, seen


def test_two_policies_mix_to_dominate_their_counterexample():
    game = game_lp(TWO_POLICIES.M - 0.4)
    np.testing.assert_allclose(game.mixture, [0.5, 0.5], atol=1e-9)
    assert game.value == pytest.approx(-0.1)


def queries(menu, mu_E, level, rng, centre="cg"):
    """Queries at centres and what they find, each cut at the level."""
    P = WeightPolyhedron.simplex(len(mu_E))
    while True:
        w = CENTRES[centre](P, rng=rng).w
        d = menu.forward(w).mu - mu_E
        yield w, d
        P = P.cut(d - level)


def hidden_expert(rng, K):
    menu = random_menu(rng, K)
    return menu, menu.expert(rng.dirichlet(np.ones(K))).mu


@pytest.mark.parametrize("centre", ["ac", "cg", "mvie"])
@pytest.mark.parametrize("accuracy", [0.1, 0.01])
@pytest.mark.parametrize("K", [3, 4, 5])
def test_certificate_falls_within_the_iteration_bound(K, accuracy, centre):
    rng = np.random.default_rng(K)
    menu, mu_E = hidden_expert(rng, K)
    rows = []
    for _, d in queries(menu, mu_E, 0.0, rng, centre):
        rows.append(d)
        if game_lp(rows).value <= accuracy * np.max(rows):
            break
        assert len(rows) < cert.iteration_bound(K, accuracy, centre)


@pytest.mark.parametrize("K", [2, 3, 5])
def test_distance_of_the_weights_follows_from_regret_and_curvature(K):
    rng = np.random.default_rng(K)
    domain, w_E = LQR(K), 0.5 * rng.dirichlet(np.ones(K)) + 0.5 / K
    expert = domain.expert(w_E, rng)
    U = plane_basis(K)
    samples = [w_E, *rng.dirichlet(np.ones(K), 200)]
    # V is separable and convex: its curvature over the simplex is least at some query.
    least = min(
        float(np.linalg.eigvalsh(U.T @ domain.forward(w).sensitivity @ U)[0]) for w in samples
    )
    for w in samples:
        f = max(float(w @ (domain.forward(w).mu - expert.mu)), 0.0)
        assert np.linalg.norm(w - w_E) <= cert.curvature_bound(f, 0.95 * least) + 1e-9


@pytest.mark.parametrize("accuracy", [0.1, 0.01])
@pytest.mark.parametrize("K", [3, 4, 5])
def test_regret_reaches_a_level_within_the_level_bound(K, accuracy):
    rng = np.random.default_rng(K)
    menu, mu_E = hidden_expert(rng, K)
    level = accuracy * max(float((menu.M @ e).max() - mu_E @ e) for e in np.eye(K))
    for n_cuts, (w, d) in enumerate(queries(menu, mu_E, level, rng)):
        if w @ d <= level:
            break
        assert n_cuts + 1 <= cert.level_bound(K, accuracy)


def test_iteration_bounds_match_their_closed_form():
    assert cert.iteration_bound(5, 0.1, "cg") == pytest.approx(20.9, abs=0.1)
    assert cert.iteration_bound(5, 0.1, "mvie") == pytest.approx(56.2, abs=0.1)
    assert cert.iteration_bound(5, 0.1, "ac") == pytest.approx(1.7e5, rel=0.05)
    assert cert.iteration_bound(5, 0.01, "ac") == pytest.approx(2e7, rel=0.2)
    with pytest.raises(InvalidInputError, match="no iteration bound"):
        cert.iteration_bound(5, 0.1, "cc")


@pytest.mark.parametrize("K", [2, 4, 8])
def test_beyond_the_analytic_bound_its_inequality_fails(K):
    """Theorem A2: every k that violates the inequality is a bound."""
    n, accuracy = K - 1, 0.1
    alpha = accuracy / (1 + accuracy)

    def holds(k):
        return k * alpha ** (2 + 2 * K / k) <= 1.74 * n**2 * (n + 1) * np.log1p(k / (2 * n))

    bound = cert.iteration_bound(K, accuracy, "ac")
    assert holds(0.99 * bound)
    assert not any(holds(bound * s) for s in np.geomspace(1.01, 1e6, 50))


def test_bad_rows_are_named():
    with pytest.raises(InvalidInputError, match="shape"):
        game_lp(np.zeros(3))
    with pytest.raises(InvalidInputError, match="regret >= 0"):
        cert.curvature_bound(-1.0, 1.0)
