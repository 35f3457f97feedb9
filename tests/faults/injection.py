"""Faults of the outside world, done to real processes: kills, interrupts, full disks, pipes.

Each function does one fault to one run and returns what is wrong with what it left: nothing, if the
product survived. ``benchmarks/faults.py`` does it often, the tests of this folder a few times.
"""

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

from walking_irl.errors import WalkingIRLError
from walking_irl.recording.reader import inspect_recording
from walking_irl.run.checkpoint import load_checkpoint

BEGIN = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where tests run in background
from walking_irl.cli.main import main
{before}
open(sys.argv[1], "w").close()
sys.exit(main(sys.argv[2:]))
"""
"""A run of the command line; what a person's shell starts, and a mark once it has begun."""
CHECKPOINT, RECORDING, JSON = "run.checkpoint.npz", "run.rrd", "run.json"
NOT_COMPARED = ("seconds", "recording", "checkpoint")
ORPHANS_LEAVE = 15.0
"""How long processes may take to see that their parent is gone [s]."""
PATIENCE = 180.0
"""How long a run may take to end once it is told to [s]."""


class Run:
    """A recovery in a folder of its own, as the leader of a session of processes.

    Args:
        folder: An empty folder.
        job: Arguments of ``recover`` that say what to recover.
        before: Python to run first.
    """

    def __init__(self, folder, job, before=""):
        self.folder = Path(folder)
        mark = self.folder / ".begun"
        argv = ["recover", *job]
        if "--resume" not in job:
            argv += ["--record", RECORDING, "--checkpoint", CHECKPOINT, "--json", JSON]
        script = BEGIN.format(before=before)
        self.out, self.err = tempfile.TemporaryFile(), tempfile.TemporaryFile()  # no pipe: orphans
        self.process = subprocess.Popen(
            [sys.executable, "-c", script, str(mark), *argv],
            cwd=self.folder,
            stdout=self.out,
            stderr=self.err,
            start_new_session=True,
        )
        while not mark.exists() and self.process.poll() is None:
            time.sleep(0.005)
        mark.unlink(missing_ok=True)
        self.start = time.monotonic()

    def wait(self, instant):
        """Until so many seconds after the begin, or its end; whether it is still running."""
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(max(self.start + instant - time.monotonic(), 0.0))
        return self.process.poll() is None

    def end(self):
        """Exit code, output and errors; None where it does not end."""
        try:
            code = self.process.wait(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
            code = None
        told = []
        for file in (self.out, self.err):
            file.seek(0)
            told.append(file.read().decode())
            file.close()
        return code, *told

    def orphans(self):
        """Processes of its session that outlive it; they are ended."""
        deadline = time.monotonic() + ORPHANS_LEAVE
        while (left := members(self.process.pid)) and time.monotonic() < deadline:
            time.sleep(0.1)
        for pid in left:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        return left


def members(session):
    """Processes of a session that are alive."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            state, _, _, own = stat.read_text().rpartition(")")[2].split()[:4]
            if int(own) == session and state not in "ZX":
                found.append(int(stat.parent.name))
    return found


def whole_run(folder, job):
    """Figures of a run that nothing happens to, and how long it takes [s]."""
    run = Run(folder, job)
    code, _, err = run.end()
    seconds = time.monotonic() - run.start
    assert code is not None and not err, (code, err)
    return figures(folder / JSON), seconds


def figures(path):
    """All figures of a run, but clocks and names of files."""
    content = json.loads(path.read_text())
    return {name: value for name, value in content.items() if name not in NOT_COMPARED}


def killed(folder, job, whole, instant):
    """Kill -9 at an instant: None if it had ended, else how far it was and what is wrong."""
    run = Run(folder, job)
    if not run.wait(instant):
        run.end()
        return None
    run.process.kill()
    run.end()
    left = run.orphans()
    wrong = [f"{len(left)} processes are left"] if left else []
    if not (folder / CHECKPOINT).exists():
        return "no answer yet", wrong
    return resumed(folder, whole, wrong)


def killed_in_write(folder, job, whole, n):
    """Kill -9 in the middle of the n-th write of a file: as :func:`killed`."""
    before = f"""
import io, os, walking_irl.files
class Half(io.FileIO):
    n = 0
    def write(self, content):
        Half.n += 1
        if Half.n == {n}:
            super().write(content[: len(content) // 2])
            os.kill(os.getpid(), 9)
        return super().write(content)
from pathlib import Path
opened = Path.open
Path.open = lambda p, mode="r", *a, **k: Half(p, "x") if mode == "xb" else opened(p, mode, *a, **k)
import walking_irl.files as files
files.check_writable = lambda path, error=None: path
"""
    run = Run(folder, job, before)
    code, _, err = run.end()
    if code == 0:
        return None
    wrong = [] if code == -signal.SIGKILL else [f"it ended with {code}: {err}"]
    left = run.orphans()
    wrong += [f"{len(left)} processes are left"] if left else []
    if not (folder / CHECKPOINT).exists():
        return "no answer yet", wrong
    return resumed(folder, whole, wrong)


def full_disk(folder, job, whole, n):
    """The disk is full from the n-th write of a file on: as :func:`killed`.

    The run must end with an answer or one sentence, and what it names as written must be whole.
    """
    before = f"""
import errno, io
from pathlib import Path
class Full(io.FileIO):
    n = 0
    def write(self, content):
        Full.n += 1
        if Full.n >= {n}:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(content)
opened = Path.open
Path.open = lambda p, mode="r", *a, **k: Full(p, "x") if mode == "xb" else opened(p, mode, *a, **k)
"""
    run = Run(folder, job, before)
    code, out, err = run.end()
    if code == 0:
        return None
    left = run.orphans()
    wrong = [f"{len(left)} processes are left"] if left else []
    wrong += [] if code == 2 and "space" in err else [f"exit code {code}: {err[-200:]}"]
    wrong += traces(out, err) + stray(folder) + unreadable(folder)
    return f"write {n}", wrong


def unreadable(folder):
    """Which of the files that a run left cannot be read."""
    readers = {
        CHECKPOINT: load_checkpoint,
        RECORDING: inspect_recording,
        JSON: lambda path: json.loads(path.read_text()),
    }
    wrong = []
    for name, read in readers.items():
        if (folder / name).exists():
            try:
                read(folder / name)
            except (ValueError, WalkingIRLError) as error:
                wrong.append(f"{name}: {error}")
    return wrong


def resumed(folder, whole, wrong):
    """Go on from a checkpoint: how far it was, and what is wrong; the result must be the whole."""
    try:
        known = len(load_checkpoint(folder / CHECKPOINT).answers)
    except WalkingIRLError as error:
        return "unreadable", [*wrong, f"checkpoint: {error}"]
    rest = ("--resume", CHECKPOINT, "--record", "again.rrd", "--json", "again.json", "--quiet")
    code, _, err = Run(folder, rest).end()
    if not (folder / "again.json").exists():
        return f"{known} answers", [*wrong, f"resumed, it ended with {code}: {err}"]
    found = figures(folder / "again.json")
    other = [name for name in whole if found.get(name) != whole[name]]
    if other:
        wrong = [*wrong, f"resumed, it differs in {', '.join(other)}"]
    return f"{known} answers", wrong


def stopped(folder, job, sign, instant):
    """Ctrl-C (to all processes) or SIGTERM (to the first): as :func:`killed`."""
    run = Run(folder, job)
    if not run.wait(instant):
        run.end()
        return None
    if sign == signal.SIGINT:
        os.killpg(run.process.pid, sign)
    else:
        run.process.send_signal(sign)
    code, out, err = run.end()
    left = run.orphans()
    wrong = [f"{len(left)} processes are left"] if left else []
    if code in (0, -sign) and (folder / JSON).exists():  # as the interpreter was leaving
        return "just ended", wrong + traces(out, err) + stray(folder)
    wrong += [] if code == 130 else [f"exit code {code}"]
    wrong += traces(out, err)
    if "before there was a result" in err:
        return "no answer yet", wrong + stray(folder)
    return "answers", wrong + interrupted_files(folder) + stray(folder)


def interrupted_files(folder):
    """What is wrong with the results of an interrupted run."""
    try:
        content = json.loads((folder / JSON).read_text())
        wrong = [] if content["status"] == "interrupted" else [f"status {content['status']}"]
        shown = inspect_recording(folder / RECORDING)
        wrong += [] if shown["ending"] == "interrupted" else [f"recording: {shown['ending']}"]
        known = load_checkpoint(folder / CHECKPOINT).answers
        wrong += [] if len(known) >= len(content["history"]) else ["the checkpoint knows less"]
    except (OSError, ValueError, WalkingIRLError) as error:
        return [f"{type(error).__name__}: {error}"]
    return wrong


def traces(out, err):
    """Stack traces, and complaints of more than one sentence."""
    if "Traceback" in out + err:
        return [re.sub(r"\s+", " ", (out + err)[-300:])]
    return [f"errors: {err[-300:]}"] if err.count("\n") > 1 else []


def stray(folder):
    """Unfinished files."""
    return [f"{path.name} is left" for path in folder.iterdir() if path.name.endswith(".part")]
