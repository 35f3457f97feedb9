"""Newton steps within the weights' bounds, and CPIRL with sensitivities that tell little."""

from dataclasses import replace

import numpy as np
import pytest
from problems import without_sensitivity
from scipy.optimize import minimize

from walking_irl.cpirl.bundle import Bundle
from walking_irl.cpirl.loop import cpirl
from walking_irl.cpirl.newton_phase import _above_unexplained
from walking_irl.cpirl.regret_model import extremes, newton_step
from walking_irl.domains.lqr import LQR
from walking_irl.errors import InvalidInputError
from walking_irl.geometry.plane import plane_basis
from walking_irl.types import Expert, Response, Status


def random_model(rng, K, condition):
    Q, _ = np.linalg.qr(rng.standard_normal((K - 1, K - 1)))
    return (Q * np.geomspace(1.0, 1.0 / condition, K - 1)) @ Q.T


def slsqp(w, gradient, B, low):
    U = plane_basis(len(w))

    def model(v):
        z = U.T @ (v - w)
        return gradient @ (v - w) + 0.5 * z @ B @ z

    found = minimize(
        model, w, bounds=[(low, 1)] * len(w),
        constraints={"type": "eq", "fun": lambda v: v.sum() - 1},
        method="SLSQP", options={"ftol": 1e-14, "maxiter": 500},
    )  # fmt: skip
    return found.x, -found.fun


@pytest.mark.parametrize("size", [0.01, 1.0, 1e4, 1e9])
@pytest.mark.parametrize("condition", [1.0, 1e3, 1e9])
@pytest.mark.parametrize("K", [2, 3, 6])
def test_step_is_the_bounded_minimum_however_flat_the_model(K, condition, size):
    rng = np.random.default_rng(K)
    for low in (0.0, 0.5 / K):
        w = low + (1 - K * low) * rng.dirichlet(np.ones(K))
        B = random_model(rng, K, condition)
        gradient = size * rng.standard_normal(K)
        step = newton_step(w, gradient, B, low)
        assert step.w.min() >= low - 1e-15 and step.w.sum() == pytest.approx(1)
        assert step.decrease >= 0.0
        if condition < 1e6 and size <= 1.0:  # beyond, SLSQP leaves the simplex
            assert step.decrease >= slsqp(w, gradient, B, low)[1] * (1 - 1e-6) - 1e-12
        # Optimality: no exchange between two weights helps, unless a bound forbids it.
        g = gradient + plane_basis(K) @ B @ plane_basis(K).T @ (step.w - w)
        above = step.w > low + 1e-9
        assert g[above].max() - g.min() <= 1e-7 * max(size, 1.0)


def partly_smooth(w):
    """Two weights trade along a smooth front, two choose from a menu: a singular sensitivity."""
    menu = np.array([[0.0, -1.0], [-0.2, -0.6], [-0.6, -0.2], [-1.0, 0.0]])
    s = max(w[0] + w[1], 1e-9)
    a = w[0] / s
    x = 2 * a - 1  # maximises -(w_0 (x - 1)^2 + w_1 (x + 1)^2)
    S = np.zeros((4, 4))
    S[:2, :2] = np.outer([-2 * (x - 1), -2 * (x + 1)], 2 * np.array([1 - a, -a]) / s)
    mu = np.r_[-((x - 1) ** 2), -((x + 1) ** 2), menu[np.argmax(menu @ w[2:])]]
    return Response(None, mu, 0.5 * (S + S.T))


@pytest.mark.parametrize("seed", range(8))
def test_singular_sensitivities_do_not_lead_the_estimate_astray(seed):
    rng = np.random.default_rng(seed)
    expert = Expert(partly_smooth(rng.dirichlet(np.ones(4))).mu, np.zeros(4))
    last = list(cpirl(partly_smooth, expert, rng=rng))[-1]
    v = last.estimate
    assert last.status in (Status.MATCHED, Status.CONVERGED)
    assert v @ (partly_smooth(v).mu - expert.mu) <= 1e-5 * (v @ np.abs(expert.mu))
    lower, upper = last.intervals.T
    assert np.all((lower <= v + 1e-6) & (v <= upper + 1e-6))


@pytest.mark.parametrize("value", [np.nan, 0.0])
def test_sensitivities_that_say_nothing_are_ignored(value):
    rng = np.random.default_rng(0)
    problem = LQR(3)
    expert = problem.expert(np.array([0.2, 0.3, 0.5]), rng)
    run = list(
        cpirl(
            lambda w: replace(problem.forward(w), sensitivity=np.full((3, 3), value)),
            expert,
            rng=rng,
            max_solves=8,
        )
    )
    plain = list(cpirl(without_sensitivity(problem), expert, rng=rng, max_solves=8))
    np.testing.assert_array_equal([i.w for i in run], [i.w for i in plain])
    assert all(i.response.sensitivity is None for i in run)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"sensitivity": np.eye(2)}, r"sensitivity must have shape \(3, 3\), got \(2, 2\)"),
        ({"evaluated": np.ones(3)}, r"evaluated policies must have shape \(n, 3\), got \(3,\)"),
    ],
)
def test_answers_of_the_wrong_shape_are_named(change, sentence):
    problem, rng = LQR(3), np.random.default_rng(0)
    expert = problem.expert(np.full(3, 1 / 3), rng)
    with pytest.raises(InvalidInputError, match=sentence):
        next(cpirl(lambda w: replace(problem.forward(w), **change), expert, rng=rng))


def test_probes_at_a_bound_ask_for_other_weights():
    B = random_model(np.random.default_rng(0), 3, 4.0)
    w = np.array([0.6, 0.4, 0.0])
    asked = extremes(w, B, 0.01, 0.0)
    assert np.abs(asked - w).sum(axis=1).min() > 0.01
    assert asked.min() >= 0.0
    np.testing.assert_allclose(asked.sum(axis=1), 1.0)


def test_a_defect_that_no_weights_explain_keeps_nobody_from_the_minimum():
    """Whatever the features' sizes: here the heavy weight is on the small one."""
    w, mu, defect = np.array([0.9, 0.1]), np.array([-1.0, -30.0]), 0.4
    noise = np.full(2, 1e-3)
    expert = Expert(mu - defect, noise, covariance=np.diag(noise**2), n_samples=20)
    bundle = Bundle.of(expert).add(w, Response(None, mu))
    assert bundle.relative_regrets[0] > 0.09, "far from optimal, as it seems"
    assert _above_unexplained(bundle) == pytest.approx(0.0, abs=1e-9)
