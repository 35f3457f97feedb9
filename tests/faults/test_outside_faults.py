"""Kills, interrupts, full disks, broken pipes: nothing is lost, nothing is left, one sentence each.

A few instants of each fault; ``benchmarks/faults.py`` takes as many as are wanted.
"""

import json
import os
import signal
import subprocess
import sys

import injection
import pytest

from walking_irl import experiments
from walking_irl.domains import lqr
from walking_irl.errors import RecordingError
from walking_irl.experiments import study
from walking_irl.experiments.study.expert import ExpertJob
from walking_irl.recording import Recorder, stream
from walking_irl.run import session
from walking_irl.run.setup import Setup
from walking_irl.workers import interrupts_raised

JOB = ("--domain", "gridworld", "--seed", "2")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Figures and seconds of a run that nothing happens to."""
    return injection.whole_run(tmp_path_factory.mktemp("whole"), JOB)


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.1, 0.5, 0.7, 0.9])
def test_a_killed_run_goes_on_to_the_same_figures_bit_by_bit(tmp_path, whole, share):
    found = injection.killed(tmp_path, JOB, whole[0], share * whole[1])
    assert found is None or found[1] == []


@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 4])
def test_a_kill_in_mid_write_leaves_the_file_before_it(tmp_path, whole, n):
    where, wrong = injection.killed_in_write(tmp_path, JOB, whole[0], n)
    assert wrong == [], where


@pytest.mark.slow
@pytest.mark.parametrize("sign", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("share", [0.2, 0.6, 0.8])
def test_an_interrupted_run_keeps_what_is_done(tmp_path, whole, sign, share):
    found = injection.stopped(tmp_path, JOB, sign, share * whole[1])
    assert found is None or found[1] == []


@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 3, 6])
def test_a_full_disk_is_told_and_leaves_no_torn_file(tmp_path, whole, n):
    where, wrong = injection.full_disk(tmp_path, JOB, whole[0], n)
    assert wrong == [], where


@pytest.mark.slow
def test_two_runs_in_one_folder_leave_whole_files(tmp_path):
    argv = [sys.executable, "-m", "walking_irl", "recover", *JOB, "--quiet"]
    both = [
        subprocess.Popen(argv, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        for _ in range(2)
    ]
    for process in both:
        _, err = process.communicate(timeout=injection.PATIENCE)
        assert process.returncode == 0 and not err, err
    assert injection.inspect_recording(tmp_path / "gridworld.rrd")["ending"] is None
    assert injection.load_checkpoint(tmp_path / "gridworld.checkpoint.npz").answers
    assert injection.stray(tmp_path) == []


@pytest.mark.slow
def test_a_reader_that_leaves_does_not_end_the_run(tmp_path):
    argv = [sys.executable, "-m", "walking_irl", "recover", *JOB, "--json", "out.json"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(argv, cwd=tmp_path, **pipes) as process:
        assert process.stdout.readline()
        process.stdout.close()
        err = process.stderr.read()
        assert process.wait(timeout=injection.PATIENCE) == 0 and not err
    assert injection.figures(tmp_path / "out.json")["contains_expert"]


def test_an_interrupt_that_foreign_code_renames_is_an_interrupt():
    with pytest.raises(KeyboardInterrupt), interrupts_raised():
        try:
            os.kill(os.getpid(), signal.SIGTERM)
        except KeyboardInterrupt:
            raise TypeError("as NumPy's promotion of dtypes does") from None
    with pytest.raises(TypeError), interrupts_raised():
        raise TypeError("nobody has interrupted")


def renamed_interrupt(*_, **__):
    """An interrupt that hits code which makes another error of it."""
    try:
        signal.raise_signal(signal.SIGTERM)
    except KeyboardInterrupt:
        raise TypeError("as NumPy's promotion of dtypes does") from None


@pytest.mark.parametrize("moment", ["drawing", "solving", "scoring"])
def test_a_run_whose_interrupt_is_renamed_is_interrupted(call, tmp_path, monkeypatch, moment):
    """By name everywhere: exit code, report and recording; what is done is kept."""
    solve, learn, asked = lqr.LQR.forward, session._learn, []

    def forward(self, w):
        asked.append(moment)
        if asked[0] == "learnt" or (moment == "solving" and len(asked) == 5):
            renamed_interrupt()
        return solve(self, w)

    def learning(*how):
        learn(*how)
        if moment == "scoring":
            asked[0] = "learnt"

    monkeypatch.setattr(lqr.LQR, "forward", forward)
    monkeypatch.setattr(session, "_learn", learning)
    if moment == "drawing":
        monkeypatch.setattr(Recorder, "finale", renamed_interrupt)
    code, _, err = call("recover", "--domain", "lqr", "--json", "out.json", "--record", "a.rrd")
    content = json.loads((tmp_path / "out.json").read_text())
    shown = injection.inspect_recording(tmp_path / "a.rrd")
    assert not err and len(content["history"]) == shown["iterations"] >= 2
    known = injection.load_checkpoint(tmp_path / content["checkpoint"]).answers
    assert len(known) == len(content["history"])
    if moment == "scoring":  # the result does not hang on it
        assert code == 0 and shown["ending"] is None
    else:
        assert code == 130 and shown["ending"] == content["status"] == "interrupted"


def test_a_recording_that_fails_after_a_renamed_interrupt_is_told(call, tmp_path, monkeypatch):
    def full(*_):
        raise RecordingError("no space left")

    monkeypatch.setattr(Recorder, "finale", renamed_interrupt)
    monkeypatch.setattr(stream, "write_file", full)
    code, _, err = call("recover", "--domain", "lqr", "--json", "out.json", "--record", "a.rrd")
    content = json.loads((tmp_path / "out.json").read_text())
    assert code == 2 and "no space left" in err and content["recording"] is None
    assert content["history"]


def test_studies_and_tables_whose_interrupt_is_renamed_say_where_they_go_on(call, monkeypatch):
    monkeypatch.setattr(study, "run_study", renamed_interrupt)
    monkeypatch.setattr(experiments, "run_tables", renamed_interrupt)
    for argv in (("study", "--domain", "lqr"), ("tables", "7.3", "--out", "t")):
        code, out, err = call(*argv)
        assert code == 130 and not err and "goes on from there" in out
    monkeypatch.setattr(session, "run", renamed_interrupt)
    with pytest.raises(KeyboardInterrupt), interrupts_raised():
        ExpertJob(Setup(domain="lqr")).run()


@pytest.mark.slow
def test_a_script_without_a_guard_is_told_in_one_sentence(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "from walking_irl.workers import run_tasks, workers\n"
        "with workers() as executor:\n"
        "    print(run_tasks(abs, [(-1,)], executor))\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=60)
    assert done.returncode != 0
    assert done.stderr.count("__main__") == 1 and done.stderr.count("\n") < 60


def test_an_empty_argument_is_told(complaint):
    assert "--record is empty" in complaint("recover", "--domain", "lqr", "--record", "")
    assert "--json is empty" in complaint("recover", "--domain", "lqr", "--json=")
    assert "an argument is empty" in complaint("inspect", "")


@pytest.mark.slow
def test_an_earlier_run_under_a_default_name_is_kept(call, tmp_path):
    for n in range(3):
        code, out, _ = call("recover", "--domain", "lqr", "--seed", n, "--quiet")
        assert code == 0 and ("an earlier run is kept" in out) == (n > 0)
    seeds = {
        name: injection.inspect_recording(tmp_path / name)["seed"]
        for name in ("lqr.1.rrd", "lqr.2.rrd", "lqr.rrd")
    }
    assert list(seeds.values()) == [0, 1, 2]
    assert (tmp_path / "lqr.2.checkpoint.npz").exists()
    call("recover", "--domain", "lqr", "--quiet", "--record", "lqr.rrd")
    assert not (tmp_path / "lqr.3.rrd").exists(), "a name that is given may be overwritten"
