import numpy as np
import pytest

from walking_irl.baselines.inverse_optimal_control import (
    Fit,
    bilevel_gauss_newton,
    bilevel_search,
    kkt_residual,
)
from walking_irl.errors import InvalidInputError
from walking_irl.types import Status

W_E = np.array([0.5, 0.2, 0.3])


class Quadratic:
    """Costs (x - c_j)' A_j (x - c_j) / 2 under B x = b: optimal x and its slope in closed form."""

    def __init__(self, seed=0, n=12, K=3, m=4):
        rng = np.random.default_rng(seed)
        L = rng.standard_normal((K, n, n))
        self.A = L @ L.transpose(0, 2, 1) + np.eye(n)
        self.c = rng.standard_normal((K, n))
        self.B, self.b = rng.standard_normal((m, n)), rng.standard_normal(m)
        self.n_solves = 0

    def gradients(self, x):
        return np.einsum("jab,jb->aj", self.A, x - self.c)

    def optimal(self, w):
        H = np.einsum("j,jab->ab", w, self.A)
        m = len(self.b)
        self.kkt = np.block([[H, self.B.T], [self.B, np.zeros((m, m))]])
        g = np.einsum("j,jab,jb->a", w, self.A, self.c)
        return np.linalg.solve(self.kkt, np.r_[g, self.b])[: len(H)]

    def slope(self, w):
        x = self.optimal(w)
        rows = np.vstack([-self.gradients(x), np.zeros((len(self.b), len(w)))])
        return np.linalg.solve(self.kkt, rows)[: len(x)]

    def near(self, shown):
        def solve(w):
            self.n_solves += 1
            x = self.optimal(w)
            return Fit(shown - x, lambda: self.slope(w), policy=x)

        return solve


@pytest.mark.parametrize("has_constraints", [True, False])
def test_kkt_residual_is_exact_for_an_optimal_movement(has_constraints):
    problem = Quadratic(m=4 if has_constraints else 0)
    x = problem.optimal(W_E)
    found = kkt_residual(problem.gradients(x), problem.B if has_constraints else None)
    np.testing.assert_allclose(found.w, W_E, atol=1e-9)
    assert found.info["residual"] <= 1e-9
    assert found.info["solves"] == 0


def test_multipliers_are_those_of_the_least_squares_problem():
    """For weights that are given, the residual is that of the best multipliers; oracle: lstsq."""
    problem = Quadratic(1)
    G = problem.gradients(np.zeros(12))
    found = kkt_residual(G, problem.B)

    def left(w):
        return np.linalg.norm(G @ w + problem.B.T @ np.linalg.lstsq(problem.B.T, -G @ w)[0])

    for w in np.random.default_rng(0).dirichlet(np.ones(3), 200):
        assert left(found.w) <= left(w) + 1e-9


def test_constraints_that_say_the_same_twice_are_no_harm():
    problem = Quadratic()
    x = problem.optimal(W_E)
    found = kkt_residual(problem.gradients(x), np.vstack([problem.B, 2 * problem.B]))
    np.testing.assert_allclose(found.w, W_E, atol=1e-9)


def test_gauss_newton_finds_the_weights_of_an_optimal_movement_in_a_few_solves():
    problem = Quadratic()
    found = bilevel_gauss_newton(problem.near(problem.optimal(W_E)), 3, tol=1e-7)
    np.testing.assert_allclose(found.w, W_E, atol=1e-7)
    assert found.status is Status.CONVERGED
    assert found.info["solves"] == problem.n_solves <= 10
    assert (np.diff(found.objective) <= 0).all()


def test_the_search_finds_them_with_many_more_solves_and_less_accurately():
    problem = Quadratic()
    found = bilevel_search(problem.near(problem.optimal(W_E)), 3, max_solves=100)
    np.testing.assert_allclose(found.w, W_E, atol=0.02)  # its last radius is .01 of log w
    assert 15 <= found.info["solves"] == problem.n_solves <= 100


def test_angles_average_noise_where_gradients_magnify_it():
    """Stiff directions: the gradient of 1e-3 of noise is larger than all there is to see."""
    problem, errors = Quadratic(2), {"kkt": [], "bilevel": []}
    problem.A[:] += 1e4 * np.outer(np.eye(12)[0], np.eye(12)[0])
    problem.B[:, 0] = 0.0
    shown = problem.optimal(W_E)
    rng = np.random.default_rng(0)
    for _ in range(5):
        x = shown + 1e-3 * rng.standard_normal(12)
        w = kkt_residual(problem.gradients(x), problem.B).w
        errors["kkt"].append(np.abs(w - W_E).sum())
        w = bilevel_gauss_newton(problem.near(x), 3).w
        errors["bilevel"].append(np.abs(w - W_E).sum())
    assert np.mean(errors["bilevel"]) <= 0.5 * np.mean(errors["kkt"])


def test_a_movement_of_no_weights_gives_the_nearest_on_the_border():
    """Oracle: no weights of a fine grid come nearer."""
    problem = Quadratic(3)
    shown = problem.optimal(np.array([1.6, -0.3, -0.3]))
    found = bilevel_gauss_newton(problem.near(shown), 3, min_weight=0.0)
    grid = [
        np.array([a, b, 1 - a - b])
        for a in np.linspace(0, 1, 21)
        for b in np.linspace(0, 1 - a, 21)
    ]
    best = min(np.sqrt(np.mean((shown - problem.optimal(w)) ** 2)) for w in grid)
    assert found.info["distance"] <= best + 1e-6
    assert found.w.min() >= -1e-12


def test_a_false_slope_ends_in_a_stall_and_not_in_a_worse_answer():
    problem = Quadratic()
    shown = problem.optimal(W_E)

    def solve(w):
        return Fit(shown - problem.optimal(w), lambda: -problem.slope(w))

    found = bilevel_gauss_newton(solve, 3)
    assert found.status is Status.STALLED
    assert found.objective[-1] <= found.objective[0]


def test_budgets_are_kept():
    problem = Quadratic()
    for method in (bilevel_gauss_newton, bilevel_search):
        before = problem.n_solves
        found = method(problem.near(problem.optimal(W_E)), 3, max_solves=3)
        assert problem.n_solves - before <= 3
        assert found.status is Status.BUDGET


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: kkt_residual(np.ones((4, 2)), np.ones((1, 3))), r"shape \(m, 4\), got \(1, 3\)"),
        (lambda: kkt_residual(np.full((4, 2), np.nan)), "finite"),
        (lambda: bilevel_search(None, 3, min_weight=0.4), "min_weight"),
        (lambda: bilevel_gauss_newton(None, 3, max_solves=0), "max_solves"),
    ],
)
def test_bad_input_is_refused_in_a_sentence(call, sentence):
    with pytest.raises(InvalidInputError, match=sentence):
        call()
