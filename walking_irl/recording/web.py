"""A recording in a browser: Rerun's own web viewer, reachable from this machine only."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO, NamedTuple
from urllib.parse import quote

from walking_irl.errors import RecordingError
from walking_irl.recording.reader import check_recording
from walking_irl.recording.screenshot import _free_port, _viewer

LOOPBACK = "127.0.0.1"
START_SECONDS = 30.0
_PR_SET_PDEATHSIG = 1


class Server(NamedTuple):
    """A viewer that is being served, and where."""

    address: str
    process: subprocess.Popen[bytes]

    def wait(self) -> None:
        """Until the server ends, which it does not by itself.

        Raises:
            RecordingError: If it did.
        """
        self.process.wait()
        raise RecordingError(f"the web viewer ended with exit code {self.process.returncode}")


@contextlib.contextmanager
def serve(path: str | Path) -> Iterator[Server]:
    """Serve a recording until the block is left; the server dies with this process, too.

    Ports are chosen among those that are free.

    Raises:
        RecordingError: If the recording cannot be read, or the viewer does not start.
    """
    file = check_recording(path).resolve()
    page, data = _free_port(), _free_port()
    with tempfile.TemporaryFile() as said:
        process = _start(file, page, data, said)
        try:
            _wait_for((page, data), process, said)
            source = quote(f"rerun+http://{LOOPBACK}:{data}/proxy", safe="")
            yield Server(f"http://{LOOPBACK}:{page}/?url={source}", process)
        finally:
            process.terminate()
            try:
                process.wait(5.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _start(file: Path, page: int, data: int, said: IO[bytes]) -> subprocess.Popen[bytes]:
    options = {"--bind": LOOPBACK, "--web-viewer-port": str(page), "--port": str(data)}
    words = [word for option in options.items() for word in option]
    try:
        return subprocess.Popen(
            [_viewer(), "--serve-web", *words, "--hide-welcome-screen", str(file)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=said,
            env={**os.environ, "RUST_LOG": "error"},
            preexec_fn=_die_with_parent if sys.platform.startswith("linux") else None,
        )
    except OSError as error:
        raise RecordingError(f"the web viewer cannot be started: {error}") from error


def _die_with_parent() -> None:
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def _wait_for(ports: tuple[int, int], process: subprocess.Popen[bytes], said: IO[bytes]) -> None:
    """Until both servers accept connections."""
    deadline = time.monotonic() + START_SECONDS
    for port in ports:
        while not _accepts(port):
            if process.poll() is not None or time.monotonic() > deadline:
                said.seek(0)
                lines = said.read().decode(errors="replace").split("\n")
                reason = next((line.strip() for line in reversed(lines) if line.strip()), "silent")
                raise RecordingError(f"the web viewer does not start ({reason})")
            time.sleep(0.05)


def _accepts(port: int) -> bool:
    with socket.socket() as s:
        s.settimeout(1.0)
        return s.connect_ex((LOOPBACK, port)) == 0
