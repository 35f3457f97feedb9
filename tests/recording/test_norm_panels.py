"""Curves of walks on norms: every panel has its band and the curves that there are."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from recordings import walk

from walking_irl.domains.humanoid.gait.norm_curves import norm_set
from walking_irl.recording import record_motion
from walking_irl.recording.reader import Recording
from walking_irl.recording.views.norm_panels import HEIGHT, VARIABLES, WIDTH, Curves, NormPanels
from walking_irl.recording.views.people import PersonView

NORMS = norm_set("adults", 1.25, 0.9)
MEANS = {n: NORMS.curves[n].mean for n in VARIABLES if n in NORMS.curves}


@pytest.fixture
def recording(tmp_path: Path, model: mujoco.MjModel) -> Recording:
    """A person without a force, beside a walk that is the norm itself."""
    few = {"knee_flexion": MEANS["knee_flexion"] + 10}
    walks = [Curves("a person", (1, 2, 3), few), Curves("the norm", (4, 5, 6), MEANS)]
    view = PersonView(model, walk(), walk(), NormPanels(walks, NORMS))
    return Recording(record_motion(tmp_path / "a.rrd", view, walk(), title="A person"))


def test_there_is_a_panel_for_what_some_walk_has(recording: Recording) -> None:
    for name in MEANS:
        assert f"/norms/{name}/band" in recording.entities
        assert f"/norms/{name}/the\\ norm" in recording.entities
        has_curve = f"/norms/{name}/a\\ person" in recording.entities
        assert has_curve == (name == "knee_flexion")
    assert any(e.startswith("/world/nearest/") for e in recording.entities)


def test_a_walk_that_is_the_norm_lies_on_its_mean_within_its_panel(recording: Recording) -> None:
    def line(name: str) -> np.ndarray:
        return np.array(recording.static(f"/norms/{name}")["LineStrips2D:strips"][0])

    mean, own, person = (line(f"knee_flexion/{n}") for n in ("mean", "the\\ norm", "a\\ person"))
    np.testing.assert_allclose(own, mean, atol=1e-6)
    assert (person[:, 1] < mean[:, 1]).all()  # more flexion is higher: y points down
    assert np.ptp(mean[:, 0]) == pytest.approx(WIDTH)
    assert np.ptp(np.r_[person, mean][:, 1]) < HEIGHT
