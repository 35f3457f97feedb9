"""What goes wrong on the way, and Ctrl-C: one sentence, and nothing that was done is lost."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest
from sentences import RECOVER_KEYS, one_sentence

from walking_irl import experiments
from walking_irl.cli import terminal
from walking_irl.domains.lqr import LQR
from walking_irl.errors import FallError, SolverError
from walking_irl.recording.reader import inspect_recording

PLANAR = ("--domain", "humanoid-planar")


@pytest.mark.parametrize(
    "error",
    [
        FallError("the walker fell after 1.2 s", time=1.2),
        SolverError("no gait found from 3 starts"),
        OSError(5, "Input/output error"),
    ],
    ids=lambda e: type(e).__name__,
)
def test_a_failure_on_the_way_is_one_sentence(complaint, monkeypatch, error):
    def fail(setup, executor, on_step):
        raise error

    monkeypatch.setattr("walking_irl.run.session.prepare", fail)
    assert str(error) in complaint("recover", *PLANAR)


@pytest.mark.slow
def test_a_fall_is_reported_with_its_time(complaint):
    sentence = complaint("recover", *PLANAR, "--noise", 20, "--rollouts", 2)
    assert "fell after" in sentence and "pelvis" in sentence


def test_solver_that_fails_on_the_way_loses_nothing(call, tmp_path, monkeypatch):
    solved = []
    forward = LQR.forward

    def failing(self, w):
        solved.append(w)
        if len(solved) == 5:
            raise SolverError("no gait today")
        return forward(self, w)

    monkeypatch.setattr(LQR, "forward", failing)
    code, out, err = call("recover", "--domain", "lqr", "--json", "o.json", "--record", "o.rrd")
    assert code == 1 and not err and "a forward solve failed: no gait today" in out
    content = json.loads((tmp_path / "o.json").read_text())
    assert len(content["history"]) == 4 and "no gait today" in content["status"]
    assert "--resume o.checkpoint.npz" in out
    monkeypatch.setattr(LQR, "forward", forward)
    code, out, _ = call("recover", "--resume", "o.checkpoint.npz", "--no-record")
    assert code == 0 and "4 known from before" in out


def test_result_does_not_hang_on_the_solve_that_scores_it(call, tmp_path, monkeypatch):
    calls = []
    forward = LQR.forward

    def counted(self, w):
        calls.append(w)
        return forward(self, w)

    monkeypatch.setattr(LQR, "forward", counted)
    job = ("recover", "--domain", "lqr", "--max-solves", "2", "--no-record", "--json", "o.json")
    assert call(*job)[0] == 1
    n_solves = len(calls) - 1

    def fails_last(self, w):
        calls.append(w)
        if len(calls) > n_solves:
            raise KeyboardInterrupt
        return forward(self, w)

    calls.clear()
    monkeypatch.setattr(LQR, "forward", fails_last)
    code, out, _ = call(*job)
    assert code == 1 and "budget" in out
    assert json.loads((tmp_path / "o.json").read_text())["relative_loss"] is None


def test_interrupted_tables_say_where_they_go_on(call, tmp_path, monkeypatch):
    def interrupted(*args, **settings):
        raise KeyboardInterrupt

    monkeypatch.setattr(experiments, "run_tables", interrupted)
    code, out, err = call("tables", "7.3", "--out", "t")
    assert code == 130 and not err and "t/cells" in out


def test_interrupt_keeps_what_is_done(call, tmp_path, monkeypatch):
    lines = []

    def third_time(it, report):
        lines.append(it)
        if len(lines) == 3:
            raise KeyboardInterrupt
        return "line"

    monkeypatch.setattr(terminal, "progress_line", third_time)
    code, out, err = call("recover", "--domain", "lqr", "--json", "out.json")
    assert code == 130 and not err and "interrupted" in out
    content = json.loads((tmp_path / "out.json").read_text())
    assert content["status"] == "interrupted" and len(content["history"]) == 3
    assert content.keys() >= RECOVER_KEYS
    inspected = inspect_recording(tmp_path / "lqr.rrd")
    assert inspected["ending"] == "interrupted" and inspected["iterations"] == 2


def test_interrupt_before_the_first_iteration(complaint, monkeypatch):
    def interrupt(setup, executor, on_step):
        raise KeyboardInterrupt

    monkeypatch.setattr("walking_irl.run.session.prepare", interrupt)
    assert "interrupted" in complaint("recover", "--domain", "lqr", code=130)


HEARS_INTERRUPTS = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where tests run in background
from walking_irl.cli.main import main
sys.exit(main(sys.argv[1:]))
"""


def start(folder, *argv):
    return subprocess.Popen(
        [sys.executable, "-c", HEARS_INTERRUPTS, *argv],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def interrupt(process):
    """Ctrl-C as a terminal sends it: to every process of the group."""
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=60)
    return process.returncode, out, err


@pytest.mark.slow
def test_a_real_interrupt_of_the_learner(tmp_path):
    argv = ("recover", *PLANAR, "--rollouts", "0", "--json", "out.json")
    process = start(tmp_path, *argv)
    for line in process.stdout:
        if line.startswith("    2 "):
            break
    code, out, err = interrupt(process)
    assert code == 130 and not err and "interrupted" in out
    content = json.loads((tmp_path / "out.json").read_text())
    assert content["status"] == "interrupted" and len(content["history"]) >= 2
    assert inspect_recording(tmp_path / "walking.rrd")["ending"] == "interrupted"


@pytest.mark.slow
@pytest.mark.parametrize("delay", [0.0, 0.5, 3.0])
def test_a_real_interrupt_of_the_expert(tmp_path, delay):
    process = start(tmp_path, "recover", *PLANAR)
    assert "solving for the expert" in process.stdout.readline()
    time.sleep(delay)
    code, _, err = interrupt(process)
    assert code == 130 and "interrupted" in one_sentence(err)
    assert not list(tmp_path.iterdir())
