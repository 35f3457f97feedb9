"""A gait as a moving picture that any browser plays: an animated GIF, without a screen."""

from __future__ import annotations

import io

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.gait.gait import Gait, whole_cycle
from walking_irl.domains.humanoid.gait.pictures import OBLIQUE, Image, photograph
from walking_irl.errors import InvalidInputError

FRAME_MS = 40
"""Between two frames; GIF counts in hundredths of a second."""
CYCLES = 1
"""After which it starts again; the floor then jumps, the walker does not."""


def postures(walker: Walker, gait: Gait, cycles: int = CYCLES) -> Array:
    """Joint positions of some cycles at the times of a video's frames, shape (n, nv).

    The duration is rounded to whole frames, so that the last one leads on to the first.

    Raises:
        InvalidInputError: If there is less than one cycle.
    """
    if cycles < 1:
        raise InvalidInputError(f"a video shows at least one cycle, got {cycles}")
    q = whole_cycle(gait, walker.mirror)
    advance = np.zeros(q.shape[1])
    advance[0] = 2 * gait.step_length
    knots = np.vstack([q + k * advance for k in range(cycles)] + [q[:1] + cycles * advance])
    seconds = cycles * 2 * gait.half_period
    n = max(1, round(1000 * seconds / FRAME_MS))
    place = np.linspace(0.0, len(knots) - 1, n, endpoint=False)
    at = np.arange(len(knots))
    return np.stack([np.interp(place, at, x) for x in knots.T], axis=1)


def gif(
    walker: Walker, gait: Gait, *, cycles: int = CYCLES, height: int = 360, width: int = 300
) -> bytes:
    """The walker seen obliquely from the front, as the bytes of an animated GIF.

    Args:
        walker: Who walks.
        gait: What is walked.
        cycles: How many cycles are shown before it starts again.
        height: Of a frame [pixels].
        width: Of a frame [pixels].

    Raises:
        InvalidInputError: If there is less than one cycle.
        WalkingIRLError: If pictures cannot be drawn on this machine; it names what to install.
    """
    views = [(q, OBLIQUE) for q in postures(walker, gait, cycles)]
    return encode(photograph(walker, views, height=height, width=width))


def encode(frames: list[Image]) -> bytes:
    """Frames (height, width, 3) as an animated GIF that never ends; all share a palette."""
    from PIL import Image as pillow

    first = pillow.fromarray(frames[0]).quantize(method=pillow.Quantize.MEDIANCUT)
    rest = [pillow.fromarray(f).quantize(palette=first, dither=pillow.Dither.NONE) for f in frames]
    file = io.BytesIO()
    rest[0].save(
        file, "GIF", save_all=True, append_images=rest[1:], duration=FRAME_MS, loop=0, disposal=1
    )
    return file.getvalue()
