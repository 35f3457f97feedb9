"""Kills, interrupts, full disks, broken pipes: nothing is lost, nothing is left, one sentence each.

A few instants of each fault; ``benchmarks/faults.py`` takes as many as are wanted.
"""

import os
import signal
import subprocess
import sys

import injection
import pytest

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
    from walking_irl.workers import interrupts_raised

    with pytest.raises(KeyboardInterrupt), interrupts_raised():
        try:
            os.kill(os.getpid(), signal.SIGTERM)
        except KeyboardInterrupt:
            raise TypeError("as NumPy's promotion of dtypes does") from None
    with pytest.raises(TypeError), interrupts_raised():
        raise TypeError("nobody has interrupted")


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
