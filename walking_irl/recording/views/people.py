"""A person's walk as a ghost, the nearest gait of the body, and the best one for the weights."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import rerun as rr
import rerun.blueprint as rrb

from walking_irl.recording import style
from walking_irl.recording.experiment import Clock
from walking_irl.recording.views.body_geometry import log_body
from walking_irl.recording.views.gait import BESIDE, WalkerView
from walking_irl.recording.views.motion import check_rollout, play
from walking_irl.recording.views.norm_panels import NormPanels
from walking_irl.types import Rollout

COLOURS = (style.EXPERT, style.OTHERS[1], style.LEARNER)
"""Of the person, the nearest gait and the best one."""
NEAREST = style.with_alpha(COLOURS[1], 0.62)


class PersonView(WalkerView):
    """Three walkers side by side: recorded (left, kinematic), best (middle), nearest (right).

    Args:
        model: The body.
        recorded: The person's cycle; no forces could make it.
        nearest: The nearest gait of the body.
        panels: Their curves, shown below them.
    """

    names = ("best", "recorded")
    title = "Recorded (red ghost), best for the weights, nearest possible (violet)"
    eye = ((2.7, -0.9, 1.15), (0.0, 0.0, 0.8))

    def __init__(
        self,
        model: mujoco.MjModel,
        recorded: Rollout,
        nearest: Rollout,
        panels: NormPanels | None = None,
    ) -> None:
        check_rollout(model, nearest)
        super().__init__(model, recorded)
        self.nearest = nearest
        self.panels = panels

    def log_static(self, stream: rr.RecordingStream) -> None:
        """Log the third body, too."""
        super().log_static(stream)
        log_body(stream, self.model, "world/nearest", NEAREST)
        if self.panels is not None:
            self.panels.log_static(stream)

    def view(self) -> rrb.View | rrb.Container:
        """The walkers, and their curves below."""
        walkers = super().view()
        if self.panels is None:
            return walkers
        return rrb.Vertical(walkers, self.panels.view(), row_shares=[1.2, 1.0])

    def log_iteration(
        self, stream: rr.RecordingStream, clock: Clock, motion: Rollout, is_last: bool
    ) -> int:
        """Play all three from the same place in the same phase."""
        start = self._x
        n = super().log_iteration(stream, clock, motion, is_last)
        frames = play(self.model, self.nearest, n, start)
        moved = replace(frames, position=frames.position - [0.0, BESIDE, 0.0])
        self._log_walker(stream, clock, "world/nearest", moved)
        return n

    def describe(self) -> str:
        """One sentence for the summary."""
        return (
            "the best gait for the weights between the person's recorded walk (**red ghost**, "
            "left, moved without forces) and the nearest gait that the body can walk (right)"
        )
