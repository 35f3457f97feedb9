"""Figures of each iteration: weights and their intervals, certificates, features, the log."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import rerun as rr

from walking_irl.arrays import Array
from walking_irl.recording import style
from walking_irl.recording.drawing import text_2d
from walking_irl.recording.experiment import Clock, Experiment, Other
from walking_irl.types import Iteration

ROW = 0.105
"""Height of an objective's row among the interval bars, in units of the axis 0..1."""
BARS = "polyhedron/intervals"
FIGURES = {
    "certificate": ("certificate", style.ESTIMATE),
    "best_regret": ("best regret", style.LEARNER),
    "regret": ("regret", style.FRAME),
    "loss": ("loss under the ground-truth weights", style.EXPERT),
    "volume_ratio": ("volume left", style.POLYHEDRON),
}
FLOOR = 1e-7
"""Smallest figure in the logarithmic plot."""


class ProgressView:
    """Logs the figures of each iteration."""

    def __init__(self, experiment: Experiment) -> None:
        self._experiment = experiment
        self._K = len(experiment.objectives)
        self._whole: float | None = None

    def log_static(self, stream: rr.RecordingStream) -> None:
        """Log names and styles of the curves, and the axes of the bars."""
        truth = self._experiment.w_expert is not None
        for name in self._experiment.names:
            _log_style(
                stream,
                weight_path(name),
                ["lower", "query", "upper", "ground truth"][: 3 + truth],
                [style.POLYHEDRON, style.LEARNER, style.POLYHEDRON, style.EXPERT][: 3 + truth],
                [1.0, 2.0, 1.0, 1.5][: 3 + truth],
            )
            both = [f"{name} expert", f"{name} learner"]
            _log_style(stream, feature_path(name), both, [style.EXPERT, style.LEARNER], [1.5, 2.0])
        for key, (label, colour) in FIGURES.items():
            _log_style(stream, f"cpirl/{key}", [label], [colour], [2.0])
            _log_style(stream, f"cpirl/log10/{key}", [label], [colour], [2.0])
        for name, colour in zip(self._experiment.others, style.OTHERS, strict=False):
            for path in (distance_path(name), share_path(name)):
                _log_style(stream, path, [name], [colour], [2.0])
        self._log_axes(stream)

    def log_iteration(
        self, stream: rr.RecordingStream, clock: Clock, it: Iteration, others: Sequence[Other] = ()
    ) -> None:
        """Log all figures of one iteration at its first frame."""
        clock.set(stream)
        e = self._experiment
        for j, name in enumerate(e.names):
            row = [it.intervals[j, 0], it.w[j], it.intervals[j, 1]]
            if e.w_expert is not None:
                row.append(e.w_expert[j])
            stream.log(weight_path(name), rr.Scalars(row))
            stream.log(feature_path(name), rr.Scalars([e.expert.mu[j], it.response.mu[j]]))
        for key, value in self._figures(it).items():
            if value is not None and math.isfinite(value):
                stream.log(f"cpirl/{key}", rr.Scalars(value))
                stream.log(f"cpirl/log10/{key}", rr.Scalars(math.log10(max(value, FLOOR))))
        for name, other in zip(e.others, others, strict=True):
            if other.share is not None:
                stream.log(share_path(name), rr.Scalars(other.share))
            if e.w_expert is not None:
                distance = float(np.abs(other.w - e.w_expert).sum())
                stream.log(distance_path(name), rr.Scalars(math.log10(max(distance, FLOOR))))
        self._log_bars(stream, it)
        stream.log("log", rr.TextLog(line(it), level=rr.TextLogLevel.INFO))

    def _figures(self, it: Iteration) -> dict[str, float | None]:
        if self._whole is None:
            self._whole = type(it.polyhedron).simplex(self._K).volume()
        truth = self._experiment.truth
        return {
            "regret": it.regret,
            "best_regret": it.best_regret,
            "certificate": it.certificate,
            "volume_ratio": it.polyhedron.volume() / self._whole,
            "loss": None if truth is None else truth.relative_loss(it.response.mu),
        }

    def _log_axes(self, stream: rr.RecordingStream) -> None:
        y = ROW * np.arange(self._K, dtype=np.float64)
        rails = [[[0.0, v], [1.0, v]] for v in y]
        stream.log(
            f"{BARS}/rails",
            rr.LineStrips2D(rails, colors=[style.with_alpha(style.FRAME, 0.5)],
                            radii=rr.Radius.ui_points([0.8])),
            static=True,
        )  # fmt: skip
        names = text_2d(np.c_[np.full(self._K, -0.13), y], self._experiment.names)
        stream.log(f"{BARS}/names", names, static=True)
        ticks = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
        below = np.c_[ticks, np.full(5, y[-1] + 0.6 * ROW)]
        stream.log(f"{BARS}/ticks", text_2d(below, [f"{t:g}" for t in ticks]), static=True)
        if self._experiment.w_expert is not None:
            marks = _upright(self._experiment.w_expert, y, 0.36)
            stream.log(
                f"{BARS}/hidden",
                rr.LineStrips2D(marks, colors=[style.EXPERT], draw_order=30.0,
                                radii=rr.Radius.ui_points([2.0])),
                static=True,
            )  # fmt: skip

    def _log_bars(self, stream: rr.RecordingStream, it: Iteration) -> None:
        y = ROW * np.arange(self._K, dtype=np.float64)
        bars = np.stack([np.c_[it.intervals[:, 0], y], np.c_[it.intervals[:, 1], y]], axis=1)
        thick = rr.Radius.ui_points([5.0])
        stream.log(
            f"{BARS}/bars",
            rr.LineStrips2D(bars, colors=[style.POLYHEDRON], radii=thick, draw_order=10.0),
        )
        for name, w, colour, size in (
            ("query", it.w, style.LEARNER, 6.5),
            ("estimate", it.estimate, style.ESTIMATE, 4.0),
        ):
            dots = rr.Points2D(
                np.c_[w, y], colors=[colour], radii=rr.Radius.ui_points([size]), draw_order=40.0
            )
            stream.log(f"{BARS}/{name}", dots)


def weight_path(name: str) -> str:
    """Entity of one weight's interval."""
    return f"weights/{rr.escape_entity_path_part(name)}"


def distance_path(name: str) -> str:
    """Entity of a further point's distance to the ground-truth weights."""
    return f"distance/{rr.escape_entity_path_part(name)}"


def share_path(name: str) -> str:
    """Entity of the share of the volume that a query at a further point leaves."""
    return f"share/{rr.escape_entity_path_part(name)}"


def feature_path(name: str) -> str:
    """Entity of one objective's feature expectations."""
    return f"features/{rr.escape_entity_path_part(name)}"


def line(it: Iteration) -> str:
    """One line on an iteration, for the log."""
    return (
        f"{it.k}: {it.rule.value}; regret {it.regret:.2e}, best {it.best_regret:.2e}, "
        f"certificate {it.certificate:.2e}; widest interval {it.widest:.4f}; {it.status.value}"
    )


def _log_style(
    stream: rr.RecordingStream,
    path: str,
    names: list[str],
    colours: list[style.Colour],
    widths: list[float],
) -> None:
    lines = rr.SeriesLines(
        names=names, colors=colours, widths=widths, interpolation_mode="StepAfter"
    )
    stream.log(path, lines, static=True)


def _upright(x: Array, y: Array, height: float) -> Array:
    """Upright marks at (x, y), shape (n, 2, 2)."""
    h = height * ROW
    return np.stack([np.c_[x, y - h], np.c_[x, y + h]], axis=1)
