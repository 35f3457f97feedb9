import numpy as np
import pytest

from walking_irl.cpirl.loop import cpirl
from walking_irl.domains.mdp.gridworld import MOVES, Gridworld
from walking_irl.errors import InvalidInputError


def test_macro_features_sum_to_a_constant_so_uniform_weights_explain_every_expert():
    world = Gridworld(8, 2, "macro")
    rng = np.random.default_rng(0)
    uniform = np.full(4, 0.25)
    for w in rng.dirichlet(np.ones(4), 5):
        mu = world.forward(w).mu
        assert mu.sum() == pytest.approx(10.0)
        assert world.forward(uniform).mu @ uniform == pytest.approx(mu @ uniform)


def test_patches_do_not_sum_to_a_constant():
    world = Gridworld(16, 4)
    sums = [world.forward(w).mu.sum() for w in np.eye(16)[:4]]
    assert np.ptp(sums) > 0.05


@pytest.mark.parametrize(("size", "cells"), [(8, 2), (16, 3), (16, 4), (64, 8)])
def test_regions_cover_all_objectives(size, cells):
    for variant in ("patches", "macro"):
        labels = Gridworld(size, cells, variant).regions
        assert set(labels.ravel()) - {-1} == set(range(cells**2))


def test_actions_are_obeyed_with_the_stated_probability_and_walls_hold():
    world = Gridworld(8, 2, success=0.7)
    S = 64
    inner = 3 * 8 + 3
    for action, (dr, dc) in enumerate(MOVES):
        row = world.mdp.T[[action * S + inner]].toarray()[0]
        assert row[(3 + dr) * 8 + 3 + dc] == pytest.approx(0.775)
        assert np.count_nonzero(row) == 4
    corner = world.mdp.T[[1 * S + 0]].toarray()[0]  # left in the top left corner
    assert corner[0] == pytest.approx(0.7 + 2 * 0.075)


def test_picture_points_towards_the_rewarded_region():
    world = Gridworld(8, 2)
    w = np.array([0.0, 0.0, 0.0, 1.0])
    picture = world.picture(world.forward(w).policy)
    assert picture.arrows.shape == (8, 8, 2)
    np.testing.assert_array_equal(np.abs(picture.arrows).sum(axis=2), 1.0)
    assert picture.visits.sum() == pytest.approx(10.0)
    assert picture.visits[picture.regions == 3].mean() > 3 * picture.visits.mean()
    assert picture.arrows[0, 0].sum() == 1.0  # down or right, towards the last region


def test_analytic_centre_needs_few_solves_on_16_regions():
    world = Gridworld(16, 4)
    solves = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        w_E = world.random_weights("sparse", rng)
        expert = world.expert(w_E, rng)
        for it in cpirl(world.forward, expert, rng=rng):
            assert (it.response.mu - expert.mu) @ w_E <= 1e-9
            if w_E @ it.response.mu >= 0.99 * w_E @ expert.mu:
                break
        else:
            pytest.fail(f"seed {seed} never came within 1 % ({it.status})")
        solves.append(it.k + 1)
    assert np.mean(solves) <= 8


def test_sparse_weights_exist_with_at_least_two_non_zeros():
    world = Gridworld(16, 4)
    for seed in range(20):
        w = world.random_weights("sparse", np.random.default_rng(seed))
        assert w.sum() == pytest.approx(1.0)
        assert 2 <= np.count_nonzero(w) <= 15


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"size": 4}, r"grid size must lie in \[8, 64\], got 4"),
        ({"size": 128}, "got 128"),
        ({"cells": 1}, "2 to 5 macro-cells"),
        ({"size": 16, "cells": 6}, "2 to 5 macro-cells"),
        ({"variant": "hexagons"}, "choose from patches, macro"),
        ({"success": 0.0}, "success must lie"),
        ({"discount": 1.0}, "discount must lie"),
        ({"method": "guess"}, "choose from policy-iteration"),
    ],
)
def test_bad_options_are_named(options, message):
    with pytest.raises(InvalidInputError, match=message):
        Gridworld(**options)
