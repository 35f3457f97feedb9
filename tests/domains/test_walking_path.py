import numpy as np
import pytest

from walking_irl.cpirl.loop import cpirl
from walking_irl.domains.path.model import costs, gradient, integrate
from walking_irl.domains.path.solver import hessian, slsqp_path, straight_start
from walking_irl.domains.path.walking_path import (
    PUBLISHED,
    SCALES,
    WalkingPath,
    published_weights,
)
from walking_irl.errors import InvalidInputError, SolverError


@pytest.fixture(scope="module")
def world():
    return WalkingPath()


def random_walk(rng, n=12):
    return np.r_[0.3 * rng.standard_normal(3 * n), 4.0], np.array([2.0, 1.0, 0.7])


def values(z, goal):
    walks = integrate(z[None])
    return np.r_[costs(walks, goal)[0], walks.end[0]]


def test_adjoint_gradient_equals_differences():
    z, goal = random_walk(np.random.default_rng(0))
    unit, h = np.eye(11), 1e-6
    J = gradient(integrate(np.repeat(z[None], 11, axis=0)), goal, unit[:, :5], unit[:, 5:])
    steps = h * np.eye(z.size)
    numeric = np.array([values(z + s, goal) - values(z - s, goal) for s in steps]).T / (2 * h)
    np.testing.assert_allclose(J, numeric, atol=2e-8)


def test_hessian_is_that_of_the_lagrangian():
    rng = np.random.default_rng(1)
    z, goal = random_walk(rng, 5)
    c, h = rng.standard_normal(11), 1e-4
    direction = rng.standard_normal(z.size)
    f = [c @ values(z + s * h * direction, goal) for s in (-1, 0, 1)]
    numeric = (f[0] - 2 * f[1] + f[2]) / h**2
    assert direction @ hessian(z, goal, c[:5], c[5:]) @ direction == pytest.approx(
        numeric, rel=1e-5
    )


def test_published_walk_has_the_reference_cost():
    world = WalkingPath([(3.0, 2.0, 90.0)], n_intervals=40)
    path = world.path(PUBLISHED, 0)
    assert PUBLISHED @ path.F == pytest.approx(8.8265, abs=1e-3)
    np.testing.assert_allclose(path.F, [5.1932, 1.1175, 0.3726, 0.3318, 0.2744], atol=1e-3)
    end = integrate(path.z[None]).end[0]
    np.testing.assert_allclose(end, [3.0, 2.0, np.pi / 2, 0, 0, 0], atol=1e-9)


def test_published_weights_in_the_scaled_space():
    np.testing.assert_allclose(published_weights(), [0.466, 0.143, 0.066, 0.012, 0.312], atol=1e-3)


def test_scales_are_the_costs_at_equal_raw_weights(world):
    w = SCALES / SCALES.sum()
    np.testing.assert_allclose(-world.forward(w).mu, 1.0, atol=0.02)


def test_sensitivity_equals_differences_of_the_solver(world):
    w, h = published_weights(), 1e-5
    H = world.forward(w).sensitivity
    np.testing.assert_allclose(H, H.T, atol=1e-12)
    np.testing.assert_allclose(H @ w, 0.0, atol=1e-7)
    assert np.linalg.eigvalsh(H)[0] > -1e-9
    for direction in (np.array([1, -1, 0, 0, 0]), np.array([0, 0, 1, 1, -2])):
        mu = [world.forward(w + s * h * direction).mu for s in (1, -1)]
        np.testing.assert_allclose(
            H @ direction, (mu[0] - mu[1]) / (2 * h), atol=2e-3
        )  # h^2 / w^2 left


def test_more_starts_find_nothing_better(world):
    rng = np.random.default_rng(2)
    for w in [published_weights(), world.random_weights("interior", rng)]:
        a = w / SCALES
        for i, path in enumerate(world.forward(w).policy):
            for _ in range(4):
                z = straight_start(world.goals[i], world.n_intervals)
                z += 0.3 * rng.standard_normal(z.size) * (z == 0)
                try:
                    other = slsqp_path(a, world.goals[i], z)
                except SolverError:
                    continue
                assert a @ path.F <= a @ other.F + 1e-6


def test_recovers_published_weights(world):
    rng = np.random.default_rng(0)
    w_E = published_weights()
    iterations = list(cpirl(world.forward, world.expert(w_E, rng), rng=rng))
    errors = [np.abs(it.estimate - w_E).max() for it in iterations]
    assert len(iterations) <= 16
    assert errors[-1] <= 0.01


def test_suboptimal_expert_is_beaten_under_its_weights(world):
    rng = np.random.default_rng(0)
    w_E = published_weights()
    expert = world.suboptimal_expert(w_E, rng)
    assert w_E @ world.forward(w_E).mu > w_E @ expert.mu + 1e-4


def test_picture_runs_from_the_origin_to_the_goal(world):
    picture = world.picture(world.forward(published_weights()).policy)
    for points, heading, time, goal in zip(
        picture.points, picture.heading, picture.time, picture.goals, strict=True
    ):
        assert len(points) == len(heading) == len(time)
        np.testing.assert_allclose(points[0], 0.0)
        np.testing.assert_allclose([*points[-1], heading[-1]], goal, atol=1e-8)


@pytest.mark.parametrize(
    ("goals", "message"),
    [
        ([(600.0, 0.0, 0.0)], "unreachable"),
        ([(0.1, 0.0, 0.0)], "unreachable"),
        ([(3.0, 2.0, 270.0)], "unreachable"),
        ([(3.0, np.nan, 0.0)], "triples of finite"),
        ([], "triples of finite"),
    ],
)
def test_unreachable_goals_are_named(goals, message):
    with pytest.raises(InvalidInputError, match=message):
        WalkingPath(goals)


def test_too_few_intervals_are_refused():
    with pytest.raises(InvalidInputError, match="n_intervals"):
        WalkingPath(n_intervals=2)
