"""Realism metrics measure what they say, and the shipped gaits look like walking."""

import dataclasses

import numpy as np
import pytest

from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.gait.library import load_gaits
from walking_irl.domains.humanoid.gait.norms import GROUPS, LATERAL, Band
from walking_irl.domains.humanoid.gait.realism import (
    figures,
    gait_cycle,
    group_scores,
    metrics,
    score,
)
from walking_irl.errors import InvalidInputError

WALKER = load_walker()
REFERENCE = load_gaits()["reference"]
ALL_METRICS = {m for bands in GROUPS.values() for m in bands}


def test_bands_are_ordered():
    for bands in GROUPS.values():
        for name, b in bands.items():
            assert b.zero_low < b.low < b.high < b.zero_high, name


def test_score_falls_linearly_outside_the_band():
    band = Band(10, 20, 0, 40, "deg")
    values = [-5, 0, 5, 10, 15, 20, 30, 40, 50]
    assert [band.score(v) for v in values] == [0, 0, 0.5, 1, 1, 1, 0.5, 0, 0]


def test_reference_gait_walks_like_a_person():
    """It scores .982; .97 leaves room for another solve of the same gait."""
    assert score(metrics(gait_cycle(WALKER, REFERENCE))) > 0.97


def test_reference_outscores_a_gait_with_frozen_arms_and_stiff_knees():
    q = REFERENCE.q.copy()
    for joint in ("shoulder_r", "shoulder_l"):
        q[:, WALKER.joints.index(joint)] *= 0.1
    for joint in ("knee_r", "knee_l"):
        q[:, WALKER.joints.index(joint)] *= 0.7
    human = group_scores(metrics(gait_cycle(WALKER, REFERENCE)))
    stiff = group_scores(metrics(gait_cycle(WALKER, dataclasses.replace(REFERENCE, q=q))))
    assert stiff["arms"] < human["arms"] and stiff["knee"] < human["knee"]


def test_metrics_cover_the_bands_and_nothing_else():
    assert set(metrics(gait_cycle(WALKER, REFERENCE))) == ALL_METRICS
    planar = gait_cycle(load_walker("humanoid-planar"), load_gaits("humanoid-planar")["reference"])
    assert set(metrics(planar)) == ALL_METRICS - set(LATERAL)


def test_metrics_do_not_depend_on_which_side_steps_first():
    """The same walk, half a cycle later: its recording starts with the other foot."""
    mirror = WALKER.mirror
    q = REFERENCE.q @ mirror.T
    other = Gait(q, REFERENCE.step_length, REFERENCE.half_period)
    here, there = (metrics(gait_cycle(WALKER, g)) for g in (REFERENCE, other))
    for name in ALL_METRICS:
        assert there[name] == pytest.approx(here[name], rel=1e-6, abs=1e-9), name


def test_cycle_starts_with_initial_contact_and_moves_on_steadily():
    cycle = gait_cycle(WALKER, REFERENCE)
    assert cycle.force[0, 0] > 0.03 and cycle.force[-1, 0] <= 0.03
    assert (cycle.force[: cycle.n_stance, 0] > 0.03).all()
    np.testing.assert_array_less(0, np.diff(cycle.q[:, 0]))
    assert np.diff(cycle.sensor("com")[:, 0]).max() < 3 * REFERENCE.speed * REFERENCE.timestep


def test_mean_vertical_force_is_the_weight():
    """Momentum is periodic, so the ground carries one body weight on average."""
    cycle = gait_cycle(WALKER, REFERENCE)
    assert cycle.force.sum(1).mean() == pytest.approx(1.0, abs=0.01)


def test_figures_agree_with_the_gait_and_are_plain_numbers():
    import json

    told = json.loads(json.dumps(figures(WALKER, REFERENCE)))
    assert told["speed"] == pytest.approx(REFERENCE.step_length / REFERENCE.half_period)
    assert told["cadence"] * told["step_length"] / 60 == pytest.approx(told["speed"])
    assert told["max_root_residual"] < 1e-3
    assert set(told["joint_ranges"]) == set(WALKER.joints[6:])
    assert told["realism"] == pytest.approx(np.mean(list(told["groups"].values())))
    low, high = told["joint_ranges"]["knee_r"]
    assert -5 < low < high < 90
    assert told["cost_of_transport"] > told["metrics"]["positive_work"] / 9.81


def test_gait_without_ground_contact_is_refused():
    q = REFERENCE.q.copy()
    q[:, WALKER.joints.index("root_z")] += 1.0
    with pytest.raises(InvalidInputError, match="never touches down"):
        gait_cycle(WALKER, dataclasses.replace(REFERENCE, q=q))
