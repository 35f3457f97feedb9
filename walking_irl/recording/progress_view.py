"""Figures of each iteration: weights and their intervals, certificates, features, the log."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import rerun as rr

from walking_irl.recording import style
from walking_irl.recording.experiment import Clock, Experiment, Other
from walking_irl.recording.interval_bars import IntervalBars
from walking_irl.types import Iteration, Rule

FIGURES = {
    "certificate": ("certificate", style.ESTIMATE),
    "best_regret": ("best regret", style.LEARNER),
    "regret": ("regret", style.FRAME),
    "loss": ("loss, ground truth", style.EXPERT),
    "volume_ratio": ("volume left", style.POLYHEDRON),
}
FLOOR = 1e-7
"""Where the logarithmic plot ends; what is smaller leaves it at the bottom."""
NOTHING = 1e-30
"""Drawn in the place of zero."""


class ProgressView:
    """Logs the figures of each iteration."""

    def __init__(self, experiment: Experiment) -> None:
        self._experiment = experiment
        self._K = len(experiment.objectives)
        self._whole: float | None = None
        self._bars = IntervalBars(experiment)
        self._last: dict[str, list[float]] = {}

    def log_static(self, stream: rr.RecordingStream) -> None:
        """Log names and styles of the curves, and the axes of the bars."""
        truth = self._experiment.w_expert is not None
        for name in self._experiment.names:
            log_style(
                stream,
                weight_path(name),
                ["lower", "query", "upper", "ground truth"][: 3 + truth],
                [style.POLYHEDRON, style.LEARNER, style.POLYHEDRON, style.EXPERT][: 3 + truth],
                [1.0, 2.0, 1.0, 1.5][: 3 + truth],
            )
            both = [f"{name} expert", f"{name} learner"]
            log_style(stream, feature_path(name), both, [style.EXPERT, style.LEARNER], [1.5, 2.0])
        for key, (label, colour) in FIGURES.items():
            log_style(stream, f"cpirl/{key}", [label], [colour], [2.0])
            log_style(stream, f"cpirl/log10/{key}", [label], [colour], [2.0])
        for name, colour in zip(self._experiment.others, style.OTHERS, strict=False):
            for path in (distance_path(name), share_path(name)):
                log_style(stream, path, [name], [colour], [2.0])
        self._bars.log_static(stream)

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
            self._draw(stream, weight_path(name), *row)
            self._draw(stream, feature_path(name), e.expert.mu[j], it.response.mu[j])
        for key, value in self._figures(it).items():
            if value is not None and math.isfinite(value):
                stream.log(f"cpirl/{key}", rr.Scalars(value))
                if key == "loss" and it.rule is Rule.PROBE:
                    continue  # a probe asks for extreme weights, whose policy is no answer
                self._draw(stream, f"cpirl/log10/{key}", math.log10(max(value, NOTHING)))
        for name, other in zip(e.others, others, strict=True):
            if other.share is not None:
                self._draw(stream, share_path(name), other.share)
            if e.w_expert is not None:
                distance = float(np.abs(other.w - e.w_expert).sum())
                self._draw(stream, distance_path(name), math.log10(max(distance, FLOOR)))
        self._bars.log_iteration(stream, it)
        stream.log("log", rr.TextLog(line(it), level=rr.TextLogLevel.INFO))

    def log_answer(self, stream: rr.RecordingStream, clock: Clock) -> None:
        """From here on the answer is shown, no query."""
        clock.set(stream)
        self._bars.log_answer(stream)

    def log_end(self, stream: rr.RecordingStream, clock: Clock) -> None:
        """At the last frame: what the curves came to, else their last step has no length."""
        clock.set(stream)
        for path, row in self._last.items():
            stream.log(path, rr.Scalars(row))

    def _draw(self, stream: rr.RecordingStream, path: str, *row: float) -> None:
        self._last[path] = list(row)
        stream.log(path, rr.Scalars(row))

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


def log_style(
    stream: rr.RecordingStream,
    path: str,
    names: list[str],
    colours: list[style.Colour],
    widths: list[float],
) -> None:
    """Log names, colours and widths of an entity's curves."""
    lines = rr.SeriesLines(
        names=names, colors=colours, widths=widths, interpolation_mode="StepAfter"
    )
    stream.log(path, lines, static=True)
