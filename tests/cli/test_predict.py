"""``walking-irl predict``: what it prints, writes and refuses."""

import json

import numpy as np
import pytest

from walking_irl.cli.main import main
from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.gait.files import load_gait

PLANAR = ("--domain", "humanoid-planar", "--weights", "1,2,1,1,1,5")


@pytest.fixture
def call(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def run(*argv):
        try:
            code = main(["predict", *map(str, argv)])
        except SystemExit as leave:
            code = leave.code
        return code, *capsys.readouterr()

    return run


@pytest.mark.slow
def test_a_slope_with_a_pack_beside_level_ground(call, tmp_path):
    files = ("--save", "g.npz", "--json", "g.json")
    code, out, err = call(*PLANAR, "--slope", 3, "--load", 8, *files)
    assert code == 0 and not err
    assert "price of time" in out and "range of knee" in out
    content = json.loads((tmp_path / "g.json").read_text())
    assert content["slope"] == 3 and content["load"] == 8
    assert content["there"]["cost"] > 1.05 * content["level"]["cost"]  # it climbs, and carries
    w = np.array(content["w"])
    assert content["level"]["cost"] == pytest.approx(w @ content["level"]["total_costs"])
    gait = load_gait(tmp_path / "g.npz", load_walker("humanoid-planar"))
    assert gait.speed == pytest.approx(content["there"]["speed"], rel=1e-3)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (("--slope", 50), "slope"),
        (("--slope", "nan"), "slope"),
        (("--load", -3), "load"),
        (("--speed", 0), "speed"),
        (("--speed", "inf"), "speed"),
        (("--weights", "1,2"), "weights"),
        (("--domain", "lqr"), "lqr"),
        (("--save", "g.mot"), "g.mot"),
    ],
)
def test_wrong_options(call, options, word):
    code, out, err = call(*PLANAR, *options)
    assert code == 2 and not out and word in err and err.count("\n") == 1
