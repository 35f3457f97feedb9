"""What is drawn can be read: magnified intervals, the answer last, speed and force of a gait."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from recordings import CYCLE, STRIDE, record, run, walk

from walking_irl.recording import Recorder, record_motion
from walking_irl.recording.interval_bars import BARS, HALF, PLACE
from walking_irl.recording.reader import Recording, inspect_recording
from walking_irl.recording.style import PLAYBACK_RATE
from walking_irl.recording.views.gait import FORCE, SPEED, WalkerView
from walking_irl.types import Rule


def test_short_intervals_are_drawn_magnified_by_one_round_factor(tmp_path: Path) -> None:
    experiment, iterations = run(3, n=12)
    with Recorder(tmp_path / "a.rrd", experiment) as recorder:
        for it in iterations:
            recorder.iteration(it)
    recording = Recording(tmp_path / "a.rrd")
    strips = np.array(recording.column(f"/{BARS}/lens/bars", "LineStrips2D:strips").rows[-1])
    (text,) = recording.column(f"/{BARS}/lens/scale", "Points2D:labels").rows[-1]
    zoom = float(text.removeprefix("magnified ").removesuffix(" x").replace(",", ""))
    low, high = iterations[-1].intervals.T
    np.testing.assert_allclose(np.ptp(strips[:, :, 0], axis=1), zoom * (high - low), rtol=1e-4)
    assert zoom >= 2 and np.abs(strips[:, :, 0] - PLACE).max() <= HALF * (1 + 1e-5)


def test_the_last_frame_shows_the_answer_and_no_query(
    tmp_path: Path, model: mujoco.MjModel
) -> None:
    iterations = record(tmp_path / "a.rrd", model)
    recording = Recording(tmp_path / "a.rrd")
    for where in (BARS, "polyhedron/shadow_123"):
        kind = "Points2D:positions" if where == BARS else "Points3D:positions"
        asked = recording.column(f"/{where}/query", kind).times[-1]
        cleared = recording.column(f"/{where}/query", "Clear:is_recursive").times[-1]
        assert cleared > asked
    dots = recording.column(f"/{BARS}/estimate", "Points2D:positions").rows[-1]
    np.testing.assert_allclose(np.array(dots)[:, 0], iterations[-1].estimate, rtol=1e-6)


def test_no_loss_is_drawn_of_probes_and_no_floor_of_small_figures(tmp_path: Path) -> None:
    experiment, iterations = run(4, n=5)
    iterations[2] = replace(iterations[2], best_regret=1e-12)
    iterations[4] = replace(iterations[4], rule=Rule.PROBE)
    with Recorder(tmp_path / "a.rrd", experiment) as recorder:
        for it in iterations:
            recorder.iteration(it)
    recording = Recording(tmp_path / "a.rrd")

    def curve(name: str) -> list[list[float]]:
        return recording.column(name, "Scalars:scalars", "iteration").rows

    assert len(curve("/cpirl/log10/loss")) == 4 and len(curve("/cpirl/loss")) == 5
    assert curve("/cpirl/log10/best_regret")[2][0] == pytest.approx(-12)


def test_a_gait_alone_has_its_weights_its_speed_and_its_force(
    tmp_path: Path, model: mujoco.MjModel
) -> None:
    view = WalkerView(model)
    path = record_motion(
        tmp_path / "a.rrd", view, walk(), title="A walk", weights={"x": 0.25, "y": 0.75},
        plots=view.plots(),
    )  # fmt: skip
    found, recording = inspect_recording(path), Recording(path)
    assert found["objectives"] == ["x", "y"] and found["w"] == [0.25, 0.75]
    pace = np.ravel(recording.column(f"/{SPEED}", "Scalars:scalars").rows)
    load = np.ravel(recording.column(f"/{FORCE}", "Scalars:scalars").rows)
    assert len(pace) == len(load) == round(8 * CYCLE * PLAYBACK_RATE)
    np.testing.assert_allclose(pace.mean(), STRIDE / CYCLE, rtol=0.02)  # the leg swings along
    assert np.isfinite(load).all() and (load > 0).any()
