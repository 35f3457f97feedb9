"""Colours and sizes that mean the same in every view of a recording."""

from __future__ import annotations

Colour = tuple[int, int, int]

LEARNER: Colour = (28, 98, 190)
"""The query, the learner's curves."""
ESTIMATE: Colour = (16, 140, 110)
"""The best estimate of the weights."""
EXPERT: Colour = (200, 30, 70)
"""The truth: ground-truth weights, the expert's features and joints."""
GHOST: Colour = (232, 128, 150)
POLYHEDRON: Colour = (240, 160, 30)
POLYHEDRON_EDGE: Colour = (176, 102, 0)
CUT: Colour = (226, 50, 50)
"""What the newest cut took away."""
OTHERS: tuple[Colour, ...] = ((28, 98, 190), (160, 60, 200), (16, 150, 90), (40, 44, 52))
"""Further points among the weights, in their order."""
FRAME: Colour = (150, 154, 162)
INK: Colour = (92, 96, 106)
"""What belongs to nobody: arrows of a policy, cars of others."""
LENS: Colour = (120, 150, 200)
FORCE: Colour = (226, 88, 20)
TRAIL: Colour = (28, 98, 190)
PAPER: Colour = (248, 248, 246)
SKIN: Colour = (222, 178, 148)
ASPHALT: Colour = (150, 152, 158)
GRASS: Colour = (178, 204, 160)
GLASS: Colour = (52, 56, 66)
LABEL: Colour = (22, 24, 30)
"""Text; the viewer puts it on a plate, grey in its dark theme and nearly white in its light one."""

PLAYBACK_RATE = 40.0
"""Frames per second of ``sim_time`` [1/s]."""
FADE_FRAMES = 48
"""How long what a cut took away stays visible."""
FADE_STEPS = 8
"""In how many steps it fades."""


def with_alpha(colour: Colour, alpha: float) -> tuple[int, int, int, int]:
    """The colour with opacity ``alpha`` in [0, 1].

    >>> with_alpha((1, 2, 3), 0.5)
    (1, 2, 3, 128)
    """
    return (*colour, round(255 * alpha))
