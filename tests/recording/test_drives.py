"""Drives as a recording draws them, without a recording."""

from __future__ import annotations

import numpy as np

from walking_irl.domains.mdp.driving import Driving, DrivingPicture
from walking_irl.recording.drawing import outline
from walking_irl.recording.views.driving import FRAMES_PER_STEP, Road, headline, play


def drive(domain: Driving, action: int) -> DrivingPicture:
    """A drive that always takes one action: at the start it picks the speed."""
    return domain.picture(np.full(domain.mdp.n_states, action), n_steps=30)


def test_a_car_that_is_passed_is_followed_by_the_next_one() -> None:
    picture = drive(Driving(), 1)
    frames = play(Road(picture, 0.0), 29 * FRAMES_PER_STEP)
    step = np.diff(frames.others[:, 0, 1])
    forward = -0.1 * picture.advance[0] / FRAMES_PER_STEP
    is_even = np.isclose(step, forward)
    assert is_even.mean() > 0.9  # all but where the next car takes over
    np.testing.assert_allclose(np.diff(frames.travelled), -forward)
    takes_over = FRAMES_PER_STEP * (1 + np.flatnonzero(np.diff(picture.red[:, 1]) < 0))
    assert takes_over.size and not is_even[takes_over - 1].any()
    np.testing.assert_allclose(
        frames.others[takes_over - 1, 1, 1] + forward, frames.others[takes_over, 0, 1]
    )


def test_collisions_and_leaving_the_road_are_the_features() -> None:
    domain = Driving()
    for action in range(3):
        picture = drive(domain, action)
        lacks = np.zeros((2, 30), dtype=bool)
        for t in range(30):
            dx, dy = np.abs(picture.blue[t] - picture.red[t])
            lacks[:, t] = dx < 20 and dy < 40, abs(picture.blue[t, 0] - 160) > 20
        np.testing.assert_array_equal(picture.is_colliding, lacks[0])
        np.testing.assert_array_equal(picture.is_off_road, lacks[1])
        hits, off = lacks.sum(axis=1)
        speed = ("slow", "medium", "fast")[action]
        assert headline("she", picture) == (
            f"she: {speed}; of 30 steps {hits} collide, {off} leave the road"
        )


def test_outlines_are_closed() -> None:
    (ring,) = outline(np.array([[0.0, 1.0]]), np.array([[2.0, 4.0]]))
    assert ring.tolist() == [[0, 1], [2, 1], [2, 4], [0, 4], [0, 1]]
