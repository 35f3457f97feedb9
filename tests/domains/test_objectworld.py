import numpy as np
import pytest

from walking_irl.domains.mdp.objectworld import MOVES, Objectworld
from walking_irl.domains.mdp.random_mdp import RandomMDP
from walking_irl.errors import InvalidInputError
from walking_irl.rl.tabular import loss


@pytest.mark.parametrize("seed", range(3))
def test_rewards_follow_from_the_objects_cell_by_cell(seed):
    world = Objectworld(16, seed=seed)
    cells, _, outer = world.objects
    places = [divmod(c, 16) for c in cells]

    def distance(state, colour):
        y, x = divmod(state, 16)
        return min(
            np.hypot(y - v, x - u) for (v, u), o in zip(places, outer, strict=True) if o == colour
        )

    for s in range(256):
        expected = 0.0
        if distance(s, 0) <= 3:
            expected = 5.0 if distance(s, 1) <= 2 else -10.0
        assert world.reward[s] == expected
    assert set(world.reward) == {5.0, -10.0, 0.0}


def test_every_colour_occurs_and_another_seed_is_another_world():
    worlds = [Objectworld(16, colours=3, seed=s) for s in range(5)]
    for world in worlds:
        for colour in (world.objects.inner, world.objects.outer):
            assert set(colour) == {0, 1, 2}
        assert world.distances.shape == (256, 6)
        np.testing.assert_array_equal(world.distances[world.objects.cells].min(axis=1), 0.0)
    assert len({w.reward.tobytes() for w in worlds}) == 5
    np.testing.assert_array_equal(Objectworld(16, colours=3, seed=4).reward, worlds[4].reward)


def test_binary_features_say_whether_a_distance_is_below_each_number_of_cells():
    smooth, steps = Objectworld(16), Objectworld(16, features="binary")
    assert smooth.mdp.Phi.shape == (256, 4)
    assert steps.mdp.Phi.shape == (256, 60)
    counted = steps.mdp.Phi.reshape(256, 4, 15).sum(axis=2)  # thresholds above the distance
    expected = np.clip(15 - np.floor(16 * smooth.mdp.Phi + 1e-9), 0, 15)
    np.testing.assert_array_equal(counted, expected)
    assert len(steps.objectives) == 60


def test_a_move_that_is_not_obeyed_is_one_of_the_other_four():
    world = Objectworld(16, success=0.7)
    inner = 5 * 16 + 5
    for action, (dr, dc) in enumerate(MOVES):
        row = world.mdp.T[[action * 256 + inner]].toarray()[0]
        assert row[(5 + dr) * 16 + 5 + dc] == pytest.approx(0.7)
        assert sorted(row[row > 0]) == pytest.approx([0.075] * 4 + [0.7])


def test_picture_shows_where_a_policy_goes_and_the_reward():
    world = Objectworld(8, density=0.1)
    picture = world.picture(world.forward(np.full(4, 0.25)).policy)
    assert picture.arrows.shape == (8, 8, 2)
    assert picture.visits.sum() == pytest.approx(10.0)
    np.testing.assert_array_equal(picture.reward.ravel(), world.reward)


def test_random_mdp_branches_as_stated():
    world = RandomMDP(30, 3, 4, branching=6, seed=5)
    rows = world.mdp.T.toarray()
    assert rows.shape == (90, 30)
    np.testing.assert_array_equal((rows > 0).sum(axis=1), 6)
    assert world.mdp.Phi.min() >= 0
    assert world.mdp.Phi.max() <= 1
    assert np.abs(rows - RandomMDP(30, 3, 4, branching=6, seed=6).mdp.T.toarray()).max() > 0


def test_own_experts_are_the_best_and_a_soft_one_that_loses_a_little():
    losses = []
    for seed in range(5):
        world = Objectworld(16, seed=seed)
        assert loss(world.mdp, world.reward, world.own_policy()) == pytest.approx(0.0, abs=1e-9)
        soft, cold = world.own_policy(1.0), world.own_policy(0.1)
        losses.append(loss(world.mdp, world.reward, soft))
        assert 0 < loss(world.mdp, world.reward, cold) < losses[-1]
    assert np.mean(losses) == pytest.approx(0.1, abs=0.05)  # worlds differ by as much
    with pytest.raises(InvalidInputError, match="temperature"):
        world.own_policy(-1.0)


@pytest.mark.parametrize("make", [Objectworld, RandomMDP])
def test_suboptimal_experts_are_soft(make):
    world, rng = make(), np.random.default_rng(0)
    w = rng.dirichlet(np.ones(len(world.objectives)))
    expert = world.suboptimal_expert(w, rng)
    policy = expert.demonstration
    assert policy.min() > 0
    np.testing.assert_allclose(policy.sum(axis=1), 1.0)
    np.testing.assert_allclose(world.mdp.feature_expectations(policy), expert.mu)
    assert 0.01 < loss(world.mdp, world.mdp.reward(w), policy) < 0.4
    np.testing.assert_array_equal(world.unpack(world.pack(policy)), policy)


@pytest.mark.parametrize(
    ("make", "options", "message"),
    [
        (Objectworld, {"size": 4}, r"size must lie in \[8, 64\], got 4"),
        (Objectworld, {"density": 0.0}, "density and success"),
        (Objectworld, {"success": 1.5}, "density and success"),
        (Objectworld, {"colours": 1}, "at least 2 colours"),
        (Objectworld, {"features": "smells"}, "choose from continuous, binary"),
        (Objectworld, {"size": 8, "density": 0.01, "colours": 8}, "raise the density"),
        (RandomMDP, {"n_states": 1}, "2 to 5000 states"),
        (RandomMDP, {"branching": 51}, r"branching must lie in \[1, 50\], got 51"),
        (RandomMDP, {"discount": 1.0}, "discount must lie"),
    ],
)
def test_bad_options_are_named(make, options, message):
    with pytest.raises(InvalidInputError, match=message):
        make(**options)
