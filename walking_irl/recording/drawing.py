"""Small pieces that several views draw with."""

from __future__ import annotations

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from walking_irl.arrays import Array
from walking_irl.recording import style

NO_RADIUS = rr.Radius.ui_points([0.0])


def text_2d(at: Array, labels: list[str]) -> rr.Points2D:
    """Text alone, just below points of shape (n, 2)."""
    return rr.Points2D(
        at, labels=labels, colors=[style.LABEL], radii=NO_RADIUS, show_labels=True, draw_order=50.0
    )


def text_3d(at: Array, labels: list[str]) -> rr.Points3D:
    """Text alone, just below points of shape (n, 3)."""
    return rr.Points3D(at, labels=labels, colors=[style.LABEL], radii=NO_RADIUS, show_labels=True)


def outline(low: Array, high: Array) -> Array:
    """Closed outlines of rectangles, corners of shape (n, 2) -> (n, 5, 2)."""
    (x0, y0), (x1, y1) = np.transpose(low), np.transpose(high)
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]
    return np.stack([np.stack(corner, axis=-1) for corner in corners], axis=1)


def shade(value: Array, colour: style.Colour) -> NDArray[np.uint8]:
    """Colours from paper (0) to ``colour`` (1 and above), shape (...) -> (..., 3).

    >>> shade(np.array([0.0, 2.0]), (1, 2, 3)).tolist()
    [[248, 248, 246], [1, 2, 3]]
    """
    share = np.clip(value, 0.0, 1.0)[..., None]
    paper, ink = np.array(style.PAPER, float), np.array(colour, float)
    mixed: NDArray[np.uint8] = np.rint(paper + share * (ink - paper)).astype(np.uint8)
    return mixed


def log_pair(stream: rr.RecordingStream, path: str, name: str, has_expert: bool) -> None:
    """Style of a curve of the learner, and of the expert's beside it."""
    names = [f"{name} learner", f"{name} expert"][: 1 + has_expert]
    colours = [style.LEARNER, style.EXPERT][: 1 + has_expert]
    stream.log(path, rr.SeriesLines(names=names, colors=colours), static=True)
