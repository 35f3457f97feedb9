"""The environment of all tests, and fixtures that several files share.

Folders have no conftest of their own: collected for doctests, two of one name would clash.
"""

import os

# One BLAS thread and a screenless renderer, before anything imports numpy or mujoco.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MUJOCO_GL", "egl")

import pytest


@pytest.fixture
def call(capsys, tmp_path, monkeypatch):
    """Runs a command in an empty folder: exit code, output and errors."""
    from walking_irl.cli.main import main

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
    from sentences import one_sentence

    def run(*argv, code=2):
        before = sorted(tmp_path.rglob("*"))
        got, _, err = call(*argv)
        assert got == code, err
        assert sorted(tmp_path.rglob("*")) == before
        return one_sentence(err)

    return run


@pytest.fixture(scope="session")
def planar():
    """The planar body."""
    from walking_irl.domains.humanoid.domain import Humanoid

    return Humanoid("humanoid-planar").walker


@pytest.fixture(scope="session")
def demonstration(tmp_path_factory, planar):
    """A shipped planar gait as .npz; its columns by name."""
    import numpy as np

    from walking_irl.domains.humanoid.gait.files import save_gait
    from walking_irl.domains.humanoid.gait.library import load_gaits

    path = tmp_path_factory.mktemp("gait") / "gait.npz"
    save_gait(path, load_gaits("humanoid-planar")["reference"], planar)
    with np.load(path) as data:
        return path, {name: data[name] for name in data.files}


@pytest.fixture(scope="session")
def model():
    """A toy body."""
    import mujoco
    from recordings import MJCF

    return mujoco.MjModel.from_xml_string(MJCF)


@pytest.fixture(scope="session")
def recorded(tmp_path_factory, model):
    """The recording of a toy run."""
    from recordings import record

    from walking_irl.recording.reader import Recording

    path = tmp_path_factory.mktemp("recording") / "walk.rrd"
    record(path, model)
    return Recording(path)
