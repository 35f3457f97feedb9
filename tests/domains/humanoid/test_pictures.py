"""The drawn body: a picture shows it, its legs stay apart, its shoes stand on the floor."""

import os
import subprocess
import sys

import mujoco
import numpy as np
import pytest
from PIL import Image

from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.gait import pictures
from walking_irl.domains.humanoid.gait.gait import whole_cycle
from walking_irl.domains.humanoid.gait.library import load_gaits
from walking_irl.domains.humanoid.gait.pictures import (
    SIDE,
    drawn_leg_distance,
    photograph,
    sole_heights,
    strip,
)
from walking_irl.errors import InvalidInputError, WalkingIRLError


@pytest.mark.parametrize("body", ["humanoid", "humanoid-planar"])
def test_strip_shows_eight_different_frames_of_a_walker_in_two_colours(body, tmp_path):
    walker, gait = load_walker(body), load_gaits(body)["reference"]
    path = tmp_path / "gait.png"
    picture = strip(walker, gait, height=130, width=70, path=path)
    assert picture.shape == (260, 560, 3) and picture.dtype == np.uint8
    np.testing.assert_array_equal(np.asarray(Image.open(path)), picture)
    side = [picture[:130, 70 * i : 70 * (i + 1)].astype(float) for i in range(8)]
    for a, b in zip(side, side[1:], strict=False):
        assert np.abs(a - b).mean() > 1
    for frame in side:
        red, blue = frame[..., 0] - frame[..., 2], frame[..., 2] - frame[..., 0]
        assert (red > 40).mean() > 0.005, "the right side is terracotta"
    assert max((f[..., 2] - f[..., 0] > 40).mean() for f in side) > 0.005, "the left side is blue"
    assert blue.max() > 40


def test_camera_follows_the_walker():
    walker, gait = load_walker(), load_gaits()["reference"]
    near = whole_cycle(gait, walker.mirror)[0]
    far = near.copy()
    far[0] += 100.0  # whole tiles of the floor
    a, b = photograph(walker, [(near, SIDE), (far, SIDE)], height=130, width=70)
    assert np.abs(a.astype(float) - b).mean() < 3


def test_drawn_legs_stay_apart():
    for body in ("humanoid", "humanoid-planar"):
        for name, gait in load_gaits(body).items():
            assert drawn_leg_distance(load_walker(body), gait) > 0.005, name


def test_crossed_legs_are_seen_to_overlap():
    walker, gait = load_walker(), load_gaits()["reference"]
    q = gait.q.copy()
    for s in "rl":
        q[:, walker.joints.index(f"hip_adduction_{s}")] += np.deg2rad(15)
    crossed = type(gait)(q, gait.step_length, gait.half_period)
    assert drawn_leg_distance(walker, crossed) < 0


def test_shoes_stand_on_the_floor():
    """At every knot the lower shoe is within a few millimetres of the floor."""
    for body in ("humanoid", "humanoid-planar"):
        for name, gait in load_gaits(body).items():
            heights = sole_heights(load_walker(body), gait)
            assert heights.min() > -0.007 and heights.max() < 0.007, name


def test_machine_without_opengl_says_what_to_install(monkeypatch):
    def refuse(*_):
        raise RuntimeError("no display")

    monkeypatch.setattr(mujoco, "Renderer", refuse)
    with pytest.raises(WalkingIRLError, match="install libegl1 .* or libosmesa6"):
        strip(load_walker(), load_gaits()["reference"], height=20, width=10)


def test_pictures_need_no_screen_and_no_environment_variable():
    """In a process of its own: MuJoCo reads the environment once."""
    hidden = ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY", "PYOPENGL_PLATFORM")
    bare = {k: v for k, v in os.environ.items() if k not in hidden}
    program = """
from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.gait.library import load_gaits
from walking_irl.domains.humanoid.gait.pictures import strip
print(strip(load_walker(), load_gaits()["reference"], height=20, width=10).std() > 1)
"""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program], env=bare, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "True" and not done.stderr


def test_impossible_sizes_are_refused():
    walker, gait = load_walker(), load_gaits()["reference"]
    with pytest.raises(InvalidInputError, match=">= 1, got 0 x 270"):
        strip(walker, gait, height=0)
    with pytest.raises(InvalidInputError, match="too large"):
        strip(walker, gait, height=9000)
    assert pictures.OVERSAMPLING >= 2
