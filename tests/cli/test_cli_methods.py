import json

import pytest

from walking_irl.baselines.registry import METHODS
from walking_irl.cli.main import main


def test_methods_are_listed_with_where_they_run(capsys):
    assert main(["methods"]) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in METHODS)


def test_another_method_prints_its_table_and_writes_its_figures(capsys, tmp_path):
    path = tmp_path / "out.json"
    arguments = ["recover", "--method", "mce-likelihood", "--domain", "random-mdp"]
    assert main([*arguments, "--trajectories", "20", "--json", str(path)]) == 0
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
        (["--method", "maxi"], "unknown method 'maxi'"),
    ],
)
def test_what_cannot_run_is_one_sentence(arguments, message, capsys):
    assert main(["recover", *arguments]) == 2
    err = capsys.readouterr().err
    assert message in err and err.count("\n") == 1
