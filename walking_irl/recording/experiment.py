"""What a recording says about the run it shows, and the clock that its rows share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.recording.style import OTHERS, PLAYBACK_RATE
from walking_irl.types import Expert, Objective


class Other(NamedTuple):
    """A further point among the weights, beside the query."""

    w: Array
    """Shape (K,)."""
    share: float | None = None
    """Share of the polyhedron's volume that a query there leaves, where it is known."""


@dataclass(frozen=True)
class Experiment:
    """What is known before the first iteration.

    Attributes:
        domain: Name of the domain.
        objectives: The K objectives, in the order of every weight vector.
        expert: What the learner is told about the expert.
        centre: Which centre of the polyhedron is queried.
        mode: The loop's mode.
        seed: Seed of the experiment, or None.
        w_expert: Hidden weights where they are known, shape (K,); for the picture only.
        others: Names of further points, at most 4, that every iteration shows in the query's place.
    """

    domain: str
    objectives: Sequence[Objective]
    expert: Expert
    centre: str = "ac"
    mode: str = "optimal"
    seed: int | None = None
    w_expert: Array | None = None
    others: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if len(self.others) > len(OTHERS):
            raise InvalidInputError(
                f"at most {len(OTHERS)} other points have colours, got {len(self.others)}"
            )
        K = len(self.objectives)
        for what, x in (("expert.mu", self.expert.mu), ("w_expert", self.w_expert)):
            if x is not None and np.shape(x) != (K,):
                raise InvalidInputError(f"{what} must have shape ({K},), got {np.shape(x)}")

    @property
    def names(self) -> list[str]:
        """Names of the objectives."""
        return [o.name for o in self.objectives]

    def relative_loss(self, mu: Array) -> float | None:
        """(J_E - J) / |J_E| under the hidden weights; None where they are not known."""
        if self.w_expert is None:
            return None
        J_E, J = float(self.w_expert @ self.expert.mu), float(self.w_expert @ mu)
        return (J_E - J) / max(abs(J_E), 1e-300)


@dataclass(frozen=True)
class Clock:
    """A stretch of frames that shows one iteration.

    Attributes:
        first: Global index of its first frame.
        iteration: Index of the iteration.
    """

    first: int
    iteration: int

    def set(self, stream: rr.RecordingStream, offset: int = 0) -> None:
        """Put what is logged next at frame ``first + offset``."""
        frame = self.first + offset
        stream.set_time("frame", sequence=frame)
        stream.set_time("sim_time", duration=frame / PLAYBACK_RATE)
        stream.set_time("iteration", sequence=self.iteration)

    def columns(self, n_frames: int) -> list[rr.TimeColumn]:
        """Index columns of ``n_frames`` rows, one per frame."""
        frame: NDArray[np.int64] = self.first + np.arange(n_frames)
        return [
            rr.TimeColumn("frame", sequence=frame),
            rr.TimeColumn("sim_time", duration=frame / PLAYBACK_RATE),
            rr.TimeColumn("iteration", sequence=np.full(n_frames, self.iteration)),
        ]
