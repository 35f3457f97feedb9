"""The command ``study``: what it prints, what it writes, and where it goes on."""

import json
import shlex
from xml.etree import ElementTree

import pytest

from walking_irl import experiments
from walking_irl.experiments import runner, study


def test_a_study_is_told_and_written(call, tmp_path):
    code, out, err = call("study", "--domain", "lqr", "--experts", 3, "--seed", 5, "--out", "s")
    assert code == 0 and not err
    assert "study: 3 of 3 experts, done" in out and "s left" in out
    assert "3 of 3: 100.0 %" in out and out.count("worst: seed") == 3
    assert {p.name for p in (tmp_path / "s").iterdir()} == {
        "study.md", "study.csv", "study.json", "study.svg", "cells",
    }  # fmt: skip
    content = json.loads((tmp_path / "s" / "study.json").read_text())
    assert sorted(o["seed"] for o in content["outcomes"]) == [5, 6, 7]
    assert ElementTree.parse(tmp_path / "s" / "study.svg").getroot().tag.endswith("svg")
    command = content["worst"][0]["command"]
    assert call(*shlex.split(command)[1:], "--no-record", "--json", "one.json")[0] == 0
    one = json.loads((tmp_path / "one.json").read_text())
    assert one["w"] == next(o["w"] for o in content["outcomes"] if o["seed"] == one["seed"])
    again = call(*shlex.split(content["command"])[1:], "--out", "s", "--quiet")
    assert again == (0, "".join(f"s/study{e}\n" for e in (".md", ".csv", ".json", ".svg")), "")


def test_an_interrupted_study_goes_on_where_it_was(call, tmp_path, monkeypatch):
    called = []

    def third_interrupted(job):
        called.append(job.setup.seed)
        if len(called) == 3:
            raise KeyboardInterrupt
        return job.run()

    whole = study.run_study  # here, one after the other: what is done does not hang on timing
    monkeypatch.setattr(study, "run_study", lambda s, **how: whole(s, **how | {"executor": None}))
    monkeypatch.setattr(runner, "run_job", third_interrupted)
    job = ("study", "--domain", "lqr", "--experts", 5)
    code, out, err = call(*job)
    assert code == 130 and not err and "study/cells" in out
    assert len(list((tmp_path / "study" / "cells").iterdir())) == 2
    assert call(*job)[0] == 0
    assert called == [0, 1, 2, 2, 3, 4]


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (("--domain", "moon"), "unknown domain 'moon'"),
        (("--domain", "lqr", "--rollouts", "5"), "takes no rollouts"),
        (("--domain", "lqr", "--experts", "0"), "experts must be at least 1"),
        (("--domain", "lqr", "--seed", "-1"), "seed must be"),
    ],
)
def test_bad_studies_are_one_sentence(complaint, argv, message):
    assert message in complaint("study", *argv)


def test_tables_and_studies_without_distributed_say_how_to_get_it(complaint, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    for command in (("study", "--domain", "lqr", "--out", "."), ("tables", "7.3", "--out", ".")):
        sentence = complaint(*command, "--scheduler", "tcp://127.0.0.1:1")
        assert "pip install 'walking-irl[cluster]'" in sentence


def test_tables_go_where_they_are_told(call, monkeypatch):
    asked = []
    monkeypatch.setattr(experiments, "run_tables", lambda names, **how: asked.append(names) or [])
    assert call("tables", "7.3", "--quiet")[0] == 0 and asked == [["7.3"]]
