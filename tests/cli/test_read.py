"""``walking-irl read``: what it says and writes, and one sentence for what it cannot read."""

import io
import json
import os
import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest
from person_files import force_plates, npz, recording, sheet, storage

from walking_irl.cli.main import main
from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.gait.files import load_gait
from walking_irl.domains.humanoid.gait.library import load_gaits
from walking_irl.domains.humanoid.gait.realism import gait_cycle

WALKER = load_walker()
GAIT = load_gaits()["reference"]


@pytest.fixture
def call(capsys, tmp_path, monkeypatch):
    """Runs ``read`` in an empty folder: exit code, output and errors."""
    monkeypatch.chdir(tmp_path)

    def run(*argv):
        try:
            code = main(["read", *map(str, argv)])
        except SystemExit as leave:
            code = leave.code
        return code, *capsys.readouterr()

    return run


@pytest.fixture
def complaint(call, tmp_path):
    """Reads what must be refused with code 2, one sentence and no file; returns the sentence."""

    def run(*argv):
        before = sorted(tmp_path.rglob("*"))
        code, _, err = call(*argv)
        assert code == 2, err
        assert err.startswith("walking-irl: ") and err.count("\n") == 1 and "Traceback" not in err
        assert sorted(tmp_path.rglob("*")) == before
        return err

    return run


def test_it_says_what_was_understood_and_writes_the_cycle(call, tmp_path):
    (tmp_path / "w.mot").write_text(storage(recording(GAIT, WALKER)))
    code, out, err = call("w.mot", "--save", "g.npz", "--json", "w.json")
    assert code == 0 and not err
    assert "version 1" in out and "degrees" in out and "m/s" in out
    content = json.loads((tmp_path / "w.json").read_text())
    assert content["speed"] == pytest.approx(GAIT.speed, rel=0.01)
    assert content["cadence"] == pytest.approx(60 / GAIT.half_period, rel=0.01)
    assert content["missing"] == [] and content["force"] is None
    assert load_gait(tmp_path / "g.npz", WALKER).speed == pytest.approx(GAIT.speed, rel=0.02)
    assert call("w.mot", "--quiet") == (0, "", "")


def test_the_picture_is_svg_with_a_panel_for_every_curve(call, tmp_path):
    (tmp_path / "w.mot").write_text(storage(recording(GAIT, WALKER)))
    assert call("w.mot", "--plot", "w.svg", "--quiet")[0] == 0
    picture = ElementTree.parse(tmp_path / "w.svg").getroot()
    words = [t.text for t in picture.iter("{http://www.w3.org/2000/svg}text")]
    assert {"knee flexion", "ankle plantarflexion moment", "vertical force"} <= set(words)
    lines = list(picture.iter("{http://www.w3.org/2000/svg}polyline"))
    assert len(lines) == 11 + 12 + 8  # bands' means, the model's curves, the person's
    width = float(picture.get("width"))
    for line in lines:
        x = [float(p.split(",")[0]) for p in line.get("points").split()]
        assert 0 < min(x) < max(x) < width


@pytest.mark.parametrize("by_side", [True, False])
@pytest.mark.parametrize("size", [0.8, 1.0])
def test_forces_of_the_same_walk_are_read(call, tmp_path, by_side, size):
    """The force under both feet in body weights, whoever the plates are named after."""
    walk = recording(GAIT, WALKER, size=size, cycles=2.5)
    plates = force_plates(GAIT, WALKER, size=size, by_side=by_side, cycles=2.5)
    (tmp_path / "w.mot").write_text(storage(walk))
    (tmp_path / "w_grf.mot").write_text(storage(plates, degrees=None))
    assert call("w.mot", "w_grf.mot", "--json", "w.json", "--quiet")[0] == 0
    force = np.array(json.loads((tmp_path / "w.json").read_text())["force"])
    cycle = gait_cycle(WALKER, GAIT)
    assert force[:, 2].mean() == pytest.approx(0.5, abs=1e-9)
    assert force[:, 2].max() == pytest.approx(cycle.force.max(), rel=0.05)
    assert np.mean(force[:, 2] > 0.03) == pytest.approx(cycle.n_stance / 80, abs=0.05)


def test_forces_alone_or_of_another_time_are_refused(complaint, tmp_path):
    plates = force_plates(GAIT, WALKER)
    (tmp_path / "w.mot").write_text(storage(recording(GAIT, WALKER)))
    (tmp_path / "a.mot").write_text(storage(plates, degrees=None))
    (tmp_path / "b.mot").write_text(storage({**plates, "time": plates["time"] + 60}, degrees=None))
    assert "joint angles" in complaint("a.mot")
    assert "time in common" in complaint("w.mot", "b.mot")


def test_parts_heights_and_belts_that_the_user_knows(call, tmp_path):
    (tmp_path / "w.mot").write_text(storage(recording(GAIT, WALKER, cycles=6, belt=GAIT.speed)))
    options = ("--from", 1, "--to", "3.5", "--height", "1.6", "--belt", "1.2", "--json", "w.json")
    assert call("w.mot", *options, "--quiet")[0] == 0
    content = json.loads((tmp_path / "w.json").read_text())
    assert content["seconds"] == pytest.approx(2.5, abs=0.6)
    assert content["scale"] == pytest.approx(1.75 / 1.6) and content["belt"] == 1.2
    assert content["speed"] == pytest.approx(1.2, rel=0.01)


@pytest.mark.parametrize(
    "options",
    [
        ("--from", "nan"),
        ("--from", 3, "--to", 2),
        ("--from", 50),
        ("--height", 17),
        ("--belt", "inf"),
        ("--cycle-time", "fast"),
        ("--convention", "mine"),
        ("--save", "walk.rrd"),
        ("--plot", "walk.png"),
        ("--save", "w.mot"),
        ("--json", "no/where.json"),
    ],
)
def test_wrong_options(complaint, tmp_path, options):
    (tmp_path / "w.mot").write_text(storage(recording(GAIT, WALKER)))
    complaint("w.mot", *options)


def test_what_is_no_file(complaint, tmp_path):
    assert "no file" in complaint("none.mot")
    (tmp_path / "folder.mot").mkdir()
    assert "folder" in complaint("folder.mot")
    os.mkfifo(tmp_path / "pipe.mot")
    assert "pipe" in complaint("pipe.mot")
    assert "device" in complaint("/dev/zero")
    assert complaint("x" * 5000)
    complaint()


MARKERS = "PathFileType\t4\t(X/Y/Z)\tw.trc\nDataRate\tCameraRate\n100\t100\nFrame#\tTime\tR.Heel\n"
UNREADABLE = {
    "empty.mot": (b"", "empty"),
    "no_end.mot": (b"time\tknee\n0\t1\n", "endheader"),
    "no_rows.mot": (b"x\nendheader\n", "rows"),
    "names_only.mot": (b"x\nendheader\ntime\tknee\n", "short"),
    "words.csv": (b"time,knee_r\n" + b"0,bent\n" * 9, "bent"),
    "wide.csv": (b"time,knee_r\n" + b"0,1,2\n" * 9, "3 cells"),
    "twice.csv": (b"time,time\n" + b"0,0\n" * 9, "twice"),
    "unnamed.csv": (b"0,1\n" * 9, "name"),
    "binary.csv": (b"\xff\xfe\x00binary\x00", "readable"),
    "picture.mot": (b"\x89PNG\r\n\x1a\n\x00\x00", "readable"),
    "quaternions.sto": (b"DataType=Quaternion\nendheader\ntime\ta\n0\t1,0,0,0\n", "quaternion"),
    "markers.trc": (MARKERS.encode(), "inverse kinematics"),
    "renamed.mot": (MARKERS.encode(), "inverse kinematics"),
    "markers.c3d": (b"\x02P", "inverse kinematics"),
    "walk.bvh": (b"HIERARCHY", ".mot"),
    "no_zip.npz": (b"PK\x03\x04 cut off", "readable"),
}


@pytest.mark.parametrize("name", UNREADABLE)
def test_unreadable_files(complaint, tmp_path, name):
    content, word = UNREADABLE[name]
    (tmp_path / name).write_bytes(content)
    sentence = complaint(name)
    assert word in sentence and name in sentence


def test_positions_in_a_table_are_no_angles(complaint, tmp_path):
    time = np.arange(100) / 100
    names = [f"{n}_{a}" for n in ("heel_r", "heel_l", "knee_r") for a in "xyz"]
    columns = {"time": time, **{n: time for n in names}}
    (tmp_path / "w.csv").write_text(sheet(columns))
    assert "inverse kinematics" in complaint("w.csv")


def crafted(shape, *, descr="<f8", data=b"\0" * 8):
    """An .npz whose one member claims a shape."""
    head = f"{{'descr': {descr!r}, 'fortran_order': False, 'shape': {shape!r}, }}"
    head = head.ljust(117) + "\n"
    member = b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head.encode() + data
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("time.npy", member)
    return out.getvalue()


def pickled():
    out = io.BytesIO()
    np.savez(out, time=np.array([{"a": 1}], dtype=object))
    return out.getvalue()


def bomb():
    """One member of half a gigabyte of zeros, a megabyte on disk."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        with archive.open("time.npy", "w", force_zip64=True) as member:
            for _ in range(500):
                member.write(bytes(1_000_000))
    return out.getvalue()


CRAFTED = {
    "a huge header": (lambda: crafted((2**40,)), "claims"),
    "a negative shape": (lambda: crafted((-1, 8)), "claims"),
    "an overflowing shape": (lambda: crafted((2**62, 8)), "claims"),
    "a header that is code": (lambda: crafted("__import__('os')"), "readable"),
    "pickles": (pickled, "Python objects"),
    "words": (lambda: npz({"time": np.array(["one"] * 9)}), "numbers"),
    "a bomb": (bomb, "MB"),
    "own rollouts": (
        lambda: npz({n: np.zeros(9) for n in ("joints", "time", "q", "v", "u")}),
        "recover --demonstration",
    ),
    "columns of unequal length": (
        lambda: npz({"time": np.arange(9.0), "knee_angle_r": np.arange(8.0)}),
        "one length",
    ),
}


@pytest.mark.parametrize("kind", CRAFTED)
def test_crafted_archives_are_refused_before_memory_is_taken(complaint, tmp_path, kind):
    make, word = CRAFTED[kind]
    (tmp_path / "w.npz").write_bytes(make())
    sentence = complaint("w.npz")
    assert word in sentence and "w.npz" in sentence
