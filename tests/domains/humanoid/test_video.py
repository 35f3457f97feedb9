"""A gait as a moving picture."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.gait.video import FRAME_MS, encode, postures
from walking_irl.errors import InvalidInputError


@pytest.fixture(scope="module")
def reference():
    return load_walker("humanoid-planar"), load_library("humanoid-planar")["reference"].gait


@pytest.mark.parametrize("cycles", [1, 3])
def test_frames_lie_on_the_gait_and_lead_on_to_the_first(reference, cycles):
    walker, gait = reference
    q = postures(walker, gait, cycles)
    assert len(q) == round(cycles * 2 * gait.half_period * 1000 / FRAME_MS)
    np.testing.assert_allclose(q[0], gait.q[0])
    ahead = q[0].copy()
    ahead[0] += cycles * 2 * gait.step_length
    steps = np.diff(np.vstack([q, ahead]), axis=0)
    assert np.abs(steps[-1] - steps[0]).max() < np.abs(np.diff(steps, axis=0)).max()
    assert np.all(steps[:, 0] > 0)  # forwards, in every frame


def test_less_than_a_cycle_is_refused(reference):
    with pytest.raises(InvalidInputError, match="at least one cycle, got 0"):
        postures(*reference, 0)


def test_a_gif_plays_all_frames_at_their_pace_and_starts_again():
    shade = np.linspace(0, 255, 8).astype(np.uint8)
    frames = [np.tile(np.roll(shade, k)[:, None, None], (1, 6, 3)) for k in range(5)]
    picture = Image.open(io.BytesIO(encode(frames)))
    assert picture.n_frames == 5 and picture.info["loop"] == 0
    for k, frame in enumerate(frames):
        picture.seek(k)
        assert picture.info["duration"] == FRAME_MS
        np.testing.assert_allclose(np.asarray(picture.convert("RGB")), frame, atol=2)
