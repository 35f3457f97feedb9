"""Worker processes: they compute what is asked, however they begin, and end with their parent."""

import os
import signal
import subprocess
import sys
import time

import pytest

from walking_irl.workers import can_be_copied, run_tasks, workers

SCRIPT = """
import os, sys, time
from walking_irl.workers import interrupts_raised, workers
def here(): return os.getpid(), sys.argv[0]
sys.argv[0] = "changed"
with interrupts_raised(), workers(copied=True) as executor:
    print(*executor.submit(here).result(), *executor._processes, flush=True)
    executor.submit(time.sleep, 60).result()
"""
FATAL = [signal.SIGINT, signal.SIGTERM] + ([signal.SIGKILL] if os.name == "posix" else [])


@pytest.mark.parametrize("copied", [False, True])
def test_workers_give_results_in_order(copied):
    with workers(copied=copied) as executor:
        assert run_tasks(abs, [(-k,) for k in range(5)], executor) == list(range(5))
        assert executor.submit(os.getpid).result() != os.getpid()


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere they are never copies")
@pytest.mark.parametrize("sign", FATAL)
def test_copies_know_what_is_loaded_and_end_with_their_parent(sign):
    argv = [sys.executable, "-c", SCRIPT]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(argv, **pipes) as parent:
        _, name, *pids = parent.stdout.readline().split()
        assert name == "changed", "a process that begins anew would not know"
        parent.send_signal(sign)
        err = parent.stderr.read()  # ends when nobody can write to it any more
        parent.wait(timeout=30)
    assert parent.returncode != 0 and err.count("Traceback") <= 1, err
    until = time.monotonic() + 10
    while any(map(is_alive, pids)):
        assert time.monotonic() < until, "a worker outlives its parent"
        time.sleep(0.05)


def is_alive(pid):
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().split()[2] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere they are never copies")
def test_a_process_of_several_threads_is_not_copied():
    script = (
        "import threading; from walking_irl.workers import can_be_copied\n"
        "print(can_be_copied())\n"
        "wait = threading.Event(); threading.Thread(target=wait.wait).start()\n"
        "print(can_be_copied()); wait.set()\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout.split() == ["True", "False"]


def test_only_linux_copies(monkeypatch):
    monkeypatch.setattr(sys, "platform", "darwin")
    assert not can_be_copied()
