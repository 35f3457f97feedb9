"""Records what a method found: its log entry by entry, then its answer."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Generic, TypeVar

import rerun.blueprint as rrb

from walking_irl.recording import method
from walking_irl.recording.blueprint import bars_view, plot_view, plot_views, shadow_view, window
from walking_irl.recording.experiment import Clock, Experiment
from walking_irl.recording.method import Found
from walking_irl.recording.method_view import DISTANCE, OBJECTIVE, MethodView
from walking_irl.recording.panels import panels
from walking_irl.recording.stream import RecordingFile
from walking_irl.recording.views.view import WorldView
from walking_irl.recording.writer import FRAMES_WITHOUT_WORLD, title_of

Motion = TypeVar("Motion")
PLAYED, LONGEST = 240, 40
"""Frames over which a log is spread, and the most that an entry takes of them."""


class MethodRecorder(RecordingFile, Generic[Motion]):
    """Context manager that records a method's answer, and how it came there.

    Args:
        path: The ``.rrd`` file; whether it can be written is checked now.
        experiment: What is known before the method runs.
        found: Its answer.
        world: What to show beside the weights, or None.

    Raises:
        RecordingError: If ``path`` cannot be written, now or at the end, or Rerun is disabled.
    """

    def __init__(
        self,
        path: str | Path,
        experiment: Experiment,
        found: Found,
        world: WorldView[Motion] | None = None,
    ) -> None:
        super().__init__(path)
        self.experiment, self.found, self.world = experiment, found, world
        self._view = MethodView(experiment, found)

    def play(self, answer: Motion | None, of_entry: Callable[[int], Motion] | None = None) -> None:
        """Show every entry of the log, then the answer.

        Args:
            answer: What the world shows of the policy found; from the start where entries have
                none of their own.
            of_entry: What it shows of an entry.
        """
        shown, first, world_ends = self.found.shown, 0, 0
        each = max(1, min(LONGEST, PLAYED // len(shown)))
        if self.world is not None and of_entry is None and answer is not None:
            world_ends = self.world.log_iteration(self._stream, Clock(0, 0), answer, False)
        for k in shown:
            clock = Clock(first, int(k))
            self._view.log_entry(self._stream, clock, int(k))
            if self.world is not None and of_entry is not None:
                first += self.world.log_iteration(self._stream, clock, of_entry(int(k)), False)
            else:
                first += each
        clock = Clock(max(first, world_ends), int(shown[-1]))
        self._view.log_answer(self._stream, clock)
        if self.world is not None and answer is not None:
            self.world.log_iteration(self._stream, clock, answer, True)
        else:
            clock.set(self._stream, FRAMES_WITHOUT_WORLD)

    def _begin(self) -> None:
        self._stream.send_blueprint(method_blueprint(self.experiment, self.found, self.world))
        self._stream.send_recording_name(f"{title_of(self.experiment)}, {self.found.method}")
        if self.world is not None:
            self.world.log_static(self._stream)
        self._view.log_static(self._stream)

    def _end(self, ending: str | None) -> tuple[str, dict[str, Any]]:
        world = "" if self.world is None else self.world.describe()
        text = method.summary(self.experiment, self.found, world, ending)
        return text, method.properties(self.experiment, self.found, ending)


def method_blueprint(
    experiment: Experiment, found: Found, world: WorldView[Any] | None
) -> rrb.Blueprint:
    """World left, weights right as far as there are any; below bars, curves and the text."""
    has_weights = found.w is not None or found.iterates is not None
    shown = panels(experiment.names) if has_weights else []
    shadows = [shadow_view(panel, len(shown), False) for panel in shown]
    top: list[rrb.View | rrb.Container] = [] if world is None else [world.view()]
    if shadows:
        top.append(rrb.Horizontal(*shadows, name="Weights"))
    objective = "Objective (log10)" if found.is_logarithmic else "Objective"
    curves = [plot_view(objective, [f"/{OBJECTIVE}"])]
    if found.iterates is not None and experiment.w_expert is not None:
        curves.append(plot_view("Distance to the ground truth (log10, L1)", [f"/{DISTANCE}"]))
    text = rrb.Tabs(
        rrb.TextDocumentView(origin="/summary", name="What to look at"),
        rrb.TextLogView(origin="/log", name="Log"),
        *([] if world is None else [plot_views(world.curves_name, world.curves())]),
        active_tab=0,
    )
    name = "Weights" if found.intervals is None else "Intervals of the weights"
    bars = [bars_view(experiment, name)] if has_weights else []
    below = [*bars, *([rrb.Vertical(*curves)] if len(found.log) > 1 else []), text]
    bottom = rrb.Horizontal(*below)
    if not top:
        return window(bottom)
    share = max(0.7, 0.5 * len(shadows))
    columns = [1.0, share] if len(top) == 2 else [1.0]
    rows = [rrb.Horizontal(*top, column_shares=columns), bottom]
    return window(rrb.Vertical(*rows, row_shares=[1.6, 1.0]))
