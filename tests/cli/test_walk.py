"""``recover --walk``: what it refuses, and a person's answer from file to table."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from person_files import force_plates, recording, storage
from rich.console import Console

from walking_irl.cli import walk as command
from walking_irl.cli.main import main
from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.costs.defaults import REFERENCE_WEIGHTS
from walking_irl.domains.humanoid.gait.library import load_gaits
from walking_irl.domains.humanoid.recorded.feasible import Feasible
from walking_irl.domains.humanoid.spec import HUMANOID
from walking_irl.errors import InvalidInputError
from walking_irl.recording.reader import Recording, inspect_recording
from walking_irl.run import walk as module

WALKER = load_walker()
GAIT = load_gaits()["reference"]


@pytest.fixture
def walked(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "w.mot").write_text(storage(recording(GAIT, WALKER)))
    return "w.mot"


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (("--seed", 3), "--seed"),
        (("--mode", "minimise"), "--mode"),
        (("--weights", "1,1,1,1,1,1"), "--weights"),
        (("--rollouts", 5), "--rollouts"),
        (("--method", "maxent"), "--method"),
        (("--resume", "a.npz"), "--resume"),
        (("--json", "no/where.json"), "where"),
    ],
)
def test_options_without_effect_are_named(walked, capsys, options, word):
    assert main(["recover", "--walk", walked, *map(str, options)]) == 2
    out, err = capsys.readouterr()
    assert not out and word in err and err.count("\n") == 1


@pytest.mark.parametrize("options", [("--accept-habit",), ("--height", "1.8"), ("--from", "0")])
def test_what_is_said_of_a_recording_needs_one(walked, capsys, options):
    assert main(["recover", *options]) == 2
    err = capsys.readouterr().err
    assert options[0] in err and "--walk" in err


def test_a_recording_is_read_as_the_user_knows_it(walked, capsys, monkeypatch):
    """A part of it, and a height: the same as ``read`` takes."""
    seen = []

    def stop(person, *others):
        seen.append(person)
        raise InvalidInputError("far enough")

    monkeypatch.setattr(command, "_explain", stop)
    assert main(["recover", "--walk", walked]) == 2
    assert main(["recover", "--walk", walked, "--to", "1.5", "--height", "2.0"]) == 2
    whole, part = seen
    assert part.seconds < 1.6 < whole.seconds and part.scale < 0.95 * whole.scale
    assert main(["recover", "--walk", walked, "--belt", "nan"]) == 2
    assert "belt must be a number" in capsys.readouterr().err


def test_what_is_no_recording_is_refused_before_anything_is_solved(walked, capsys, tmp_path):
    (tmp_path / "empty.mot").write_text("")
    assert main(["recover", "--walk", walked, "--walk", "empty.mot"]) == 2
    out, err = capsys.readouterr()
    assert "empty.mot" in err and not out


def test_no_weights_are_told_of_what_is_no_habit_of_this_body(walked, monkeypatch, capsys):
    """The nearest gait is as far off as that of a person who crouches."""
    apart = {"hip_flexion": 14.0, "knee": 25.0, "ankle": 9.0, "elbow": 3.0}
    far = Feasible(GAIT, np.ones(6), 0.1, 1e-6, apart, "up", 1)
    monkeypatch.setattr(module, "nearest", lambda *args: far)
    assert main(["recover", "--walk", walked, "--no-record"]) == 2
    out, err = capsys.readouterr()
    assert "weights:" not in out and err.count("\n") == 1
    assert "not a habit of the body" in err and "--accept-habit" in err and "knee 25" in err


@pytest.mark.slow
def test_a_person_s_answer_comes_in_its_order(walked, monkeypatch, capsys, tmp_path):
    """One start; the model's own walk is nearly optimal for its own weights."""
    monkeypatch.setattr(module, "starting_weights", lambda reference: reference[None])
    (tmp_path / "w_grf.mot").write_text(storage(force_plates(GAIT, WALKER), degrees=None))
    who = ("--walk", walked, "w_grf.mot")
    argv = ["recover", *who, *who, "--json", "out.json", "--record", "w.rrd"]
    again = command._explain
    known = []

    def once(*args):  # the second person is the first
        known.append(known[0] if known else again(*args))
        return known[-1]

    monkeypatch.setattr(command, "_explain", once)
    assert main(argv) == 0
    out = capsys.readouterr().out
    places = [out.index(f"\n{k}. ") for k in range(1, 6)]
    assert places == sorted(places) and "w.mot, w_grf.mot against w.mot" in out
    assert "vertical force 0.0" in out  # the model's own, within .1 body weights
    recording = Recording(tmp_path / "w.rrd")
    for who in ("/world/walker", "/world/expert", "/world/nearest", "/polyhedron", "/norms/knee"):
        assert any(e.startswith(who) for e in recording.entities), who
    assert "# What does this person walk for?" in recording.summary
    assert "half width" in recording.summary and "most for it" in recording.summary
    known = inspect_recording(tmp_path / "w.rrd")
    content = json.loads((tmp_path / "out.json").read_text())
    (comparison,) = content["comparisons"]
    assert comparison["people"] == 2 * ["w.mot, w_grf.mot"] and not any(comparison["beyond"])
    assert "differ in no weight beyond" in out
    person = content["people"][0]
    low, high = person["suboptimality"]
    assert 0 <= low <= high < 0.02 and person["nearest"]["sagittal"] < 2.0
    w, half = np.array(person["w"]), np.array(person["half_widths"])
    assert known["w"] == pytest.approx(w) and known["iterations"] >= 1
    assert w.sum() == pytest.approx(1) and (half >= module.NARROWEST).all()
    assert np.all(np.abs(w - REFERENCE_WEIGHTS) <= half)


def test_weights_that_differ_beyond_their_half_widths_are_named(capsys):
    """Two people of made-up answers: only the time differs by more than both half widths."""

    def answer(name, w, half):
        person = SimpleNamespace(sources=(Path(name),))
        return command.Answer(person, None, SimpleNamespace(w=np.array(w), half=np.array(half)))

    a = answer("a.mot", [0.2, 0.1, 0.1, 0.1, 0.1, 0.4], [0.06] * 6)
    b = answer("b.mot", [0.3, 0.15, 0.1, 0.1, 0.1, 0.25], [0.08] * 6)
    command._compare(a, b, HUMANOID, Console(width=80))
    out = capsys.readouterr().out
    assert "a.mot against b.mot" in out and "They differ in time, beyond" in out
    assert [line.split("│")[1].strip() for line in out.splitlines() if "yes" in line] == ["time"]
