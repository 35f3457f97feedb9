"""Bodies and their motion: poses, ground reaction forces, repeated cycles."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import rerun as rr
from recordings import (
    CYCLE,
    MJCF,
    STRIDE,
    walk,
)

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.gait.gait import Gait, cycle_motion
from walking_irl.errors import InvalidInputError
from walking_irl.files import model_path
from walking_irl.recording import record_motion
from walking_irl.recording.reader import Recording, inspect_recording
from walking_irl.recording.style import PLAYBACK_RATE
from walking_irl.recording.views.body_geometry import log_body, visible_geoms
from walking_irl.recording.views.gait import WalkerView
from walking_irl.recording.views.motion import periodic_rollout, play, sample
from walking_irl.types import Rollout


def test_one_motion_alone_is_recorded(tmp_path: Path, model: mujoco.MjModel) -> None:
    path = record_motion(
        tmp_path / "a.rrd", WalkerView(model), walk(), title="A walk", text="At 1.25 m/s."
    )
    recording = Recording(path)
    frames = recording.column("/world/walker/leg", "Transform3D:translation").times
    assert len(frames) == round(8 * CYCLE * PLAYBACK_RATE)
    assert not any(e.startswith("/world/expert") for e in recording.entities)
    assert recording.summary == "# A walk\n\nAt 1.25 m/s."
    found = inspect_recording(path)
    assert (found["iterations"], found["w"]) == (None, None)


def test_only_the_visible_body_is_drawn(model: mujoco.MjModel) -> None:
    assert [model.geom(g).name for g in visible_geoms(model)] == ["trunk", "shin", "foot"]


def test_unknown_geoms_are_refused() -> None:
    xml = MJCF.replace('type="capsule" size=".1 .2"', 'type="mesh" mesh="m"').replace(
        "<worldbody>",
        '<asset><mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset><worldbody>',
    )
    with pytest.raises(InvalidInputError, match="trunk.*MESH.*boxes"):
        log_body(rr.RecordingStream("x"), mujoco.MjModel.from_xml_string(xml), "world/walker")


def test_poses_and_forces_of_a_standing_body(model: mujoco.MjModel) -> None:
    still = walk(stride=0.0)
    still.q[:, 2], still.v[:] = 0.0, 0.0
    # A touching sphere whose depth lets the soft contact carry some load at zero acceleration.
    frames = play(model, still, 5, start=2.0)
    np.testing.assert_allclose(frames.position[:, 1], [[2.0, 0.0, 0.599]] * 5, atol=1e-12)
    assert frames.n_contacts.tolist() == [1] * 5
    np.testing.assert_allclose(frames.force_at[:, :2], [[2.0, 0.0]] * 5, atol=1e-9)
    data = mujoco.MjData(model)
    data.qpos[:], data.qacc[:] = still.q[0], 0.0
    mujoco.mj_inverse(model, data)
    np.testing.assert_allclose(frames.force[:, 2], data.qfrc_constraint[1])


def test_ground_carries_the_shipped_humanoid() -> None:
    walker = load_walker()
    gait = Gait.from_vector(np.load(model_path("gaits.npz"))["spatial_x"][0], walker.model.nv)
    motion = cycle_motion(gait, walker.mirror)
    cycle = periodic_rollout(*motion, gait.timestep, 2 * gait.step_length)
    n_frames = round(20 * cycle.time[-1] * PLAYBACK_RATE)
    frames = play(walker.model, cycle, n_frames, start=0.0)
    load = frames.force[:, 2].sum() / n_frames
    assert load == pytest.approx(walker.weight, rel=0.02)  # sampled between the knots
    assert set(frames.n_contacts) == {1, 2}  # never in the air
    log_body(rr.RecordingStream("x"), walker.model, "world/walker")


def test_short_walks_are_repeated_with_their_stride() -> None:
    q, v, _ = sample(walk(), round(2.5 * CYCLE * PLAYBACK_RATE) + 1)
    assert q[-1, 0] == pytest.approx(2.5 * STRIDE)
    np.testing.assert_allclose(np.diff(q[:, 0]) * PLAYBACK_RATE, v[1:, 0])


@pytest.mark.parametrize("field", ["q", "v", "a"])
def test_rollouts_of_other_bodies_are_refused(field: str, model: mujoco.MjModel) -> None:
    wrong: dict[str, Array] = dict(walk().__dict__) | {field: np.zeros((41, 5))}
    with pytest.raises(InvalidInputError, match=rf"rollout\.{field} must have shape \(T, 3\)"):
        WalkerView(model, Rollout(**wrong))
