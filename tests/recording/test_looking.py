"""What is drawn can be read: magnified intervals, the answer last, speed and force of a gait."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from recordings import CYCLE, STRIDE, record, run, walk

from walking_irl.recording import Recorder, record_motion, screenshot, style
from walking_irl.recording.blueprint import blueprint
from walking_irl.recording.interval_bars import BARS, HALF, MOST_LETTERS, PLACE, bounds
from walking_irl.recording.panels import panels
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

    drawn, known = curve("/cpirl/log10/loss"), curve("/cpirl/loss")
    assert len(known) == 5 and len(drawn) == 5 and drawn[-1] == drawn[-2]  # on to the end
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


@pytest.mark.parametrize("K", [3, 6])
def test_nothing_glows_as_cut_off_before_the_first_cut(K: int, tmp_path: Path) -> None:
    experiment, iterations = run(K)
    with Recorder(tmp_path / "a.rrd", experiment) as recorder:
        for it in iterations:
            recorder.iteration(it)
    recording = Recording(tmp_path / "a.rrd")
    (panel, *_) = panels(experiment.names)
    cut = recording.column(f"/{panel.path}/cut", "Mesh3D:vertex_positions").times
    second = recording.column("/cpirl/regret", "Scalars:scalars").times[1]
    assert cut.min() == second > 0


@pytest.mark.parametrize("has_finale", [False, True])
def test_curves_end_with_the_recording(has_finale: bool, tmp_path: Path) -> None:
    experiment, iterations = run(4)
    with Recorder(tmp_path / "a.rrd", experiment) as recorder:
        for it in iterations:
            recorder.iteration(it)
        if has_finale:
            recorder.finale(None)
    recording = Recording(tmp_path / "a.rrd")
    end = inspect_recording(recording.path)["frames"] - 1
    starts = recording.column("/cpirl/regret", "Scalars:scalars").times
    for name in ("/cpirl/log10/certificate", "/weights/part\\ 0", "/features/part\\ 0"):
        curve = recording.column(name, "Scalars:scalars")
        assert curve.times[-1] == end > starts[-1]
        assert curve.rows[-1] == curve.rows[-2]


def test_names_stand_beside_their_bars_however_long_they_are() -> None:
    for longest in (1, 10, 23, 80):
        names = ["a", "x" * longest]
        (left, right), _ = bounds(names)
        pixels = 530 / (right - left)  # of the view in a window 1456 wide, at 5.5 a letter
        width = 5.5 * min(longest, MOST_LETTERS) / pixels
        assert left <= left / 2 - width / 2 and left / 2 + width / 2 < 0.0


def test_the_table_of_many_objectives_is_seen_without_scrolling(model: mujoco.MjModel) -> None:
    share = {}
    for K in (6, 9):
        experiment, _ = run(K)
        shares = blueprint(experiment, WalkerView(model)).root_container.row_shares
        assert shares is not None
        upper, lower = shares
        share[K] = lower / (upper + lower)
    assert share[9] > share[6]


def test_a_slow_viewer_is_asked_again_until_it_has_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    answers = iter([TimeoutError, TimeoutError, "drawn"])

    def call() -> str:
        answer = next(answers)
        if isinstance(answer, str):
            return answer
        raise answer

    assert screenshot._patiently(call) == "drawn"
    monkeypatch.setattr(screenshot, "LOAD_SECONDS", 0.0)

    def never() -> str:
        raise TimeoutError

    with pytest.raises(TimeoutError):
        screenshot._patiently(never)


def test_text_is_read_on_the_plates_of_both_themes() -> None:
    """Contrast of the text with its plate over paper, by WCAG 2.1; 4.5 is asked for there."""
    for plate in ((146, 146, 144), (234, 234, 232)):  # as the viewer draws them: dark, light
        light, dark = sorted((luminance(plate), luminance(style.LABEL)), reverse=True)
        assert (light + 0.05) / (dark + 0.05) > 4.5


def luminance(colour: style.Colour) -> float:
    c = np.array(colour) / 255
    linear = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])
