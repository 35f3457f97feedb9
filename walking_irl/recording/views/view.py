"""What a domain must offer so that its world is shown beside the polyhedron."""

from __future__ import annotations

from typing import Protocol, TypeVar

import rerun as rr
import rerun.blueprint as rrb

from walking_irl.recording.experiment import Clock

Motion_contra = TypeVar("Motion_contra", contravariant=True)


class WorldView(Protocol[Motion_contra]):
    """Shows one policy after the other under ``/world``.

    Attributes:
        curves_name: What the curves are, with their unit.
    """

    curves_name: str

    def log_static(self, stream: rr.RecordingStream) -> None:
        """Log what never changes; called once, first."""
        ...

    def log_iteration(
        self, stream: rr.RecordingStream, clock: Clock, motion: Motion_contra, is_last: bool
    ) -> int:
        """Play a motion from ``clock`` on, longer for the last one; returns the frames used."""
        ...

    def view(self) -> rrb.View | rrb.Container:
        """The view of this world in the blueprint."""
        ...

    def curves(self) -> list[str]:
        """Entities of the few curves that are plotted from the start."""
        ...

    def describe(self) -> str:
        """One sentence for the summary: what the view shows."""
        ...
