"""A body and a recording that several tests look at."""

from __future__ import annotations

import mujoco
import pytest
from recordings import MJCF, record

from walking_irl.recording.reader import Recording


@pytest.fixture(scope="session")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(MJCF)


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory, model: mujoco.MjModel) -> Recording:
    path = tmp_path_factory.mktemp("recording") / "walk.rrd"
    record(path, model)
    return Recording(path)
