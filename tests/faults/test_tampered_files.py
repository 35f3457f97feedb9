"""Whatever is done to the bytes of a file that is read, there is an answer or one sentence."""

import io
import zipfile

import numpy as np
import pytest

from walking_irl.domains.humanoid.demonstrations import demonstrated
from walking_irl.domains.humanoid.gait.files import save_gait
from walking_irl.domains.humanoid.gait.library import load_gaits
from walking_irl.domains.humanoid.spec import PLANAR
from walking_irl.errors import WalkingIRLError
from walking_irl.recording.reader import inspect_recording
from walking_irl.run.checkpoint import load_checkpoint
from walking_irl.run.session import run
from walking_irl.run.setup import Setup

N = 50
"""Tampered copies of each kind of file."""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """One good file of each kind."""
    folder = tmp_path_factory.mktemp("good")
    paths = {name: folder / name for name in ("run.rrd", "run.checkpoint.npz")}
    run(Setup(domain="lqr", record=paths["run.rrd"], checkpoint=paths["run.checkpoint.npz"]))
    gait = load_gaits("humanoid-planar")["reference"]
    for name in ("gait.npz", "gait.csv"):
        save_gait(folder / name, gait, PLANAR.walker)
        paths[name] = folder / name
    return paths


READERS = {
    "run.rrd": inspect_recording,
    "run.checkpoint.npz": load_checkpoint,
    "gait.npz": lambda path: demonstrated(path, PLANAR),
    "gait.csv": lambda path: demonstrated(path, PLANAR),
}


def tampered(content, rng):
    """Bytes with a flaw: cut off, flipped, doubled, overwritten or of another array."""
    kind, at = rng.integers(5), int(rng.integers(len(content)))
    if kind == 0:
        return content[:at]
    if kind == 1:
        flipped = bytearray(content)
        for i in rng.integers(len(content), size=8):
            flipped[i] ^= 1 << rng.integers(8)
        return bytes(flipped)
    if kind == 2:
        return content[:at] + content[at // 2 :]
    if kind == 3:
        return content[:at] + rng.bytes(64) + content[at + 64 :]
    return other_array(content, rng)


def other_array(content, rng):
    """An archive one of whose arrays has another dtype, shape or claim; else noise."""
    if not zipfile.is_zipfile(io.BytesIO(content)):
        return rng.bytes(1000)
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as source, zipfile.ZipFile(out, "w") as target:
        names = source.namelist()
        chosen = names[rng.integers(len(names))]
        for name in names:
            array = source.read(name)
            target.writestr(name, remade(array, rng) if name == chosen else array)
    return out.getvalue()


def remade(npy, rng):
    """An .npy file with another dtype, shape, value or header."""
    array = np.load(io.BytesIO(npy))
    kind = rng.integers(5)
    if kind == 0:
        claim = npy.replace(b"(", b"(99999999999, ", 1)
        return claim
    others = [
        np.full(array.shape, np.nan),
        array.ravel()[: array.size // 2],
        np.array("text"),
        np.zeros((2, *array.shape)),
    ]
    file = io.BytesIO()
    np.save(file, others[kind - 1])
    return file.getvalue()


@pytest.mark.parametrize("name", READERS)
def test_a_tampered_file_is_read_or_refused_in_one_sentence(files, name, tmp_path):
    rng = np.random.default_rng(5)
    content, path = files[name].read_bytes(), tmp_path / name
    refused = 0
    for _ in range(N):
        path.write_bytes(tampered(content, rng))
        try:
            READERS[name](path)
        except WalkingIRLError as error:
            refused += 1
            assert len(str(error)) < 2000
    assert refused > N / 3
