"""Normative curves are whole and in our signs; a gait is held against them at its own speed."""

import numpy as np
import pytest

from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.body.physics import passive_forces
from walking_irl.domains.humanoid.gait.curves import (
    ANGLES,
    MOMENTS,
    beside,
    gait_curves,
    likeness,
    shares,
)
from walking_irl.domains.humanoid.gait.library import load_gaits
from walking_irl.domains.humanoid.gait.norm_curves import SETS, norm_set
from walking_irl.domains.humanoid.gait.realism import figures, gait_cycle, leg_length
from walking_irl.errors import InvalidInputError

WALKER = load_walker()
GAIT = load_gaits()["reference"]
LEG = leg_length(WALKER)


@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize("speed", [0.0, 0.6, 1.0, 1.3, 1.7, 2.5])
def test_every_set_has_every_curve_at_every_speed(name, speed):
    norms = norm_set(name, speed, LEG)
    assert set(ANGLES) | set(MOMENTS) <= set(norms.curves)
    for curve in norms.curves.values():
        assert curve.mean.shape == curve.sd.shape == (101,)
        assert np.isfinite(curve.mean).all() and (curve.sd > 0).all()


@pytest.mark.parametrize("name", SETS)
def test_norms_have_the_signs_that_walking_has(name):
    """What every textbook curve shows, whoever measured it."""
    c = {n: k.mean for n, k in norm_set(name, 1.2, LEG).curves.items()}
    assert c["hip_flexion"][0] > 20 > 0 > c["hip_flexion"][50] - 5
    assert c["knee_flexion"].argmax() in range(65, 80) and c["knee_flexion"].max() > 50
    assert c["ankle_dorsiflexion"].argmin() in range(55, 72)
    assert c["ankle_plantarflexion_moment"].argmax() in range(40, 55)
    assert 1.0 < c["ankle_plantarflexion_moment"].max() < 1.7
    assert c["hip_extension_moment"][10] > 0 > c["hip_extension_moment"][50]
    assert c["pelvis_rotation"][0] > 0 > c["pelvis_rotation"][50]


def test_faster_children_flex_their_hips_more():
    ranges = [
        np.ptp(norm_set("children", v, LEG).curves["hip_flexion"].mean) for v in (0.5, 1.2, 2)
    ]
    assert ranges[0] < ranges[1] < ranges[2]


def test_a_norm_lies_within_itself():
    norms = norm_set("adults", 1.3, LEG)
    assert set(shares({n: c.mean for n, c in norms.curves.items()}, norms).values()) == {1.0}


def test_pelvic_tilt_moves_pelvis_and_hip_together():
    """The clinic's pelvis leans forwards in standing; the thigh's direction stays."""
    curves = gait_curves(gait_cycle(WALKER, GAIT))
    norms = norm_set("adults", 1.3, LEG)
    placed = beside(curves, norms)
    moved = placed["hip_flexion"] - curves["hip_flexion"]
    np.testing.assert_allclose(moved, placed["pelvis_tilt"] - curves["pelvis_tilt"], atol=1e-9)
    assert placed["pelvis_tilt"].mean() == pytest.approx(norms.curves["pelvis_tilt"].mean.mean())


def test_net_moments_are_motor_and_passive():
    """The stiffness of a joint, by its own derivative, times the angle away from its rest."""
    cycle = gait_cycle(WALKER, GAIT)
    j = WALKER.joints.index("hip_rotation_r")
    dof = WALKER.model.jnt_dofadr[j]
    spring = WALKER.model.jnt_stiffness[j] * (cycle.q[:, j] - WALKER.model.qpos_spring[j])
    damper = WALKER.model.dof_damping[dof] * cycle.v[:, j]
    np.testing.assert_allclose(
        cycle.net_torque("hip_rotation_r"), cycle.torque("hip_rotation_r") - spring - damper
    )
    assert np.abs(passive_forces(WALKER, cycle.q, cycle.v)[:, :6]).max() == 0


def test_figures_tell_shares_of_every_set():
    told = figures(WALKER, GAIT)
    assert set(told["norms"]) == set(SETS)
    for norm in told["norms"].values():
        assert norm["mean"] == pytest.approx(np.mean(list(norm["curves"].values())))
        assert all(0 <= share <= 1 for share in norm["curves"].values())
    low, high = told["norms"]["children"]["speed_range"]
    assert low <= GAIT.speed / np.sqrt(9.81 * LEG) < high
    assert sum(told["bands"].values()) > len(told["bands"]) / 2


def test_a_stiff_knee_is_farther_from_the_norm():
    curves = gait_curves(gait_cycle(WALKER, GAIT))
    stiff = {**curves, "knee_flexion": 0.3 * curves["knee_flexion"]}
    there, here = (likeness(c, GAIT.speed, LEG)["adults"]["curves"] for c in (stiff, curves))
    assert there["knee_flexion"] < here["knee_flexion"]


def test_a_planar_walker_has_no_curves_of_the_other_planes():
    planar = load_walker("humanoid-planar")
    gait = load_gaits("humanoid-planar")["reference"]
    found = likeness(gait_curves(gait_cycle(planar, gait)), gait.speed, LEG)["adults"]["curves"]
    assert "hip_adduction" not in found and "knee_flexion" in found


def test_unknown_norms_are_refused():
    with pytest.raises(InvalidInputError, match="adults, children"):
        norm_set("robots", 1.0, LEG)
    with pytest.raises(InvalidInputError, match="speed"):
        norm_set("children", float("nan"), LEG)
