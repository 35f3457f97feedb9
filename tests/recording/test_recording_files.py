"""What happens when a recording is interrupted, or writing or reading it fails."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import numpy as np
import pytest
import rerun as rr
import rerun_cli
from recordings import (
    objectives,
    run,
)

from walking_irl.domains.contract import Truth
from walking_irl.errors import InvalidInputError, RecordingError
from walking_irl.files import check_writable
from walking_irl.recording import Experiment, Recorder
from walking_irl.recording.reader import Recording, check_recording, inspect_recording
from walking_irl.recording.screenshot import open_viewer, save_screenshot
from walking_irl.types import Expert


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
        (tmp_path, "a folder, a pipe or a device"),
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


def test_experiment_checks_its_shapes() -> None:
    with pytest.raises(InvalidInputError, match=r"truth.w must have shape \(3,\), got \(2,\)"):
        Experiment(
            "x",
            objectives(3),
            Expert(np.zeros(3), np.zeros(3)),
            truth=Truth(np.zeros(2), np.zeros(3)),
        )
