"""Where nothing can be written, and files that are not what they should be."""

import json
import resource

import numpy as np
import pytest
from sentences import one_sentence

from walking_irl.cli.main import main
from walking_irl.cli.view import SCREENS

PLANAR = ("--domain", "humanoid-planar")


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
    assert sorted(p.name for p in tmp_path.iterdir()) == ["lqr.checkpoint.npz", "out.json"]


def test_full_disk_keeps_an_older_file(call, tmp_path, little_space):
    (tmp_path / "walking.rrd").write_text("older")
    assert call("recover", "--domain", "lqr", "--quiet", "--record", "walking.rrd")[0] == 2
    assert (tmp_path / "walking.rrd").read_text() == "older"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["walking.checkpoint.npz", "walking.rrd"]


def test_full_disk_under_the_json(call, tmp_path, monkeypatch):
    def full(fd):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("walking_irl.files.os.fsync", full)
    code, out, err = call("recover", "--domain", "lqr", "--no-record", "--json", "out.json")
    assert code == 2 and "No space left" in one_sentence(err) and "L1 error" in out
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "argv",
    [
        ("--record", "a.rrd", "--json", "{}/a.rrd"),
        ("--record", "sub/../a.rrd", "--json", "a.rrd"),
        ("--checkpoint", "b.npz", "--json", "./b.npz"),
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
    checkpoint = "a.checkpoint.npz"
    resumed = ("recover", "--resume", checkpoint, "--checkpoint", "b.npz", "--no-record")
    assert "is read" in complaint(*resumed, "--json", checkpoint)
    assert all(p.read_bytes() == content for p, content in before.items())


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


def damaged(columns, what):
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
    np.savez(path, **damaged(demonstration[1], what))
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
