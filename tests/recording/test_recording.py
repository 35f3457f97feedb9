"""Recordings: written, read back and compared."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import mujoco
import numpy as np
import pytest
import rerun_cli
from recordings import (
    CYCLE,
    FRAMES,
    FRAMES_PER_ITERATION,
    record,
    run,
)

from walking_irl.cpirl.loop import cpirl
from walking_irl.cpirl.probes import Probing
from walking_irl.cpirl.summary import summarise
from walking_irl.domains.contract import Truth
from walking_irl.domains.lqr import LQR
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.recording import Experiment, Recorder
from walking_irl.recording.panels import panels
from walking_irl.recording.reader import Recording, inspect_recording
from walking_irl.recording.style import FADE_FRAMES, PLAYBACK_RATE
from walking_irl.types import Expert, Iteration
from walking_irl.versions import versions


def test_contract_entities_timelines_and_blueprint(recorded: Recording) -> None:
    names = [f"part\\ {j}" for j in range(6)]
    expected = {
        *(f"/weights/{n}" for n in names),
        *(f"/features/{n}" for n in names),
        *(f"/cpirl/{k}" for k in "regret best_regret certificate volume_ratio loss".split()),
        *(f"/world/{who}/{b}" for who in ("walker", "expert") for b in ("torso", "leg")),
        *("/world/follow", "/world/contacts", "/world/com_trail", "/joints/hip"),
        *("/summary", "/log", "/polyhedron/shadow_123/set", "/polyhedron/shadow_456/set"),
        *("/polyhedron/shadow_123/cut", "/polyhedron/shadow_123/truth"),
    }
    assert expected <= set(recorded.entities)
    assert recorded.timelines == ["frame", "iteration", "sim_time"]
    assert recorded.has_blueprint


def test_one_row_per_frame_on_every_timeline(recorded: Recording) -> None:
    pose = "Transform3D:translation"
    for entity in ("/world/walker/leg", "/world/expert/leg", "/world/follow"):
        frames = recorded.column(entity, pose).times
        np.testing.assert_array_equal(frames, np.arange(FRAMES))
    seconds = recorded.column("/world/walker/leg", pose, "sim_time").times * 1e-9
    np.testing.assert_allclose(seconds, np.arange(FRAMES) / PLAYBACK_RATE, atol=1e-8)
    iteration = recorded.column("/world/walker/leg", pose, "iteration").times
    rest = FRAMES - 4 * FRAMES_PER_ITERATION
    np.testing.assert_array_equal(
        np.bincount(iteration), [FRAMES_PER_ITERATION] * 3 + [FRAMES_PER_ITERATION + rest]
    )


def test_figures_of_every_iteration_are_read_back(recorded: Recording) -> None:
    experiment, iterations = run(6)
    w_E = experiment.w_expert
    assert w_E is not None
    starts = FRAMES_PER_ITERATION * np.arange(4)
    for j in range(6):
        column = recorded.column(f"/weights/part\\ {j}", "Scalars:scalars")
        np.testing.assert_array_equal(column.times, [*starts, FRAMES - 1])
        expected = [[i.intervals[j, 0], i.w[j], i.intervals[j, 1], w_E[j]] for i in iterations]
        np.testing.assert_allclose(column.rows, [*expected, expected[-1]])
    certificate = recorded.column("/cpirl/certificate", "Scalars:scalars", "iteration")
    np.testing.assert_array_equal(certificate.times, np.arange(4))
    np.testing.assert_allclose(np.ravel(certificate.rows), [i.certificate for i in iterations])
    volume = np.ravel(recorded.column("/cpirl/volume_ratio", "Scalars:scalars").rows)
    assert volume[0] == pytest.approx(1.0) and np.all(np.diff(volume) < 0)
    assert len(recorded.column("/log", "TextLog:text").rows) == 4


def test_loss_is_relative_to_the_expert(recorded: Recording) -> None:
    experiment, iterations = run(6)
    w_E, mu_E = experiment.w_expert, experiment.expert.mu
    assert w_E is not None
    loss = np.ravel(recorded.column("/cpirl/loss", "Scalars:scalars").rows)
    expected = [1 - (w_E @ i.response.mu) / (w_E @ mu_E) for i in iterations]
    np.testing.assert_allclose(loss, expected, atol=1e-12)


def test_joint_angles_are_in_degrees_learner_first(recorded: Recording) -> None:
    rows = np.array(recorded.column("/joints/hip", "Scalars:scalars").rows)
    assert rows.shape == (FRAMES, 2)
    assert rows.max() == pytest.approx(np.rad2deg(0.3), rel=1e-3)
    assert "/joints/x" not in recorded.entities


def test_the_learner_walks_on_without_a_jump(recorded: Recording) -> None:
    x = np.array(recorded.column("/world/walker/torso", "Transform3D:translation").rows)[:, 0, 0]
    step = np.diff(x) * PLAYBACK_RATE * CYCLE
    assert step.min() > 0.75 and step.max() < 1.15  # strides from 0.8 to 1.1 m
    ghost = np.array(recorded.column("/world/expert/torso", "Transform3D:translation").rows)
    starts = FRAMES_PER_ITERATION * np.arange(4)
    np.testing.assert_allclose(ghost[starts, 0, 0], x[starts], atol=1e-6)


def test_properties_and_inspection(recorded: Recording) -> None:
    experiment, iterations = run(6)
    found = inspect_recording(recorded.path)
    last = iterations[-1]
    assert found["application_id"] == "walking_irl"
    assert (found["domain"], found["seed"], found["centre"]) == ("toy", 0, "ac")
    assert found["objectives"] == experiment.names
    np.testing.assert_allclose(found["w_expert"], np.array(experiment.w_expert))
    np.testing.assert_allclose(found["w"], last.estimate)
    np.testing.assert_allclose(found["intervals"], last.intervals)
    assert (found["iterations"], found["frames"]) == (4, FRAMES)
    assert (found["status"], found["ending"]) == ("budget", None)
    assert found["versions"]["mujoco"] == mujoco.__version__
    assert "python" in found["versions"] and found["versions"] == versions()


def test_how_sure_a_recovery_is_is_read_back_and_told(recorded: Recording) -> None:
    experiment, iterations = run(6)
    found = inspect_recording(recorded.path)
    expected = summarise(iterations, experiment.expert, experiment.objectives)
    physical = iterations[-1].intervals / np.arange(1.0, 7.0)[:, None]
    np.testing.assert_allclose(found["physical_intervals"], physical)
    assert found["units"] == [f"m^{j}" for j in range(6)]
    assert found["rule"] == expected.rule and expected.rule in recorded.summary
    last = iterations[-1]
    np.testing.assert_allclose(found["bracket"], last.bracket)
    assert found["how_sure"] == expected.how_sure and expected.how_sure in recorded.summary
    assert found["volume_ratio"] == pytest.approx(expected.volume_ratio)
    assert 0.0 < found["volume_ratio"] < 1.0
    assert f"leave {expected.volume_ratio:.1e} of the volume of all" in recorded.summary
    np.testing.assert_array_equal(found["noise"], np.zeros(6))
    assert found["condition_number"] is None and found["weakest"] is None  # no sensitivity known
    low, high = physical[5]
    assert abs(low) < 1e-15  # the bound w >= 0, and rounding
    assert f"| 0 - {high:.3g} per m^5 |" in recorded.summary


def test_weakest_direction_and_noise_are_told_where_they_are_known(tmp_path: Path) -> None:
    problem, w_E = LQR(3), np.array([0.2, 0.3, 0.5])
    mu = problem.forward(w_E).mu
    expert = Expert(mu, 0.02 * np.abs(mu), n_samples=7)
    experiment = Experiment("lqr", problem.objectives, expert, truth=Truth(w_E, mu))
    iterations = list(cpirl(problem.forward, expert, rng=np.random.default_rng(0), max_solves=3))
    with Recorder(tmp_path / "a.rrd", experiment) as recorder:
        for it in iterations:
            recorder.iteration(it)
    found, text = inspect_recording(tmp_path / "a.rrd"), Recording(tmp_path / "a.rrd").summary
    expected = summarise(iterations, expert, problem.objectives)
    assert found["condition_number"] == pytest.approx(expected.condition_number)
    assert found["weakest"] == expected.weakest and f"**{expected.weakest}**" in text
    np.testing.assert_allclose(found["noise"], expert.error)
    assert "known from 7 trajectories to within 2 % each" in text


def test_half_widths_are_told_by_cause(tmp_path: Path) -> None:
    problem, rng = LQR(3), np.random.default_rng(0)
    expert = problem.expert(np.array([0.2, 0.3, 0.5]), rng)
    iterations = list(cpirl(problem.forward, expert, rng=rng, probe=Probing()))
    with Recorder(tmp_path / "a.rrd", Experiment("lqr", problem.objectives, expert)) as recorder:
        for it in iterations:
            recorder.iteration(it)
    found, text = inspect_recording(tmp_path / "a.rrd"), Recording(tmp_path / "a.rrd").summary
    for part in ("from_noise", "from_gap", "from_solver"):
        np.testing.assert_allclose(found[part], getattr(iterations[-1].certainty, part))
    assert found["how_sure"].startswith("from the expert's possible") and found["how_sure"] in text


def test_summary_tells_true_and_recovered_weights(recorded: Recording) -> None:
    experiment, iterations = run(6)
    assert experiment.w_expert is not None
    for true, found in zip(experiment.w_expert, iterations[-1].estimate, strict=True):
        assert f"| {true:.4f} | {found:.4f} |" in recorded.summary
    assert "cut short" not in recorded.summary


def test_equal_runs_give_equal_recordings(tmp_path: Path, model: mujoco.MjModel) -> None:
    a, b, c = (tmp_path / f"{name}.rrd" for name in "abc")
    record(a, model)
    record(b, model)
    record(c, model, K=5)
    assert _compare(a, b) == 0
    assert _compare(a, c) != 0


def _compare(a: Path, b: Path) -> int:
    rerun = Path(rerun_cli.__file__).parent / "rerun"
    environment = os.environ | {"CI": "true", "RERUN_ANALYTICS": "0"}
    command = [str(rerun), "rrd", "compare", str(a), str(b)]
    return subprocess.run(command, env=environment, capture_output=True, check=False).returncode


@pytest.mark.parametrize("K", [2, 3, 4, 5, 6, 7, 8])
def test_any_number_of_objectives(K: int, tmp_path: Path) -> None:
    experiment, iterations = run(K)
    with Recorder(tmp_path / "k.rrd", experiment) as recorder:
        for it in iterations:
            recorder.iteration(it)
    recording = Recording(tmp_path / "k.rrd")
    bars = recording.column("/polyhedron/intervals/bars", "LineStrips2D:strips").rows
    assert [len(row) for row in bars] == [K] * 4
    sets = [e for e in recording.entities if e.endswith("/set") and "lens" not in e]
    assert len(sets) == {3: 1, 4: 1, 5: 2, 6: 2, 7: 3}.get(K, 0)
    shown = {label for p in panels(experiment.names) for label in p.labels}
    assert shown == (set(experiment.names) if 3 <= K <= 7 else set())


def test_drawn_set_is_the_shadow_of_the_polyhedron(recorded: Recording) -> None:
    _, iterations = run(6)
    rows = recorded.column("/polyhedron/shadow_123/set", "Mesh3D:vertex_positions").rows
    for it, drawn in zip(iterations, rows, strict=True):
        shadow = it.polyhedron.vertices()[:, :3]
        np.testing.assert_allclose(np.min(drawn, 0), shadow.min(0), atol=1e-6)
        np.testing.assert_allclose(np.max(drawn, 0), shadow.max(0), atol=1e-6)


def test_what_a_cut_took_away_fades(recorded: Recording) -> None:
    column = recorded.column("/polyhedron/shadow_123/cut", "Mesh3D:albedo_factor")
    opacity = [row[0] & 255 for row in column.rows]
    per_cut = len(opacity) // 3  # the first iteration has no cut before it
    assert per_cut > 4 and np.all(np.diff(opacity[:per_cut]) < 0)
    assert column.times[0] == FRAMES_PER_ITERATION
    edges = "/polyhedron/shadow_123/cut/edges"
    radii = recorded.column(edges, "LineStrips3D:radii")
    width = np.abs(np.ravel(radii.rows))  # in points, which are negative
    assert np.all(np.diff(width[: len(width) // 3]) < 0)
    gone = recorded.column(edges, "Clear:is_recursive").times
    assert radii.times[len(width) // 3 - 1] < gone[0] < FRAMES_PER_ITERATION + FADE_FRAMES


@pytest.mark.parametrize("scale", [1.0, 1e-4, 1e-8])
def test_lens_keeps_a_tiny_set_visible(scale: float, tmp_path: Path) -> None:
    experiment, iterations = run(4, n=1)
    w_E = experiment.w_expert
    assert w_E is not None
    tiny = WeightPolyhedron.simplex(4)
    for j in range(4):  # w_j >= (1 - scale) w_E[j]
        tiny = tiny.cut((1 - scale) * w_E[j] - np.eye(4)[j])
    (it,) = iterations
    it = Iteration(**(it.__dict__ | {"polyhedron": tiny}))
    if scale < 1e-6:
        assert tiny.is_flat
    with Recorder(tmp_path / "tiny.rrd", experiment) as recorder:
        recorder.iteration(it)
    recording = Recording(tmp_path / "tiny.rrd")
    if scale == 1e-4:
        (drawn,) = recording.column("/polyhedron/all/lens/set", "Mesh3D:vertex_positions").rows
        assert np.ptp(drawn, axis=0).max() > 0.2
    else:  # large enough without a lens, or nothing to draw
        assert "/polyhedron/all/lens/set" not in recording.entities
