"""Recordings: written, read back, compared, and what happens when writing or reading fails."""

from __future__ import annotations

import errno
import os
import subprocess
from pathlib import Path

import mujoco
import numpy as np
import pytest
import rerun as rr
import rerun_cli

from walking_irl.arrays import Array
from walking_irl.cpirl.loop import cpirl
from walking_irl.cpirl.summary import summarise
from walking_irl.domains.contract import Truth
from walking_irl.domains.humanoid.body.anatomy import load_walker
from walking_irl.domains.humanoid.gait.gait import Gait, cycle_motion
from walking_irl.domains.lqr import LQR
from walking_irl.errors import InvalidInputError, RecordingError
from walking_irl.files import check_writable, model_path
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.recording import Experiment, Recorder, record_motion
from walking_irl.recording.hulls import faces_lost, hull
from walking_irl.recording.panels import panels
from walking_irl.recording.reader import Recording, check_recording, inspect_recording
from walking_irl.recording.screenshot import open_viewer, save_screenshot
from walking_irl.recording.style import FADE_FRAMES, PLAYBACK_RATE
from walking_irl.recording.views.body_geometry import log_body, visible_geoms
from walking_irl.recording.views.gait import WalkerView
from walking_irl.recording.views.motion import periodic_rollout, play, sample
from walking_irl.types import Expert, Iteration, Objective, Response, Rollout, Rule, Status
from walking_irl.versions import versions

MJCF = """
<mujoco><option timestep="0.01"/>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 .1"/>
    <body name="torso" pos="0 0 .6">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <geom name="trunk" type="capsule" size=".1 .2" group="2" mass="8"/>
      <geom name="physics" type="box" size=".1 .1 .1" group="3" mass="1" contype="0"
        conaffinity="0"/>
      <body name="leg" pos="0 0 -.3">
        <joint name="hip" type="hinge" axis="0 1 0"/>
        <geom name="shin" type="ellipsoid" size=".04 .05 .1" pos="0 0 -.1" group="2" mass="1"/>
        <geom name="foot" type="sphere" size=".05" pos="0 0 -.25" group="2" mass="1"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
CYCLE = 0.8  # [s]
STRIDE = 1.0  # [m]


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(MJCF)


def walk(stride: float = STRIDE, cycle: float = CYCLE, n: int = 40) -> Rollout:
    """One cycle of a body that glides along and swings its leg by 0.3 rad."""
    phase = 2 * np.pi * np.arange(n) / n
    zero = np.zeros(n)
    q = np.c_[stride * np.arange(n) / n, zero - 0.001, 0.3 * np.sin(phase)]
    v = np.c_[zero + stride / cycle, zero, 0.3 * 2 * np.pi / cycle * np.cos(phase)]
    return periodic_rollout(q, v, np.zeros_like(q), cycle / n, stride)


def objectives(K: int) -> list[Objective]:
    """Named, with units and scales of their own."""
    return [Objective(f"part {j}", f"m^{j}", 1.0 + j, f"Meaning {j}.") for j in range(K)]


def run(K: int, n: int = 4, seed: int = 0) -> tuple[Experiment, list[Iteration]]:
    """Cutting planes on the unit sphere, where mu(w) = w / |w| is the best policy for w."""
    w_E = np.random.default_rng(seed).dirichlet(np.full(K, 3.0))
    mu_E = w_E / np.linalg.norm(w_E)
    polyhedron, iterations, best = WeightPolyhedron.simplex(K), [], (np.inf, w_E)
    for k in range(n):
        w = polyhedron.to_weights(polyhedron.chebyshev().z + 0.01 / (k + 1))
        mu = w / np.linalg.norm(w)
        regret = float(w @ (mu - mu_E))
        best = min(best, (regret, w), key=lambda pair: pair[0])
        after = polyhedron.cut(mu - mu_E)
        iterations.append(
            Iteration(
                k, polyhedron, w, Rule.CENTRE, Response(None, mu), regret, best[0], best[0] / 2,
                after.intervals(), best[1], Status.CUT if k < n - 1 else Status.BUDGET,
            )
        )  # fmt: skip
        polyhedron = after
    expert = Expert(mu_E, np.zeros(K))
    return Experiment("toy", objectives(K), expert, seed=seed, truth=Truth(w_E, mu_E)), iterations


def record(path: Path, model: mujoco.MjModel, K: int = 6) -> list[Iteration]:
    experiment, iterations = run(K)
    with Recorder(path, experiment, WalkerView(model, walk())) as recorder:
        for it in iterations:
            recorder.iteration(it, walk(stride=0.8 + 0.1 * it.k))
        recorder.finale(walk(stride=0.9))
    return iterations


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory, model: mujoco.MjModel) -> Recording:
    path = tmp_path_factory.mktemp("recording") / "walk.rrd"
    record(path, model)
    return Recording(path)


FRAMES_PER_ITERATION = round(2 * CYCLE * PLAYBACK_RATE)
FRAMES = 4 * FRAMES_PER_ITERATION + round(8 * CYCLE * PLAYBACK_RATE)


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
        np.testing.assert_array_equal(column.times, starts)
        expected = [[i.intervals[j, 0], i.w[j], i.intervals[j, 1], w_E[j]] for i in iterations]
        np.testing.assert_allclose(column.rows, expected)
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
    np.testing.assert_allclose(found["bracket"], [-last.certificate, last.best_regret])
    assert found["volume_ratio"] == pytest.approx(expected.volume_ratio)
    assert 0.0 < found["volume_ratio"] < 1.0
    assert f"leave {expected.volume_ratio:.1e} of the volume of all" in recorded.summary
    np.testing.assert_array_equal(found["noise"], np.zeros(6))
    assert found["condition_number"] is None and found["weakest"] is None  # no sensitivity known
    low, high = physical[5]
    assert f"| {low:.3g} - {high:.3g} per m^5 |" in recorded.summary


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
    assert "known from 7 recorded walks to within 2 % each" in text


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


def test_interrupted_run_leaves_a_readable_file(tmp_path: Path) -> None:
    experiment, iterations = run(6)
    path = tmp_path / "cut.rrd"
    with pytest.raises(KeyboardInterrupt), Recorder(path, experiment) as recorder:
        for it in iterations[:2]:
            recorder.iteration(it)
        raise KeyboardInterrupt
    found = inspect_recording(path)
    assert (found["iterations"], found["ending"]) == (2, "interrupted")
    np.testing.assert_allclose(found["w"], iterations[1].estimate)
    assert "cut short: interrupted" in Recording(path).summary
    assert os.listdir(tmp_path) == ["cut.rrd"]


def test_run_that_fails_before_its_first_iteration_is_still_readable(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), Recorder(tmp_path / "x.rrd", run(3)[0]):
        raise ZeroDivisionError
    found = inspect_recording(tmp_path / "x.rrd")
    assert (found["iterations"], found["w"], found["ending"]) == (0, None, "ZeroDivisionError")


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


def test_unwritable_targets_are_found_before_the_run(tmp_path: Path) -> None:
    experiment = run(3)[0]
    with pytest.raises(RecordingError, match="no folder .*; create it"):
        Recorder(tmp_path / "missing" / "a.rrd", experiment)
    with pytest.raises(RecordingError, match="it is a folder; name a file"):
        Recorder(tmp_path, experiment)
    with pytest.raises(RecordingError, match="/dev/full: it is a device"):
        Recorder("/dev/full", experiment)
    assert os.listdir(tmp_path) == []


def test_read_only_directory_is_found_before_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)  # root may write everywhere
    with pytest.raises(RecordingError, match="Permission denied; free space, change the perm"):
        check_writable(tmp_path / "a.rrd", RecordingError)


def test_checking_leaves_an_existing_file_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    path.write_bytes(b"precious")
    assert check_writable(path) == path
    assert path.read_bytes() == b"precious" and os.listdir(tmp_path) == ["a.rrd"]


def test_full_disk_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.rrd"
    path.write_bytes(b"precious")

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    recorder = Recorder(path, run(3)[0])
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(RecordingError, match="No space left on device; free space"), recorder:
        pass
    assert path.read_bytes() == b"precious" and os.listdir(tmp_path) == ["a.rrd"]


def test_failed_write_does_not_hide_the_first_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    directory = tmp_path / "soon_gone"
    directory.mkdir()
    with (
        pytest.raises(ZeroDivisionError) as caught,
        Recorder(directory / "a.rrd", run(3)[0]),
    ):
        directory.rmdir()
        raise ZeroDivisionError
    assert "no folder" in caught.value.__notes__[0]


def test_disabled_rerun_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RERUN", "off")
    with pytest.raises(RecordingError, match="unset it"), Recorder(tmp_path / "a.rrd", run(3)[0]):
        pass


def test_unreadable_files_are_refused_in_one_sentence(tmp_path: Path, recorded: Recording) -> None:
    whole = recorded.path.read_bytes()
    truncated, text, empty = (tmp_path / name for name in ("half.rrd", "text.rrd", "empty.rrd"))
    truncated.write_bytes(whole[: len(whole) // 2])
    text.write_text("not a recording")
    empty.write_bytes(b"")
    for path, message in (
        (truncated, "was cut off"),
        (text, "is not a Rerun recording"),
        (empty, "is not a Rerun recording"),
        (tmp_path / "none.rrd", "there is no recording"),
        (tmp_path, "got the directory"),
    ):
        with pytest.raises(RecordingError, match=message) as caught:
            inspect_recording(path)
        assert "\n" not in str(caught.value)


def test_recordings_of_other_programs_are_refused(tmp_path: Path) -> None:
    stream = rr.RecordingStream("somebody_else")
    memory = stream.memory_recording()
    stream.log("a", rr.Scalars(1.0))
    (tmp_path / "foreign.rrd").write_bytes(memory.drain_as_bytes())
    with pytest.raises(RecordingError, match="recording of somebody_else; expected"):
        check_recording(tmp_path / "foreign.rrd")


def test_viewing_needs_a_recording_and_a_viewer(
    tmp_path: Path, recorded: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    for look in (open_viewer, lambda path: save_screenshot(path, tmp_path / "a.png")):
        with pytest.raises(RecordingError, match="there is no recording"):
            look(tmp_path / "none.rrd")
    monkeypatch.setattr(rerun_cli, "__file__", str(tmp_path / "__init__.py"))
    for look in (open_viewer, lambda path: save_screenshot(path, tmp_path / "a.png")):
        with pytest.raises(RecordingError, match="viewer is missing"):
            look(recorded.path)


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


def test_experiment_checks_its_shapes() -> None:
    with pytest.raises(InvalidInputError, match=r"truth.w must have shape \(3,\), got \(2,\)"):
        Experiment(
            "x",
            objectives(3),
            Expert(np.zeros(3), np.zeros(3)),
            truth=Truth(np.zeros(2), np.zeros(3)),
        )


def test_hull_draws_outward_triangles_and_true_edges() -> None:
    rng = np.random.default_rng(0)
    body = hull(rng.normal(size=(30, 3)) * 1e-7 + 0.5)
    a, b, c = (body.points[body.triangles[:, i]] for i in range(3))
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a - body.points.mean(axis=0))
    assert np.all(outward > 0)
    assert len(body.points) - len(body.edges) + len(body.triangles) == 2  # Euler, no flat pairs


def test_lost_faces_are_those_outside_what_is_left() -> None:
    cube = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    before, half = hull(cube), hull(cube * [0.5, 1, 1])
    assert len(faces_lost(before, before)) == 0
    lost = faces_lost(before, half)
    untouched = {tuple(np.sort(t)) for t in before.triangles.tolist()} - {
        tuple(np.sort(t)) for t in lost.tolist()
    }
    assert len(lost) == 10 and len(untouched) == 2  # only the face x = 0 is whole
