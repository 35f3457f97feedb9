import numpy as np
import pytest

from walking_irl.cpirl.loop import cpirl
from walking_irl.domains.mdp.driving import LENGTH, WIDTH, Driving

VERTICES = np.array(
    [[9.75, 4.7606, 5.0], [7.5, 5.0, 5.0], [9.75, 4.8043, 3.8864], [9.75, 4.7853, 4.5339]]
)
"""Convex coverage set from the start state (Syed's simulator)."""


@pytest.fixture(scope="module")
def world():
    return Driving()


def test_it_has_1531_states_and_three_actions(world):
    assert (world.mdp.n_states, world.mdp.n_actions, world.mdp.n_objectives) == (1531, 3, 3)
    np.testing.assert_array_equal(world.mdp.Phi[0], [0.75, 0.5, 0.5])
    assert world.mdp.Phi.min() == 0.0 and world.mdp.Phi.max() == 1.0


def test_coverage_set_has_the_four_published_vertices(world):
    rng = np.random.default_rng(0)
    edge = np.array([[0.0, 1 - s, s] for s in np.linspace(0.001, 0.1, 12)])
    W = np.vstack([rng.dirichlet(np.ones(3), 40), 0.5 * np.eye(3)[0] + 0.5 * edge])
    M = np.array([world.forward(w).mu for w in W])
    distance = np.abs(M[:, None] - VERTICES).max(axis=2)
    assert distance.min(axis=1).max() <= 1e-3  # nothing else is optimal
    assert distance.min(axis=0).max() <= 1e-3  # each one is


@pytest.mark.parametrize("centre", ["ac", "cg", "mvie", "cc"])
def test_every_centre_ends_at_the_experts_return(world, centre):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        w_E = world.random_weights("uniform", rng)
        expert = world.expert(w_E, rng)
        iterations = list(cpirl(world.forward, expert, centre=centre, rng=rng))
        assert len(iterations) <= 8
        loss = min(w_E @ (expert.mu - it.response.mu) for it in iterations[-1:])
        assert abs(loss) <= 1e-6


def test_picture_shows_the_drive_that_the_features_count(world):
    response = world.forward(np.array([0.8, 0.15, 0.05]))
    picture = world.picture(response.policy, n_steps=60)
    assert (picture.speed == 2).all()
    gap = np.abs(picture.blue - picture.red)
    crash = (gap[:, 0] < WIDTH) & (gap[:, 1] < LENGTH)
    assert 0 < crash.mean() < 0.3
    assert (np.abs(np.diff(picture.blue[:, 0])) <= 5).all()
    np.testing.assert_array_equal(picture.road, [130, 190])


def test_value_iteration_drives_alike(world):
    w = np.array([0.3, 0.4, 0.3])
    other = Driving(method="value-iteration").forward(w)
    assert w @ other.mu == pytest.approx(w @ world.forward(w).mu, abs=1e-8)
