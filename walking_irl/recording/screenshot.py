"""Looking at a recording: in the viewer, or as a picture without a screen."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import rerun_cli
from rerun.experimental import ViewerClient

from walking_irl.errors import RecordingError
from walking_irl.files import check_writable, write_file
from walking_irl.recording.reader import check_recording

LOAD_SECONDS = 60.0
"""Longest wait for the viewer to load or to draw [s]."""
Answer = TypeVar("Answer")
DRIVER = "install software Vulkan: apt-get install mesa-vulkan-drivers"


def open_viewer(path: str | Path) -> None:
    """Open a recording in the Rerun viewer and return at once.

    Raises:
        RecordingError: If it cannot be read, or there is no viewer.
    """
    file = check_recording(path)
    try:
        subprocess.Popen(
            [_viewer(), str(file.resolve())],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
    except OSError as error:
        raise RecordingError(f"the Rerun viewer cannot be started: {error}") from error


def save_screenshot(
    path: str | Path,
    png: str | Path,
    *,
    frame: int | None = None,
    settle: float = 2.0,
) -> Path:
    """Render a recording to a picture of the viewer's window, without a screen.

    Args:
        path: The recording.
        png: The picture.
        frame: Value of the timeline ``frame``; None for the last one.
        settle: How long animations may take to come to rest [s].

    Raises:
        RecordingError: If the recording cannot be read, the picture cannot be written, or the
            viewer or Vulkan is missing.
    """
    file, target = check_recording(path), check_writable(png, RecordingError)
    try:
        with (
            _quiet(),
            ViewerClient.spawn(
                headless=True,
                port=_free_port(),
                executable_path=_viewer(),
                hide_welcome_screen=True,
            ) as viewer,
        ):
            _patiently(lambda: viewer.open([str(file.resolve())]))
            _show(viewer, frame)
            time.sleep(settle)
            picture = _patiently(viewer.take_screenshot)
    except TimeoutError as error:
        raise RecordingError(
            f"the viewer has not drawn {file} in {LOAD_SECONDS:.0f} s; is this machine busy? "
            "try again"
        ) from error
    except (RuntimeError, OSError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise RecordingError(
            f"the viewer cannot draw without a screen ({reason}); {DRIVER}"
        ) from error
    write_file(target, picture, RecordingError)
    return target


def _patiently(call: Callable[[], Answer]) -> Answer:
    """Ask again where the viewer, on a busy machine, takes longer than its client waits."""
    deadline = time.monotonic() + LOAD_SECONDS
    while True:
        try:
            return call()
        except TimeoutError:
            if time.monotonic() > deadline:
                raise


def _show(viewer: ViewerClient, frame: int | None) -> None:
    """Wait until the recording is loaded, then stop at a frame."""
    deadline = time.monotonic() + LOAD_SECONDS
    while True:
        state = _patiently(viewer.get_state)
        if not state.loading and state.recordings:
            break
        if time.monotonic() > deadline:
            raise TimeoutError(f"not loaded after {LOAD_SECONDS:.0f} s")
        time.sleep(0.2)
    ends = [t.end for t in state.recordings[0].timelines if t.name == "frame"]
    last = int(ends[0]) if ends and ends[0] is not None else 0
    frame = last if frame is None else frame
    if not 0 <= frame <= last:
        raise RecordingError(f"frame must lie in [0, {last}], got {frame}")
    viewer.set_time("frame", sequence=frame, play_state="paused")


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep the viewer's own log off the terminal; what goes wrong is reported as an error.

    Vulkan complains where there is no session of a desktop, and so no folder for its sockets.
    """
    with tempfile.TemporaryDirectory() as folder:
        added = {"RUST_LOG": "off", "XDG_RUNTIME_DIR": folder}
        added = {name: value for name, value in added.items() if name not in os.environ}
        os.environ.update(added)
        try:
            yield
        finally:
            for name in added:
                del os.environ[name]


def _viewer() -> str:
    executable = Path(rerun_cli.__file__).parent / "rerun"
    if not executable.exists():
        executable = executable.with_suffix(".exe")
    if not executable.exists():
        raise RecordingError("the Rerun viewer is missing; install rerun-sdk again: pip install "
                             "--force-reinstall rerun-sdk")  # fmt: skip
    return str(executable)


def _free_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return int(s.getsockname()[1])
