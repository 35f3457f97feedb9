"""Fixtures of the command line's tests: a command in an empty folder, and what it must not do."""

import numpy as np
import pytest
from sentences import one_sentence

from walking_irl.cli.main import main
from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.domains.humanoid.gait.files import save_gait
from walking_irl.domains.humanoid.gait.library import load_gaits


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


@pytest.fixture(scope="session")
def planar():
    return Humanoid(planar=True).walker


@pytest.fixture(scope="session")
def demonstration(tmp_path_factory, planar):
    """A shipped planar gait as .npz; its columns by name."""
    path = tmp_path_factory.mktemp("gait") / "gait.npz"
    save_gait(path, load_gaits(planar=True)["reference"], planar)
    with np.load(path) as data:
        return path, {name: data[name] for name in data.files}
