"""A run that was cut short goes on as if it had not been; all figures come from its checkpoint."""

import json
from dataclasses import replace

import numpy as np
import pytest

from walking_irl.cli import terminal
from walking_irl.cli.main import main
from walking_irl.domains import DOMAINS, WALKERS
from walking_irl.errors import InvalidInputError
from walking_irl.recording.reader import inspect_recording
from walking_irl.run.checkpoint import Checkpoint, CheckpointFile, Replay, load_checkpoint
from walking_irl.run.problem import prepare
from walking_irl.run.setup import Setup

TOYS = [name for name in DOMAINS if name not in WALKERS]


@pytest.fixture
def call(capsys, tmp_path, monkeypatch):
    """Runs ``recover`` in an empty folder: exit code, output, errors."""
    monkeypatch.chdir(tmp_path)

    def run(*argv):
        code = main(["recover", *map(str, argv)])
        return code, *capsys.readouterr()

    return run


def results(path):
    """All figures of a run, but clocks and file names."""
    content = json.loads(path.read_text())
    for name in ("seconds", "recording", "checkpoint"):
        del content[name]
    return content


def same_after_resuming(call, folder, *argv, code=0):
    assert call(*argv, "--record", "whole.rrd", "--json", "whole.json")[0] == code
    assert call(*argv, "--max-solves", 1, "--record", "short.rrd", "--json", "short.json")[0] == 1
    assert len(results(folder / "short.json")["history"]) == 1
    got, out, err = call(
        *("--resume", "short.checkpoint.npz", "--max-solves", 100),
        *("--record", "resumed.rrd", "--json", "resumed.json"),
    )
    assert got == code and not err and "1 known from before" in out
    assert results(folder / "resumed.json") == results(folder / "whole.json")
    whole, resumed = (inspect_recording(folder / f"{n}.rrd") for n in ("whole", "resumed"))
    for key in ("entities", "iterations", "frames", "w", "intervals", "status"):
        assert whole[key] == resumed[key], key


@pytest.mark.parametrize("domain", TOYS)
def test_a_resumed_run_is_the_whole_run(call, tmp_path, domain):
    same_after_resuming(call, tmp_path, "--domain", domain)


def test_a_resumed_run_keeps_centre_and_mode(call, tmp_path):
    options = ("--expert", "suboptimal", "--centre", "cg", "--mode", "minimise")
    same_after_resuming(call, tmp_path, "--domain", "lqr", *options)


@pytest.mark.slow
def test_a_recorded_walker_is_resumed(call, tmp_path):
    same_after_resuming(call, tmp_path, "--domain", "humanoid-planar", "--rollouts", 5)


def test_the_checkpoint_is_whole_after_every_solve(call, tmp_path, monkeypatch):
    known = []

    def look(it, report):
        known.append(len(load_checkpoint(tmp_path / "lqr.checkpoint.npz").answers))
        if len(known) == 4:
            raise KeyboardInterrupt
        return "line"

    monkeypatch.setattr(terminal, "progress_line", look)
    code, out, _ = call("--domain", "lqr")
    assert code == 130 and known == [1, 2, 3, 4]
    assert "recover --resume lqr.checkpoint.npz" in out


def test_known_answers_are_not_solved_again():
    w = np.full(3, 1 / 3)
    known = prepare(Setup(domain="lqr")).learner.forward(w)

    def fail(w):
        raise AssertionError("solved again")

    forward = Replay(fail, [(w, known)])
    assert forward(w + 1e-12) is known
    with pytest.raises(AssertionError):
        forward(np.array([0.5, 0.25, 0.25]))


@pytest.mark.parametrize("domain", TOYS)
def test_a_run_survives_the_disk(tmp_path, domain):
    setup = Setup(domain=domain, weights=None, max_solves=7)
    problem = prepare(setup)
    shown, K = problem.demonstration, len(problem.objectives)
    w = np.full(K, 1 / K)
    response = problem.learner.forward(w)
    CheckpointFile(tmp_path / "a.npz").save(Checkpoint(setup, shown, [(w, response)]))
    again = load_checkpoint(tmp_path / "a.npz")
    assert again.setup == setup
    assert np.array_equal(again.demonstration.expert.mu, shown.expert.mu)
    assert np.array_equal(again.demonstration.truth.w, problem.w_expert)
    [(asked, answer)] = again.answers
    assert np.array_equal(asked, w) and np.array_equal(answer.mu, response.mu)
    assert answer.info == dict(response.info)
    if response.sensitivity is None:
        assert answer.sensitivity is None
    else:
        assert np.array_equal(answer.sensitivity, response.sensitivity)
    pack = problem.domain.pack
    assert np.array_equal(pack(answer.policy), pack(response.policy))


@pytest.mark.parametrize("number", [np.inf, -np.inf, np.float64("inf"), np.float32(0.1), 1e-320])
def test_whatever_a_solver_says_of_an_answer_survives_the_disk(tmp_path, number):
    """An indefinite Hessian has an infinite decrement; lost, a resumed run would tell less."""
    setup = Setup(domain="lqr", weights=None, max_solves=1)
    problem = prepare(setup)
    w = np.full(len(problem.objectives), 1 / len(problem.objectives))
    said = {"decrement": number, "many": [1.0, -np.inf], "status": "stuck", "is_stalled": True}
    response = replace(problem.learner.forward(w), info=said)
    CheckpointFile(tmp_path / "a.npz").save(
        Checkpoint(setup, problem.demonstration, [(w, response)])
    )
    [(_, answer)] = load_checkpoint(tmp_path / "a.npz").answers
    assert answer.info == said


def test_a_file_that_grows_holds_what_one_written_at_once_holds(tmp_path):
    setup = Setup(domain="lqr", weights=None, max_solves=7)
    problem = prepare(setup)
    W = np.eye(len(problem.objectives)) * 0.7 + 0.1
    answers = [(w, problem.learner.forward(w)) for w in W]
    growing, shown = CheckpointFile(tmp_path / "grown.npz"), problem.demonstration
    for n in range(len(answers) + 1):
        growing.save(Checkpoint(setup, shown, answers[:n]))
    other = [answers[1], answers[0], *answers[2:]]  # not what stands there: begun anew
    for run, name in ((answers, "at_once"), (other, "other")):
        CheckpointFile(tmp_path / f"{name}.npz").save(Checkpoint(setup, shown, run))
    for name in ("at_once", "other"):
        if name == "other":
            growing.save(Checkpoint(setup, shown, other))
        with np.load(tmp_path / "grown.npz") as grown, np.load(tmp_path / f"{name}.npz") as whole:
            assert sorted(grown.files) == sorted(whole.files)
            assert all(np.array_equal(grown[key], whole[key]) for key in whole.files)


# --- files that cannot be resumed


@pytest.fixture
def checkpoint(call, tmp_path):
    call("--domain", "lqr", "--max-solves", 2)
    return tmp_path / "lqr.checkpoint.npz"


def complaint(call, *argv):
    code, _, err = call(*argv)
    assert code == 2 and err.count("\n") == 1 and "Traceback" not in err, err
    return err


def test_a_missing_checkpoint(call):
    assert "no file none.npz" in complaint(call, "--resume", "none.npz")


@pytest.mark.parametrize("content", [b"", b"no checkpoint", b"PK\x03\x04" + bytes(40)])
def test_an_unreadable_checkpoint(call, tmp_path, content):
    (tmp_path / "bad.npz").write_bytes(content)
    assert "not a readable .npz" in complaint(call, "--resume", "bad.npz")


def test_half_a_checkpoint(call, checkpoint, tmp_path):
    content = checkpoint.read_bytes()
    (tmp_path / "half.npz").write_bytes(content[: len(content) // 2])
    assert "half.npz" in complaint(call, "--resume", "half.npz")


def test_another_kind_of_file(call, tmp_path):
    np.savez(tmp_path / "other.npz", time=np.arange(3.0))
    assert "cannot" not in complaint(call, "--resume", "other.npz")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("mu_0", np.array([1.0, np.nan, 1.0])),
        ("expert_mu", np.ones(2)),
        ("about", np.array('{"format": 99}')),
        ("about", np.array("no JSON")),
    ],
)
def test_a_changed_checkpoint(checkpoint, name, value):
    with np.load(checkpoint) as data:
        content = {**data, name: value}
    np.savez(checkpoint, **content)
    with pytest.raises(InvalidInputError, match="can resume"):
        load_checkpoint(checkpoint)


@pytest.mark.parametrize(
    "option", [("--seed", 1), ("--centre", "cc"), ("--domain", "lqr"), ("--rollouts", 3)]
)
def test_a_resumed_run_takes_no_other_settings(call, checkpoint, option):
    assert option[0] in complaint(call, "--resume", checkpoint, *option)


def test_a_resumed_run_keeps_its_answers_where_it_was_told(call, tmp_path):
    assert (
        call("--domain", "lqr", "--max-solves", 3, "--no-record", "--checkpoint", "a.npz")[0] == 1
    )
    resumed = ("--resume", "a.npz", "--checkpoint", "b.npz", "--max-solves", 1, "--no-record")
    assert "--resume b.npz" in call(*resumed)[1]
    first, second = load_checkpoint(tmp_path / "a.npz"), load_checkpoint(tmp_path / "b.npz")
    assert len(first.answers) == len(second.answers) == 3


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("w_expert", np.ones(2)),
        ("true_mu", np.ones(2)),
        ("evaluated_0", np.ones((2, 2))),
        ("sensitivity_0", np.full((3, 3), np.nan)),
    ],
)
def test_checkpoints_with_other_arrays_are_named(call, tmp_path, name, value):
    assert (
        call("--domain", "lqr", "--max-solves", 3, "--no-record", "--checkpoint", "a.npz")[0] == 1
    )
    with np.load(tmp_path / "a.npz") as data:
        arrays = {**data, name: value}
    np.savez(tmp_path / "b.npz", **arrays)
    code, _, err = call("--resume", "b.npz", "--no-record")
    assert code == 2 and "not a run that this version can resume" in err


def test_checkpoints_of_the_first_format_are_resumed(call, tmp_path):
    """Their settings had every domain's recording options, and no place for a domain's own."""
    assert (
        call("--domain", "lqr", "--max-solves", 3, "--no-record", "--checkpoint", "a.npz")[0] == 1
    )
    with np.load(tmp_path / "a.npz") as data:
        arrays = dict(data)
    about = json.loads(str(arrays["about"]))
    del about["setup"]["options"]
    old = {"population": "typical", "rollouts": 20, "noise": 0.02, "disturbance": "initial"}
    about |= {"format": 1, "setup": about["setup"] | old}
    np.savez(tmp_path / "old.npz", **{**arrays, "about": np.array(json.dumps(about))})
    assert load_checkpoint(tmp_path / "old.npz").setup.options == {}
    code, out, err = call("--resume", "old.npz", "--max-solves", 20, "--no-record")
    assert code == 0 and not err and "3 known from before" in out
