"""What the commands print and write."""

import csv
import json
import subprocess
import sys

import numpy as np
import pytest
from sentences import RECOVER_KEYS

from walking_irl import __version__
from walking_irl.cli.main import COMMANDS
from walking_irl.domains.humanoid.gait.files import load_gait
from walking_irl.domains.humanoid.gait.gait import whole_cycle
from walking_irl.domains.humanoid.spec import PLANAR as PLANAR_SPEC
from walking_irl.recording.reader import inspect_recording

PLANAR = ("--domain", "humanoid-planar")
GAIT_KEYS = {
    "objectives", "w", "mu", "speed", "step_length", "cadence", "stance_fraction", "joint_ranges",
    "cost_of_transport", "peak_vertical_force", "max_root_residual", "realism", "solver",
}  # fmt: skip


@pytest.mark.parametrize("command", [(), *((c,) for c in COMMANDS)], ids=lambda c: c or "all")
def test_help_of_every_command(call, command):
    code, out, err = call(*command, "--help")
    assert code == 0 and "usage: walking-irl" in out and not err


def test_runs_as_a_module_and_tells_its_version():
    argv = [sys.executable, "-m", "walking_irl", "--version"]
    out = subprocess.run(argv, capture_output=True, text=True, check=True).stdout
    assert out.strip() == f"walking-irl {__version__}"


def test_domains_lists_names_objectives_and_solvers(call):
    code, out, _ = call("domains")
    assert code == 0
    for word in ("humanoid", "humanoid-planar", "lqr", "stability", "inverse dynamics", "Riccati"):
        assert word in out


def test_recover_lqr_prints_and_writes_the_whole_contract(call, tmp_path):
    code, out, err = call("recover", "--domain", "lqr", "--seed", 3, "--json", "out.json")
    assert code == 0 and not err
    content = json.loads((tmp_path / "out.json").read_text())
    assert content.keys() >= RECOVER_KEYS
    assert content["domain"] == "lqr" and content["seed"] == 3 and content["mode"] == "optimal"
    assert content["contains_expert"] is True and content["l1_error"] < 1e-3
    assert set(content["seconds"]) == {"total", "forward", "centre", "expert", "recording"}
    assert content["history"][0].keys() >= {"k", "w", "mu", "regret", "certificate", "intervals"}
    assert len(content["history"]) == content["forward_solves"] + content["probe_solves"]
    assert content["recording"] == "lqr.rrd" and "lqr.rrd" in out
    assert inspect_recording(tmp_path / "lqr.rrd")["seed"] == 3
    assert "ground truth" in out and "certificate" in out and "L1 error" in out


def test_recover_says_how_it_understood_weights(call):
    code, out, _ = call("recover", "--domain", "lqr", "--weights", "2,1,1", "--no-record")
    assert code == 0 and "0.5000, 0.2500, 0.2500" in out


def test_recover_without_success_exits_1_and_says_why(call, tmp_path):
    argv = ("recover", "--domain", "lqr", "--max-solves", 1, "--no-record", "--json", "out.json")
    code, out, err = call(*argv)
    assert code == 1 and "budget" in out and not err
    assert "budget" in json.loads((tmp_path / "out.json").read_text())["status"]


def test_recover_planar_exactly(call, tmp_path):
    argv = ("recover", *PLANAR, "--rollouts", 0, "--json", "out.json", "--record", "out.rrd")
    code, out, err = call(*argv)
    assert code == 0 and not err and "newton" in out
    content = json.loads((tmp_path / "out.json").read_text())
    assert content.keys() >= RECOVER_KEYS
    assert content["contains_expert"] is True and content["l1_error"] <= 0.005
    assert abs(content["relative_loss"]) < 1e-4
    assert content["solves_to_1pct"] <= content["forward_solves"]
    assert len(content["w"]) == len(content["objectives"]) == 6
    code, out, _ = call("inspect", "out.rrd", "--json", "inspected.json")
    assert code == 0 and "effort" in out and "/world/walker" in out
    inspected = json.loads((tmp_path / "inspected.json").read_text())
    assert np.allclose(inspected["w"], content["w"])
    assert inspected["has_blueprint"] and inspected["iterations"] == len(content["history"])
    assert "per raw unit" in out and "per (100 W)" in out
    found = content["summary"]
    assert np.allclose(inspected["physical_intervals"], found["physical_intervals"])
    assert f"rule: {found['rule']}" in " ".join(out.split())
    assert f"weakest: {found['weakest']}" in out and "volume ratio: " in out and "noise: " in out


@pytest.mark.slow
def test_gait_writes_every_kind_of_file_and_reads_its_own(call, tmp_path, planar):
    weights = ",".join(map(str, PLANAR_SPEC.stack.reference_weights))
    argv = ("gait", *PLANAR, "--weights", weights, "--seconds", 2)
    code, out, err = call(
        *argv, "--save", "g.npz", "--png", "g.png", "--json", "g.json", "--record", "g.rrd",
        "--video", "g.gif",
    )  # fmt: skip
    assert code == 0 and not err and "step length" in out
    content = json.loads((tmp_path / "g.json").read_text())
    assert content.keys() >= GAIT_KEYS and content["max_root_residual"] < 5e-4
    assert (tmp_path / "g.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "g.gif").read_bytes().startswith(b"GIF89a")
    assert inspect_recording(tmp_path / "g.rrd")["frames"] > 0
    assert call(*argv, "--save", "g.csv", "--quiet") == (0, "", "")
    with (tmp_path / "g.csv").open(newline="") as file:
        names, *rows = list(csv.reader(file))
    with np.load(tmp_path / "g.npz") as data:
        assert names == data.files == ["time", *planar.joints]
        table = np.column_stack([data[name] for name in names])
    assert np.allclose(table, np.array(rows, dtype=float), atol=1e-12)
    saved = load_gait(tmp_path / "g.csv", planar)
    assert np.allclose(whole_cycle(saved, planar.mirror), table[:, 1:], atol=1e-6)


def test_saved_gait_is_a_demonstration(call, tmp_path, demonstration):
    argv = ("recover", *PLANAR, "--demonstration", demonstration[0], "--json", "out.json")
    code, out, err = call(*argv, "--no-record")
    assert code == 0 and not err and "ground" not in out
    content = json.loads((tmp_path / "out.json").read_text())
    assert content["w_expert"] is content["l1_error"] is content["seed"] is None
    assert content["contains_expert"] is content["relative_loss"] is None
    assert np.abs(np.array(content["w"]) - PLANAR_SPEC.stack.reference_weights).sum() < 0.01


def test_terminal_says_how_sure_the_weights_are(call):
    code, out, _ = call("recover", "--domain", "lqr", "--no-record")
    assert code == 0
    for part in ("certificate", "suboptimality of the expert: at most", "weights: the ",
                 "half widths: from the expert's possible",
                 "of the volume of all is left", "least certain: axis",
                 "features of the expert: known exactly", "L1 error"):  # fmt: skip
        assert part in out, part


def test_huge_numbers_are_understood_or_named(call, complaint):
    huge = ("recover", "--domain", "lqr", "--no-record", "--weights", "1e308,1e308,1e308")
    code, out, err = call(*huge)
    assert code == 0 and not err and "0.3333, 0.3333, 0.3333" in out
    sentence = complaint("recover", "--domain", "lqr", "--seed", 2**63)
    assert "seed must be a whole number" in sentence
