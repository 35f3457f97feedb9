"""The command line: what it writes, and one clear sentence for everything that goes wrong."""

import csv
import json
import os
import resource
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from walking_irl import __version__, experiments
from walking_irl.cli import recover
from walking_irl.cli.main import main
from walking_irl.cli.view import SCREENS
from walking_irl.domains.humanoid.costs.defaults import REFERENCE_WEIGHTS
from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.domains.humanoid.gait.files import load_gait, save_gait
from walking_irl.domains.humanoid.gait.gait import whole_cycle
from walking_irl.domains.humanoid.gait.library import load_gaits
from walking_irl.domains.lqr import LQR
from walking_irl.errors import FallError, SolverError
from walking_irl.recording.reader import inspect_recording

COMMANDS = ("recover", "gait", "read", "tables", "inspect", "view", "domains")
PLANAR = ("--domain", "humanoid-planar")
RECOVER_KEYS = {
    "domain", "objectives", "centre", "mode", "seed", "w_expert", "w", "intervals",
    "contains_expert", "l1_error", "relative_loss", "regret", "certificate", "forward_solves",
    "solves_to_1pct", "status", "seconds", "history", "recording", "versions",
}  # fmt: skip
GAIT_KEYS = {
    "objectives", "w", "mu", "speed", "step_length", "cadence", "stance_fraction", "joint_ranges",
    "cost_of_transport", "peak_vertical_force", "max_root_residual", "realism", "solver",
}  # fmt: skip
WRONG_WEIGHTS = {
    "too few": "1,2,3",
    "too many": "1,1,1,1,1,1,1",
    "negative": "-1,2,1,1,1,1",
    "negative inside": "1,-2,1,1,1,1",
    "NaN": "nan,1,1,1,1,1",
    "infinite": "1,inf,1,1,1,1",
    "all zero": "0,0,0,0,0,0",
    "words": "one,two,three,four,five,six",
    "empty": "",
    "hole": "1,,1,1,1,1",
}


@pytest.fixture
def call(capsys, tmp_path, monkeypatch):
    """Runs a command in an empty folder: exit code, output and errors."""
    monkeypatch.chdir(tmp_path)

    def run(*argv):
        try:
            code = main([str(a) for a in argv])
        except SystemExit as leave:
            code = leave.code
        return code, *capsys.readouterr()

    return run


@pytest.fixture
def complaint(call, tmp_path):
    """Runs a command that must fail with code 2, one sentence and no file; returns the sentence."""

    def run(*argv, code=2):
        before = sorted(tmp_path.rglob("*"))
        got, _, err = call(*argv)
        assert got == code, err
        assert sorted(tmp_path.rglob("*")) == before
        return one_sentence(err)

    return run


def one_sentence(err):
    assert err.startswith("walking-irl: ") and err.count("\n") == 1, err
    assert "Traceback" not in err
    return err


@pytest.fixture(scope="module")
def planar():
    return Humanoid("humanoid-planar").walker


@pytest.fixture(scope="module")
def demonstration(tmp_path_factory, planar):
    """A shipped planar gait as .npz; its columns by name."""
    path = tmp_path_factory.mktemp("gait") / "gait.npz"
    save_gait(path, load_gaits("humanoid-planar")["reference"], planar)
    with np.load(path) as data:
        return path, {name: data[name] for name in data.files}


# --- what is printed and written


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
    assert content["recording"] == "walking.rrd" and "walking.rrd" in out
    assert inspect_recording(tmp_path / "walking.rrd")["seed"] == 3
    assert "hidden" in out and "certificate" in out and "L1 error" in out


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
    weights = ",".join(map(str, REFERENCE_WEIGHTS))
    argv = ("gait", *PLANAR, "--weights", weights, "--seconds", 2)
    code, out, err = call(
        *argv, "--save", "g.npz", "--png", "g.png", "--json", "g.json", "--record", "g.rrd",
        "--plot", "g.svg",
    )  # fmt: skip
    assert code == 0 and not err and "step length" in out and "within 1 s.d." in out
    content = json.loads((tmp_path / "g.json").read_text())
    assert content.keys() >= GAIT_KEYS and content["max_root_residual"] < 5e-4
    assert (tmp_path / "g.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "g.svg").read_bytes().startswith(b"<svg")
    assert content["norms"]["adults"]["curves"].keys() >= {"knee_flexion", "hip_extension_moment"}
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
    assert code == 0 and not err and "hidden" not in out
    content = json.loads((tmp_path / "out.json").read_text())
    assert content["w_expert"] is content["l1_error"] is content["seed"] is None
    assert content["contains_expert"] is content["relative_loss"] is None
    assert np.abs(np.array(content["w"]) - REFERENCE_WEIGHTS).sum() < 0.01


# --- wrong arguments


@pytest.mark.parametrize("weights", WRONG_WEIGHTS.values(), ids=WRONG_WEIGHTS.keys())
@pytest.mark.parametrize("command", ["recover", "gait"])
def test_wrong_weights(complaint, command, weights):
    assert "weights" in complaint(command, *PLANAR, "--weights", weights)


def test_wrong_weights_of_another_domain(complaint):
    assert "3 objectives" in complaint("recover", "--domain", "lqr", "--weights", "1,2")


@pytest.mark.parametrize(
    ("option", "value", "choice"),
    [
        ("--domain", "humanoid-spatial", "humanoid-planar"),
        ("--centre", "acc", "ac"),
        ("--mode", "best", "optimal"),
        ("--expert", "clumsy", "suboptimal"),
        ("--disturbance", "wind", "kicks"),
        ("--population", "normal", "uniform"),
    ],
)
def test_unknown_names_list_those_that_exist(complaint, option, value, choice):
    domain = () if option == "--domain" else PLANAR
    sentence = complaint("recover", *domain, option, value)
    assert repr(value) in sentence and choice in sentence


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--rollouts", "1"),
        ("--rollouts", "-3"),
        ("--rollouts", "many"),
        ("--noise", "-0.1"),
        ("--noise", "nan"),
        ("--seed", "-1"),
        ("--seed", "1.5"),
        ("--max-solves", "0"),
        ("--record", "walking.mp4"),
        ("--record", "walking.npz"),
        ("--frobnicate", "1"),
    ],
)
def test_wrong_options_of_recover(complaint, option, value):
    assert option.strip("-") in complaint("recover", *PLANAR, option, value) or option == "--record"


@pytest.mark.parametrize(
    "options",
    [
        ("--seconds", "0"),
        ("--seconds", "inf"),
        ("--save", "g.txt"),
        ("--png", "g.jpg"),
        ("--record", "g.mp4"),
        ("--domain", "lqr"),
    ],
)
def test_wrong_options_of_gait(complaint, options):
    complaint("gait", *PLANAR, "--weights", "1,1,1,1,1,1", *options)


def test_no_command_and_an_unknown_one(complaint):
    assert "COMMAND" in complaint()
    assert "'walk'" in complaint("walk")


# --- where nothing can be written


@pytest.mark.parametrize("option", ["--record", "--json"])
@pytest.mark.parametrize("folder", ["missing", "file/below", "x" * 300])
def test_result_in_a_folder_that_is_none(complaint, tmp_path, option, folder):
    (tmp_path / "file").write_text("not a folder")
    name = f"{folder}/walking{'.rrd' if option == '--record' else '.json'}"
    complaint("recover", "--domain", "lqr", option, name)
    assert (tmp_path / "file").read_text() == "not a folder"


@pytest.mark.parametrize("option", ["--record", "--json"])
def test_result_under_the_name_of_a_folder(complaint, tmp_path, option):
    (tmp_path / "folder.rrd").mkdir()
    assert "folder" in complaint("recover", "--domain", "lqr", option, "folder.rrd")


def test_result_into_a_read_only_folder(complaint, tmp_path, monkeypatch):
    # The tests may run as root, who may write anywhere: ask whether access was asked for.
    monkeypatch.setattr("walking_irl.files.os.access", lambda path, mode: False)
    assert "read-only" in complaint("recover", "--domain", "lqr", "--json", "out.json")


def test_a_device_is_never_replaced(complaint):
    assert "device" in complaint("recover", "--domain", "lqr", "--json", "/dev/full")
    assert "device" in complaint("gait", *PLANAR, "--weights", "1,1,1,1,1,1", "--json", "/dev/null")


def test_two_results_in_one_file(complaint):
    assert "two" in complaint("recover", "--domain", "lqr", "--record", "a.rrd", "--json", "a.rrd")


@pytest.fixture
def little_space():
    """Files cannot grow beyond 100 kB: what a full disk does, for any user."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_full_disk_loses_the_recording_but_not_the_result(call, tmp_path, little_space):
    code, out, err = call("recover", "--domain", "lqr", "--json", "out.json")
    assert code == 2 and "too large" in one_sentence(err)
    assert "L1 error" in out and "walking-irl view" not in out
    assert json.loads((tmp_path / "out.json").read_text())["recording"] is None
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out.json", "walking.archive.npz"]


def test_full_disk_keeps_an_older_file(call, tmp_path, little_space):
    (tmp_path / "walking.rrd").write_text("older")
    assert call("recover", "--domain", "lqr", "--quiet")[0] == 2
    assert (tmp_path / "walking.rrd").read_text() == "older"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["walking.archive.npz", "walking.rrd"]


def test_full_disk_under_the_json(call, tmp_path, monkeypatch):
    def full(fd):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("walking_irl.files.os.fsync", full)
    code, out, err = call("recover", "--domain", "lqr", "--no-record", "--json", "out.json")
    assert code == 2 and "No space left" in one_sentence(err) and "L1 error" in out
    assert not list(tmp_path.iterdir())


# --- files that are not what they should be


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("recording") / "lqr.rrd"
    assert main(["recover", "--domain", "lqr", "--quiet", "--record", str(path)]) == 0
    return path


@pytest.mark.parametrize("command", [("inspect",), ("view", "--png", "picture.png")], ids=" ".join)
@pytest.mark.parametrize("what", ["missing", "foreign", "empty", "truncated", "garbled", "folder"])
def test_unreadable_recordings(complaint, tmp_path, recording, command, what):
    path, content = tmp_path / "bad.rrd", recording.read_bytes()
    if what == "folder":
        path.mkdir()
    elif what != "missing":
        middle = len(content) // 2
        path.write_bytes(
            {
                "foreign": b"RIFF not a recording",
                "empty": b"",
                "truncated": content[:middle],
                "garbled": content[:middle] + bytes(4000) + content[middle + 4000 :],
            }[what]
        )
    assert "bad.rrd" in complaint(command[0], path, *command[1:])


def test_viewer_without_a_screen_names_the_way_out(complaint, recording, monkeypatch):
    for name in SCREENS:
        monkeypatch.delenv(name, raising=False)
    assert "--png" in complaint("view", recording)


def spoilt(columns, what):
    out = {name: column.copy() for name, column in columns.items()}
    if what == "missing column":
        del out["knee_r"]
    elif what == "unknown column":
        out["tail"] = out["knee_r"]
    elif what == "NaN":
        out["knee_r"][3] = np.nan
    elif what == "unequal steps":
        out["time"][5] += 0.3 * out["time"][1]
    elif what == "backwards in time":
        out["time"] = out["time"][::-1]
    elif what == "unequal lengths":
        out["knee_r"] = out["knee_r"][:-1]
    elif what == "too short":
        out = {name: column[:4] for name, column in out.items()}
    elif what == "stands":
        out["root_x"][:] = 0
    elif what == "walks backwards":
        out["root_x"] *= -1
    elif what == "flies":
        out["root_z"] += 1
    elif what == "words":
        out["knee_r"] = np.array(["bent"] * len(out["knee_r"]))
    elif what == "objects":
        out["knee_r"] = np.array([{}] * len(out["knee_r"]))
    return out


@pytest.mark.parametrize(
    ("what", "word"),
    [
        ("missing column", "knee_r"),
        ("unknown column", "tail"),
        ("NaN", "finite"),
        ("unequal steps", "time steps"),
        ("backwards in time", "time steps"),
        ("unequal lengths", "length"),
        ("too short", "8 rows"),
        ("stands", "not a walk"),
        ("walks backwards", "not a walk"),
        ("flies", "not a walk"),
        ("words", "readable"),
        ("objects", "readable"),
    ],
)
def test_unusable_demonstrations(complaint, tmp_path, demonstration, what, word):
    path = tmp_path / "bad.npz"
    np.savez(path, **spoilt(demonstration[1], what))
    sentence = complaint("recover", *PLANAR, "--demonstration", path)
    assert word in sentence and "bad.npz" in sentence


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("bad.npz", b""),
        ("bad.npz", b"PK\x03\x04 cut off"),
        ("bad.npz", b"\x93NUMPY\x01\x00v\x00{'descr': '<f8'}"),
        ("bad.csv", b""),
        ("bad.csv", b"time,knee_r\n0,1\n0.1\n"),
        ("bad.csv", b"time,knee_r\n0,bent\n"),
        ("bad.csv", b"time,time\n0,0\n"),
        ("bad.csv", b"\xff\xfe\x00binary\x00"),
        ("bad.txt", b"time\n0\n"),
    ],
)
def test_unreadable_demonstrations(complaint, tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    assert name in complaint("recover", *PLANAR, "--demonstration", name)


def test_missing_demonstration(complaint):
    assert "no file" in complaint("recover", *PLANAR, "--demonstration", "none.npz")


def test_a_single_array_named_npz(complaint, tmp_path):
    with (tmp_path / "bad.npz").open("wb") as file:
        np.save(file, np.zeros(3))
    assert "readable" in complaint("recover", *PLANAR, "--demonstration", "bad.npz")


def test_demonstration_of_another_body(complaint, demonstration):
    sentence = complaint("recover", "--domain", "humanoid", "--demonstration", demonstration[0])
    assert "misses" in sentence and "root_y" in sentence


def test_a_domain_without_demonstrations(complaint, demonstration):
    argv = ("recover", "--domain", "lqr", "--demonstration", demonstration[0])
    assert "demonstration" in complaint(*argv)


# --- what goes wrong on the way


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
    def fail(setup, executor):
        raise error

    monkeypatch.setattr("walking_irl.run.session.prepare", fail)
    assert str(error) in complaint("recover", *PLANAR)


@pytest.mark.slow
def test_a_fall_is_reported_with_its_time(complaint):
    sentence = complaint("recover", *PLANAR, "--noise", 20, "--rollouts", 2)
    assert "fell after" in sentence and "pelvis" in sentence


def test_terminal_says_how_sure_the_weights_are(call):
    code, out, _ = call("recover", "--domain", "lqr", "--no-record")
    assert code == 0
    for part in ("certificate", "suboptimality of the expert: at most", "weights: the ",
                 "of the volume of all is left", "least certain: axis",
                 "features of the expert: known exactly", "L1 error"):  # fmt: skip
        assert part in out, part


@pytest.mark.parametrize(
    "argv",
    [
        ("--record", "a.rrd", "--json", "{}/a.rrd"),
        ("--record", "sub/../a.rrd", "--json", "a.rrd"),
        ("--archive", "b.npz", "--json", "./b.npz"),
    ],
)
def test_two_results_never_share_a_file_by_other_names(complaint, tmp_path, argv):
    (tmp_path / "sub").mkdir()
    argv = [a.format(tmp_path) for a in argv]
    assert "two results" in complaint("recover", "--domain", "lqr", *argv)
    assert not list(tmp_path.glob("*.rrd"))


def test_what_is_read_is_never_written(call, complaint, tmp_path):
    assert call("recover", "--domain", "lqr", "--record", "a.rrd")[0] == 0
    before = {p: p.read_bytes() for p in tmp_path.iterdir()}
    assert "is read" in complaint("inspect", "a.rrd", "--json", "a.rrd")
    archive = "a.archive.npz"
    resumed = ("recover", "--resume", archive, "--archive", "b.npz", "--no-record")
    assert "is read" in complaint(*resumed, "--json", archive)
    assert all(p.read_bytes() == content for p, content in before.items())


def test_settings_of_recorded_walkers_are_refused_elsewhere(complaint):
    for option, value in (("--rollouts", 5), ("--noise", "nan"), ("--population", "uniform")):
        sentence = complaint("recover", "--domain", "lqr", option, value, "--no-record")
        assert option[2:] in sentence and "known exactly" in sentence


def test_huge_numbers_are_understood_or_named(call, complaint):
    huge = ("recover", "--domain", "lqr", "--no-record", "--weights", "1e308,1e308,1e308")
    code, out, err = call(*huge)
    assert code == 0 and not err and "0.3333, 0.3333, 0.3333" in out
    sentence = complaint("recover", "--domain", "lqr", "--seed", 2**63)
    assert "seed must be a whole number" in sentence


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
    assert "--resume o.archive.npz" in out
    monkeypatch.setattr(LQR, "forward", forward)
    code, out, _ = call("recover", "--resume", "o.archive.npz", "--no-record")
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


# --- Ctrl-C


def test_interrupt_keeps_what_is_done(call, tmp_path, monkeypatch):
    lines = []

    def third_time(it, report):
        lines.append(it)
        if len(lines) == 3:
            raise KeyboardInterrupt
        return "line"

    monkeypatch.setattr(recover, "progress_line", third_time)
    code, out, err = call("recover", "--domain", "lqr", "--json", "out.json")
    assert code == 130 and not err and "interrupted" in out
    content = json.loads((tmp_path / "out.json").read_text())
    assert content["status"] == "interrupted" and len(content["history"]) == 3
    assert content.keys() >= RECOVER_KEYS
    inspected = inspect_recording(tmp_path / "walking.rrd")
    assert inspected["ending"] == "interrupted" and inspected["iterations"] == 2


def test_interrupt_before_the_first_iteration(complaint, monkeypatch):
    def interrupt(setup, executor):
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
