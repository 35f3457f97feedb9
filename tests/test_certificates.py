import numpy as np
import pytest
from problems import TWO_POLICIES, polyhedron_around, random_menu

from walking_irl import certificates as cert
from walking_irl.centres import CENTRES
from walking_irl.cpirl import cpirl
from walking_irl.errors import InvalidInputError
from walking_irl.polyhedron import WeightPolyhedron


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
        losses, game = -D @ w_E, cert.game_lp(D)
        assert game.value <= t_before + tol
        t_before = game.value
        assert losses.min() <= game.value + tol
        assert -tol <= w_E @ (expert.mu - game.mixture @ (D + expert.mu)) <= game.value + tol
        assert losses[-1] <= cert.loss_bound(w_E, it.w, d, float(it.w @ d)) + tol
        if P.ball.radius <= 1e-6:
            break
        U = cert.single_policy_bounds(P, D)
        assert np.all(losses <= U + tol)
        assert game.value <= U.min() + tol
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


def test_sign_of_the_certificate_tells_interior_from_empty():
    rng = np.random.default_rng(0)
    seen = set()
    for _ in range(100):
        D = rng.standard_normal((4, 3)) - 0.1
        t, r = cert.game_lp(D).value, WeightPolyhedron.simplex(3).cut_all(D).ball.radius
        assert (t > 0) == (r > 0)
        seen.add(t > 0)
    assert seen == {True, False}


def test_two_policies_mix_to_dominate_their_counterexample():
    game = cert.game_lp(TWO_POLICIES.M - 0.4)
    np.testing.assert_allclose(game.mixture, [0.5, 0.5], atol=1e-9)
    assert game.value == pytest.approx(-0.1)


def test_iteration_bounds_match_their_closed_form():
    assert cert.iteration_bound(5, 0.1, "cg") == pytest.approx(20.9, abs=0.1)
    assert cert.iteration_bound(5, 0.1, "mvie") == pytest.approx(56.2, abs=0.1)
    with pytest.raises(InvalidInputError, match="no iteration bound"):
        cert.iteration_bound(5, 0.1, "ac")


def test_bad_rows_are_named():
    with pytest.raises(InvalidInputError, match="shape"):
        cert.game_lp(np.zeros(3))
