import json
from dataclasses import replace

import numpy as np
import pytest

from walking_irl.baselines.registry import METHODS
from walking_irl.cli.main import main
from walking_irl.domains.mdp.random_mdp import RandomMDP
from walking_irl.rl.demonstrations import Demonstrations


def test_methods_are_listed_with_where_they_run(capsys):
    assert main(["methods"]) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in METHODS)


def test_another_method_prints_its_table_and_writes_its_figures(capsys, tmp_path):
    path = tmp_path / "out.json"
    arguments = ["recover", "--method", "mce-likelihood", "--domain", "random-mdp"]
    assert main([*arguments, "--trajectories", "20", "--no-record", "--json", str(path)]) == 0
    out = capsys.readouterr().out
    content = json.loads(path.read_text())
    assert content["method"] == "mce-likelihood"
    assert content["trajectories"] == 20
    for name, w in zip(content["objectives"], content["weights"], strict=True):
        assert name in out and f"{w:.4f}" in out
    assert "loss of the recovered policy" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--method", "mmp", "--mode", "set"], "--mode: CPIRL only"),
        (["--method", "mmp", "--domain", "lqr"], "needs finitely many states"),
        (["--trajectories", "3"], "--trajectories goes with --method"),
        (["--method", "girl", "--domain", "lqr", "--horizon", "5"], "sees the expert itself"),
        (["--method", "mmp", "--domain", "gridworld", "--horizon", "0"], "got 100 of 0"),
        (["--method", "maxi"], "unknown method 'maxi'"),
    ],
)
def test_what_cannot_run_is_one_sentence(arguments, message, capsys):
    assert main(["recover", *arguments]) == 2
    err = capsys.readouterr().err
    assert message in err and err.count("\n") == 1


GIRL = ["recover", "--method", "girl", "--domain", "lqr"]


def test_the_recording_is_called_as_domain_and_method_and_an_earlier_one_is_kept(
    capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert main([*GIRL, "--json", "a.json"]) == 0
    assert "recording lqr-girl.rrd: walking-irl view lqr-girl.rrd" in capsys.readouterr().out
    assert json.loads((tmp_path / "a.json").read_text())["recording"] == "lqr-girl.rrd"
    first = (tmp_path / "lqr-girl.rrd").read_bytes()
    assert main([*GIRL, "--seed", "1"]) == 0
    assert "an earlier run is kept: lqr-girl.1.rrd" in capsys.readouterr().out
    assert (tmp_path / "lqr-girl.1.rrd").read_bytes() == first
    assert main(["inspect", "lqr-girl.rrd"]) == 0
    out = capsys.readouterr().out
    assert "method: girl" in out and "ground truth" in out and "axis 3" in out


def test_no_record_writes_none_and_record_names_the_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main([*GIRL, "--no-record"]) == 0
    assert not list(tmp_path.iterdir())
    for _ in range(2):  # a file that a user names is written over, as for other recoveries
        assert main([*GIRL, "--record", "mine.rrd"]) == 0
    assert [p.name for p in tmp_path.iterdir()] == ["mine.rrd"]


@pytest.mark.parametrize(
    ("path", "message"),
    [("mine.mp4", "expected a file name in .rrd"), ("none/mine.rrd", "none"), ("mine.json", "rrd")],
)
def test_a_recording_that_cannot_be_written_is_said_before_the_method_runs(
    path, message, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("walking_irl.run.by_method.recover_by", lambda *a, **b: pytest.fail("ran"))
    assert main([*GIRL, "--record", path]) == 2
    err = capsys.readouterr().err
    assert message in err and err.count("\n") == 1


def test_ctrl_c_while_it_is_recorded_keeps_the_result(capsys, tmp_path, monkeypatch):
    from walking_irl.recording.method_view import MethodView

    def interrupt(*args):
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(MethodView, "log_answer", interrupt)
    assert main([*GIRL, "--json", "a.json"]) == 130
    assert "recovered" in capsys.readouterr().out
    assert json.loads((tmp_path / "a.json").read_text())["weights"]
    assert main(["inspect", "lqr-girl.rrd"]) == 0
    assert "ending: interrupted" in capsys.readouterr().out


def test_a_recording_that_fails_at_the_end_keeps_the_result(capsys, tmp_path, monkeypatch):
    from walking_irl.errors import RecordingError
    from walking_irl.recording import stream

    def full(*args):
        raise RecordingError("cannot write it: no space left")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(stream, "write_file", full)
    assert main(GIRL) == 2
    out, err = capsys.readouterr()
    assert "recovered" in out and "no space left" in err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("states", "actions", "message"),
    [
        (
            [[0, 50]],
            [[0, 0]],
            "demonstrated states must lie from 0 to 49 in this world, got 0 to 50",
        ),
        ([[-1, 3]], [[0, 0]], "demonstrated states must lie from 0 to 49"),
        ([[0, 1]], [[0, 4]], "demonstrated actions must lie from 0 to 3"),
        ([[0, 1]], [[0]], "each of 1 x 2 states needs one action, got actions of shape (1, 1)"),
        ([[0, 1]], [0, 1], "states and actions of shape (n, H)"),
        (np.empty((0, 5), int), np.empty((0, 5), int), "at least one trajectory of at least one"),
        ([[0.5, 1.0]], [[0, 1]], "must be whole numbers"),
        ([[[0.0]]], [[[np.nan]]], "must be finite"),
        ([[[0.0]]], [[[1.0]]], "a finite world needs states and actions of shape (n, H)"),
    ],
)
@pytest.mark.parametrize("method", ["mce-likelihood", "projection"])
def test_bad_demonstrations_are_one_sentence_and_exit_code_2(
    method, states, actions, message, capsys, monkeypatch
):
    monkeypatch.setattr(
        "walking_irl.run.by_method.demonstrate", lambda *a, **b: Demonstrations(states, actions)
    )
    arguments = ["recover", "--domain", "random-mdp", "--method", method, "--trajectories", "5"]
    assert main([*arguments, "--no-record"]) == 2
    err = capsys.readouterr().err
    assert message in err and err.count("\n") == 1


def test_rewards_that_are_not_finite_are_one_sentence_and_exit_code_2(capsys, monkeypatch):
    def broken(self, *args, **options):
        made(self, *args, **options)
        Phi = self.mdp.Phi.copy()
        Phi[3, 1] = np.inf
        self.mdp = replace(self.mdp, Phi=Phi)

    made = RandomMDP.__init__
    monkeypatch.setattr(RandomMDP, "__init__", broken)
    assert main(["recover", "--domain", "random-mdp", "--method", "mmp", "--no-record"]) == 2
    err = capsys.readouterr().err
    assert "features of states must be finite with shape (50, K)" in err and err.count("\n") == 1
