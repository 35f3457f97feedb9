"""A method's weights in the panels and as bars, its posterior, and the curve of its objective."""

from __future__ import annotations

import math

import numpy as np
import rerun as rr

from walking_irl.arrays import Array
from walking_irl.recording import style
from walking_irl.recording.experiment import Clock, Experiment
from walking_irl.recording.interval_bars import BARS, IntervalBars
from walking_irl.recording.lens import LENS_RADIUS, Lens, lens_of, log_lens, pictures
from walking_irl.recording.method import Found
from walking_irl.recording.panels import Panel, panels
from walking_irl.recording.polyhedron_view import ABOVE, CROSS, DIAMOND, Point, log_frame, log_point
from walking_irl.recording.progress_view import FLOOR, log_style

OBJECTIVE, DISTANCE = "method/objective", "method/distance"
MOST_SAMPLES = 2000
"""Samples of a posterior that are drawn; more are thinned evenly."""
SAMPLE = 1.6
"""Radius of a sample [points of the screen]."""


class MethodView:
    """Logs what a method found of the weights, and how it came there."""

    def __init__(self, experiment: Experiment, found: Found) -> None:
        self.panels = panels(experiment.names)
        self._found, self._truth = found, experiment.w_expert
        self._bars = IntervalBars(experiment, -1.0 if found.is_signed else 0.0)
        self._lens = {panel.path: self._lens_of(panel) for panel in self.panels}

    def log_static(self, stream: rr.RecordingStream) -> None:
        """Log frames, names, the styles of the curves, and what there is from the start."""
        name = "log10 of the objective" if self._found.is_logarithmic else "objective"
        log_style(stream, OBJECTIVE, [name], [style.LEARNER], [2.0])
        log_style(stream, DISTANCE, ["L1 to ground truth (log10)"], [style.EXPERT], [2.0])
        self._bars.log_static(stream)
        for panel in self.panels:
            log_frame(stream, panel)

    def log_entry(self, stream: rr.RecordingStream, clock: Clock, k: int) -> None:
        """Log entry ``k`` of the method's log, and about it what does not change."""
        clock.set(stream)
        found = self._found
        text = f"{k}: {found.status}"
        if len(found.log):
            value = float(found.log[k])
            text = f"{k}: objective {value:.6g}"
            shown = math.log10(value) if found.is_logarithmic else value
            stream.log(OBJECTIVE, rr.Scalars(shown))
        w = None if found.iterates is None else found.iterates[k]
        if w is not None and not np.isfinite(w).all():
            w = None  # all weights are 0: nowhere among those of sum 1
        if w is not None and self._truth is not None:
            distance = float(np.abs(w - self._truth).sum())
            stream.log(DISTANCE, rr.Scalars(math.log10(max(distance, FLOOR))))
        self._log_weights(stream, w)
        if clock.first == 0:
            for panel in self.panels:
                self._log_samples(stream, panel)
        stream.log("log", rr.TextLog(text, level=rr.TextLogLevel.INFO))

    def log_answer(self, stream: rr.RecordingStream, clock: Clock) -> None:
        """The iterate leaves; the answer stays."""
        clock.set(stream)
        for panel in self.panels:
            for root, _ in pictures(panel, self._lens[panel.path]):
                stream.log(f"{root}/query", rr.Clear(recursive=False))
        for name in ("query", "lens/query"):
            stream.log(f"{BARS}/{name}", rr.Clear(recursive=False))

    def _log_weights(self, stream: rr.RecordingStream, w: Array | None) -> None:
        found = self._found
        points = [Point("query", w, style.LEARNER, 4.0)] if w is not None else []
        dots = {"query": w} if w is not None else {}
        if found.w is not None:
            points.append(Point("estimate", found.w, style.ESTIMATE, lines=DIAMOND))
            dots["estimate"] = found.w
        if self._truth is not None:
            points.append(Point("truth", self._truth, style.EXPERT, lines=CROSS))
        self._bars.log(stream, found.intervals, dots)
        for panel in self.panels:
            for root, see in pictures(panel, self._lens[panel.path]):
                for point in points:
                    x = panel.project(point.w)
                    is_seen = see is None or is_inside(see, x)
                    at = x if see is None else see(x)
                    log_point(stream, root, point, at + _above(panel), is_seen)

    def _log_samples(self, stream: rr.RecordingStream, panel: Panel) -> None:
        """The posterior, as it is and through the lens."""
        samples, lens = self._found.samples, self._lens[panel.path]
        if samples is None:
            return
        thin = samples[:: max(1, math.ceil(len(samples) / MOST_SAMPLES))]
        points = np.unique(panel.project(thin), axis=0)
        for root, see in pictures(panel, lens):
            at = points if see is None else see(points[[is_inside(see, x) for x in points]])
            radii = rr.Radius.ui_points([SAMPLE])
            cloud = rr.Points3D(at + _above(panel) / 2, colors=[style.POLYHEDRON], radii=radii)
            stream.log(f"{root}/samples", cloud)
        if lens is not None:
            log_lens(stream, panel, lens)

    def _lens_of(self, panel: Panel) -> Lens | None:
        """A lens about nearly all samples, where they are close together."""
        samples = self._found.samples
        if samples is None:
            return None
        ends = np.quantile(panel.project(samples), [0.005, 0.995], axis=0)
        return lens_of(panel, ends, is_wide=False)


def is_inside(see: Lens, x: Array) -> bool:
    """Whether a point (3,) lies in what a lens shows."""
    return bool(np.abs(see(x) - see.place).max() <= LENS_RADIUS * 1.001)


def _above(panel: Panel) -> Array:
    """Where points lie over a flat panel, which would hide half of them."""
    return np.array([0.0, 0.0, ABOVE if panel.is_flat else 0.0])
