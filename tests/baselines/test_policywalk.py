import numpy as np
import pytest
from problems import random_menu
from small_mdps import random_mdp

from walking_irl.baselines.archive import archive_maxent, archive_posterior
from walking_irl.baselines.policywalk import Posterior, effective_sample_sizes, policywalk
from walking_irl.errors import InvalidInputError
from walking_irl.geometry.game import game_lp
from walking_irl.rl.demonstrations import demonstrate
from walking_irl.rl.soft import boltzmann


def seen(rng, S=20, A=3, K=2, n=5, H=10, w=None):
    mdp = random_mdp(rng, S=S, A=A, K=K)
    w = rng.dirichlet(np.ones(K)) if w is None else w
    D = demonstrate(mdp, boltzmann(mdp, mdp.Phi @ w, 10.0), n, H, rng=rng)
    return mdp, D, w


def test_chain_has_the_posterior_that_enumeration_gives():
    rng = np.random.default_rng(0)
    mdp, D, _ = seen(rng)
    posterior = Posterior(mdp, D.counts(20, 3), 10.0)
    grid = np.arange(21) / 20
    log = np.array([posterior.at(np.array([g, 1 - g])).log_posterior for g in grid])
    exact = np.exp(log - log.max())
    exact /= exact.sum()
    found = policywalk(mdp, D, rng=rng, space="simplex", n_samples=40_000, burn_in=1000)
    share = np.bincount(np.round(20 * found.samples[:, 0]).astype(int), minlength=21) / 40_000
    assert 0.5 * np.abs(share - exact).sum() <= 0.02
    assert found.info["solves"] <= 21  # the memo: one solve a point of the grid at most
    assert found.w[0] == pytest.approx(grid @ exact, abs=0.01)


def test_a_neighbours_posterior_needs_no_solve_while_the_policy_stays_greedy():
    rng = np.random.default_rng(1)
    mdp, D, w = seen(rng, K=4)
    posterior = Posterior(mdp, D.counts(20, 3), 10.0)
    place = posterior.at(w)
    for other in (w + 1e-6 * rng.standard_normal(4), rng.dirichlet(np.ones(4))):
        fresh = Posterior(mdp, D.counts(20, 3), 10.0).at(other)
        near = posterior.at(other, place)
        assert near.log_posterior == pytest.approx(fresh.log_posterior, abs=1e-7)
    assert posterior.n_solves == 2  # the first, and the distant one


def test_proposals_that_leave_are_rejected():
    rng = np.random.default_rng(2)
    mdp, D, _ = seen(rng, K=3, n=1, H=1)  # a flat posterior: the walk reaches the border
    box = policywalk(mdp, D, rng=rng, alpha=1e-6, bound=1.0, n_samples=4000)
    assert np.abs(box.samples).max() == 1.0
    shares = [np.mean(np.isclose(box.samples[:, 0], v)) for v in (-1, -0.5, 0, 0.5, 1)]
    np.testing.assert_allclose(shares, 0.2, atol=0.06)  # clipping would fill the border
    simplex = policywalk(mdp, D, rng=rng, space="simplex", alpha=1e-6, n_samples=2000)
    assert simplex.samples.min() >= 0
    np.testing.assert_allclose(simplex.samples.sum(axis=1), 1.0)


def test_a_chain_that_starts_elsewhere_agrees():
    rng = np.random.default_rng(3)
    mdp, D, _ = seen(rng, K=3)
    ends = []
    for w in np.eye(3)[:2]:
        found = policywalk(mdp, D, rng=rng, space="simplex", n_samples=20_000, w=w)
        size = found.info["effective_sample_size"]
        ends.append((found.w, found.samples.std(axis=0) / np.sqrt(size)))
    gap = np.abs(ends[0][0] - ends[1][0])
    assert (gap <= 3 * np.hypot(ends[0][1], ends[1][1])).all()


@pytest.mark.slow
def test_intervals_hold_the_weights_as_often_as_they_say():
    inside, ranks = [], []
    for seed in range(60):
        rng = np.random.default_rng([seed, 7])
        mdp, D, w = seen(rng, K=3, n=5, H=10)
        found = policywalk(mdp, D, rng=rng, space="simplex", n_samples=2000, burn_in=400)
        low, high = np.quantile(found.samples, [0.05, 0.95], axis=0)
        inside.append((low - 0.025 <= w) & (w <= high + 0.025))  # half a step of the grid
        ranks.append((found.samples < w).mean(axis=0))
    share = np.mean(inside)  # 180 weights, three of a run correlated: s.d. about .03
    assert 0.9 - 0.1 <= share
    assert 0.5 - 0.1 <= np.mean(ranks) <= 0.5 + 0.1


def test_effective_sample_size_of_an_autoregression_is_the_known_one():
    rng = np.random.default_rng(4)
    rho, n = 0.8, 50_000
    x = np.zeros(n)
    noise = rng.standard_normal(n)
    for t in range(1, n):
        x[t] = rho * x[t - 1] + noise[t]
    sizes = effective_sample_sizes(np.c_[x, noise, np.ones(n)])
    assert sizes[0] == pytest.approx(n * (1 - rho) / (1 + rho), rel=0.15)
    assert sizes[1] == pytest.approx(n, rel=0.15)
    assert sizes[2] == n


def test_archive_posterior_is_the_exact_one_for_two_weights():
    menu = random_menu(np.random.default_rng(5), 2, n=30)
    mu_E = menu.expert(np.array([0.3, 0.7])).mu
    found = archive_posterior(
        menu.M, mu_E, rng=np.random.default_rng(0), sharpness=100.0, n_samples=40_000
    )
    grid = np.linspace(0, 1, 4001)
    f = np.maximum(((menu.M - mu_E) @ np.c_[grid, 1 - grid].T).max(axis=0), 0)
    p = np.exp(-100.0 / np.abs(mu_E).mean() * f)
    p /= p.sum()
    mean, deviation = grid @ p, np.sqrt(grid**2 @ p - (grid @ p) ** 2)
    error = deviation / np.sqrt(found.info["effective_sample_size"][0])
    assert abs(found.w[0] - mean) <= 4 * error
    assert found.samples[:, 0].std() == pytest.approx(deviation, rel=0.1)


def test_a_sharp_archive_posterior_lies_in_the_polyhedron_around_the_weights():
    rng = np.random.default_rng(6)
    menu, w_E = random_menu(rng, 3, n=400), np.array([0.2, 0.5, 0.3])
    expert = menu.expert(w_E)
    found = archive_posterior(menu.M, expert.mu, rng=rng, sharpness=1e5)
    low, high = found.info["intervals"].T
    assert (low - 1e-9 <= w_E).all() and (w_E <= high + 1e-9).all()
    regret = ((menu.M - expert.mu) @ found.samples.T).max(axis=0)
    assert np.median(regret) <= 1e-4 * np.abs(expert.mu).mean()


def test_archive_maxent_becomes_kelleys_query_as_it_cools():
    rng = np.random.default_rng(7)
    menu = random_menu(rng, 3, n=40)
    mu_E = 1.001 * menu.expert(np.array([0.2, 0.5, 0.3])).mu
    D = menu.M - mu_E
    best = -game_lp(D).value
    gaps = []
    for temperature in (1.0, 1e-1, 1e-2, 1e-3):
        w = archive_maxent(menu.M, mu_E, temperature=temperature).w
        gaps.append((D @ w).max() - best)
        bound = temperature * np.abs(mu_E).mean() * np.log(len(D))
        assert -1e-9 <= gaps[-1] <= bound
    assert gaps[-1] < 0.1 * gaps[0]


def test_bad_settings_are_named():
    rng = np.random.default_rng(8)
    mdp, D, _ = seen(rng)
    for options, message in (
        ({"space": "ball"}, "unknown space"),
        ({"alpha": -1.0}, "alpha"),
        ({"w": np.array([0.3, 0.3])}, "on its grid"),
        ({"w": np.array([11.0, 0.0])}, "on its grid"),
    ):
        with pytest.raises(InvalidInputError, match=message):
            policywalk(mdp, D, rng=rng, **options)
    with pytest.raises(InvalidInputError, match="archive needs"):
        archive_posterior(np.ones((3, 2)), np.ones(3), rng=rng)
    with pytest.raises(InvalidInputError, match="finite"):
        archive_maxent(np.full((3, 2), np.nan), np.ones(2))
