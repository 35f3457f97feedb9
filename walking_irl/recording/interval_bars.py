"""What is left of each weight's interval, as bars; and the same magnified, once they are short."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import rerun as rr

from walking_irl.arrays import Array
from walking_irl.recording import style
from walking_irl.recording.drawing import text_2d
from walking_irl.recording.experiment import Experiment
from walking_irl.recording.lens import magnification
from walking_irl.types import Iteration

ROW = 0.105
"""Height of an objective's row, in units of the axis 0..1."""
BARS = "polyhedron/intervals"
RAISED = 0.33 * ROW
"""The viewer writes below a point; so much higher, text stands beside its line."""
WIDTH = 1.72
"""Right end of the whole picture."""
PLACE, HALF = 1.38, 0.25
"""Middle and half width of the magnified bars."""
LEAST_ZOOM = 2.0
LETTER, MOST_LETTERS = 0.03, 27
"""Width of a letter in units of the axis, and how many of a name are shown."""
DOTS = {"query": (style.LEARNER, 6.5), "estimate": (style.ESTIMATE, 4.0)}
"""Colour and radius of each dot."""


def bounds(names: Sequence[str]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Range in x and in y of the whole picture; left of 0 there is room for the names."""
    return (-_room(names), WIDTH), (-0.07, 1.12 * ROW * len(names))


def _room(names: Sequence[str]) -> float:
    """Width of the column of names, in units of the axis."""
    return max(0.3, 0.06 + LETTER * max(len(shortened(name)) for name in names))


def shortened(name: str) -> str:
    """A name that leaves room for its bar.

    >>> shortened("far from everything that stands in the way")
    'far from everything that s…'
    """
    return name if len(name) <= MOST_LETTERS else name[: MOST_LETTERS - 1] + "…"


class IntervalBars:
    """Logs the bars: one rail an objective, up to 1, and beside it a piece of it, magnified.

    All objectives are magnified by the same factor, each about the middle of its interval.

    Args:
        experiment: Names, and the ground truth.
        least: Where the rails begin: 0, or -1 where weights may be negative.
    """

    def __init__(self, experiment: Experiment, least: float = 0.0) -> None:
        self._names = experiment.names
        self._least = least
        truth = experiment.w_expert
        self._truth = None if truth is None else self._place(truth)
        self._y = ROW * np.arange(len(self._names), dtype=np.float64)

    def log_static(self, stream: rr.RecordingStream) -> None:
        """Log rails, names, ticks and the ground truth."""
        y = self._y
        _log_rails(stream, "rails", 0.0, 1.0, y)
        at = np.c_[np.full(len(y), -_room(self._names) / 2), y - RAISED]
        names = [shortened(name) for name in self._names]
        stream.log(f"{BARS}/names", text_2d(at, names), static=True)
        ticks = np.linspace(self._least, 1.0, 5)
        below = np.c_[self._place(ticks), np.full(5, y[-1] + 0.5 * ROW)]
        stream.log(f"{BARS}/ticks", text_2d(below, [f"{t:g}" for t in ticks]), static=True)
        if self._truth is not None:
            _log_marks(stream, "hidden", self._truth, y, static=True)

    def log_iteration(self, stream: rr.RecordingStream, it: Iteration) -> None:
        """Log what is left, at true scale and magnified."""
        self.log(stream, it.intervals, {"query": it.w, "estimate": it.estimate})

    def log(
        self, stream: rr.RecordingStream, intervals: Array | None, weights: Mapping[str, Array]
    ) -> None:
        """Log intervals (K, 2), if there are some, and weights (K,) by name of :data:`DOTS`."""
        points = [(name, self._place(w), *DOTS[name]) for name, w in weights.items()]
        for name, w, colour, size in points:
            _log_dots(stream, name, w, self._y, colour, size)
        if intervals is None:
            return
        low, high = self._place(intervals).T
        _log_bars(stream, "bars", low, high, self._y)
        if not np.any(high > low):
            return
        middle = (low + high) / 2
        zoom = magnification(float((high - low).max()) / 2, HALF)
        if zoom < LEAST_ZOOM:
            return
        _log_rails(stream, "lens/rails", PLACE - HALF, PLACE + HALF, self._y)
        half = zoom * (high - low) / 2
        _log_bars(stream, "lens/bars", PLACE - half, PLACE + half, self._y)
        for name, w, colour, size in points:
            seen = PLACE + zoom * (w - middle)
            is_seen = np.abs(seen - PLACE) <= HALF
            _log_dots(stream, f"lens/{name}", seen[is_seen], self._y[is_seen], colour, size)
        if self._truth is not None:
            seen = PLACE + zoom * (self._truth - middle)
            is_seen = np.abs(seen - PLACE) <= HALF
            _log_marks(stream, "lens/hidden", seen[is_seen], self._y[is_seen])
        at = np.array([[PLACE, self._y[-1] + 0.5 * ROW]])
        stream.log(f"{BARS}/lens/scale", text_2d(at, [f"magnified {zoom:,.0f} x"]))

    def log_answer(self, stream: rr.RecordingStream) -> None:
        """The last query leaves; the estimate, which is the answer, stays."""
        for name in ("query", "lens/query"):
            stream.log(f"{BARS}/{name}", rr.Clear(recursive=False))

    def _place(self, w: Array) -> Array:
        """Where a weight stands on its rail, 0 to 1."""
        return np.asarray((w - self._least) / (1.0 - self._least))


def _log_rails(stream: rr.RecordingStream, name: str, left: float, right: float, y: Array) -> None:
    rails = [[[left, v], [right, v]] for v in y]
    lines = rr.LineStrips2D(
        rails, colors=[style.with_alpha(style.FRAME, 0.5)], radii=rr.Radius.ui_points([0.8])
    )
    stream.log(f"{BARS}/{name}", lines, static=name == "rails")


def _log_bars(stream: rr.RecordingStream, name: str, low: Array, high: Array, y: Array) -> None:
    bars = np.stack([np.c_[low, y], np.c_[high, y]], axis=1)
    thick = rr.Radius.ui_points([5.0])
    lines = rr.LineStrips2D(bars, colors=[style.POLYHEDRON], radii=thick, draw_order=10.0)
    stream.log(f"{BARS}/{name}", lines)


def _log_dots(
    stream: rr.RecordingStream, name: str, x: Array, y: Array, colour: style.Colour, size: float
) -> None:
    radii = rr.Radius.ui_points([size])
    stream.log(
        f"{BARS}/{name}", rr.Points2D(np.c_[x, y], colors=[colour], radii=radii, draw_order=40.0)
    )


def _log_marks(
    stream: rr.RecordingStream, name: str, x: Array, y: Array, static: bool = False
) -> None:
    h = 0.36 * ROW
    marks = np.stack([np.c_[x, y - h], np.c_[x, y + h]], axis=1)
    radii = rr.Radius.ui_points([2.0])
    lines = rr.LineStrips2D(marks, colors=[style.EXPERT], draw_order=30.0, radii=radii)
    stream.log(f"{BARS}/{name}", lines, static=static)
