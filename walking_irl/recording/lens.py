"""A magnifier beside the true-scale picture of the weights, once the set is small."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import rerun as rr

from walking_irl.arrays import Array
from walking_irl.recording import style
from walking_irl.recording.drawing import text_3d
from walking_irl.recording.panels import Panel

LENS_RADIUS = 0.32
LENS_CENTRE = np.array([-0.2, -0.2, -0.72])
"""Where the lens stands, relative to the middle of the frame's foot."""
WIDE_LENS = np.array([0.05, 1.22, 0.5])
"""Where it stands beside the tetrahedron of four weights, in a view that is wide."""
LABEL_DROP = 1.25 * LENS_RADIUS
STEPS = np.array([1.0, 2.0, 3.0, 5.0, 7.0])
"""Magnifications are these times powers of ten."""


@dataclass(frozen=True, eq=False)
class Lens:
    """A magnifier: ``x -> place + zoom (x - focus)``."""

    focus: Array
    place: Array
    zoom: float

    def __call__(self, x: Array) -> Array:
        """Magnified points, shape (..., 3)."""
        seen: Array = self.place + self.zoom * (x - self.focus)
        return seen


def magnification(extent: float, radius: float = LENS_RADIUS) -> float:
    """Largest round factor that keeps ``extent`` within a lens, at least 1.

    >>> magnification(0.03), magnification(3.0), magnification(1e-5)
    (10.0, 1.0, 30000.0)
    """
    largest = radius / max(extent, 1e-9)
    if largest <= 1.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(largest))
    return float(power * STEPS[STEPS * power <= largest * (1 + 1e-9)].max())


def pictures(panel: Panel, lens: Lens | None) -> list[tuple[str, Lens | None]]:
    """Entity path and lens of each picture that the panel shows now."""
    true_scale: list[tuple[str, Lens | None]] = [(panel.path, None)]
    return true_scale if lens is None else [*true_scale, (f"{panel.path}/lens", lens)]


def lens_of(panel: Panel, points: Array, is_wide: bool) -> Lens | None:
    """A lens about points (n, 3) of the panel, or None while they fill much of the frame."""
    focus = (points.max(axis=0) + points.min(axis=0)) / 2
    extent = float(np.abs(points - focus).max())
    zoom = magnification(extent)
    if zoom < 2.0:
        return None
    low, high = panel.corners.min(axis=0), panel.corners.max(axis=0)
    place = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]]) + LENS_CENTRE
    if panel.is_flat:
        place = np.array([high[0] + 1.4 * LENS_RADIUS, (low[1] + high[1]) / 2, 0.0])
    elif is_wide:
        place = WIDE_LENS
    return Lens(focus, place, zoom)


def log_lens(stream: rr.RecordingStream, panel: Panel, lens: Lens) -> None:
    """The lens's box, the small box that it magnifies, and its scale."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    if panel.is_flat:
        signs = np.unique(signs * [1, 1, 0], axis=0)
    big = lens.place + LENS_RADIUS * signs
    small = lens.focus + LENS_RADIUS / lens.zoom * signs
    pairs = [(i, j) for i, j in combinations(range(len(signs)), 2)
             if np.count_nonzero(signs[i] != signs[j]) == 1]  # fmt: skip
    boxes = np.array([[box[i], box[j]] for box in (big, small) for i, j in pairs])
    lines = rr.LineStrips3D(boxes, colors=[style.LENS], radii=rr.Radius.ui_points([1.0]))
    stream.log(f"{panel.path}/lens/box", lines)
    foot = lens.place - LABEL_DROP * np.array([0, 1, 0] if panel.is_flat else [0, 0, 1])
    stream.log(f"{panel.path}/lens/scale", text_3d(foot[None], [f"magnified {lens.zoom:,.0f} x"]))
