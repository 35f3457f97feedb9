"""What a recording says about the run it shows, and the clock that its rows share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from walking_irl.arrays import Array
from walking_irl.domains.contract import Truth
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
        truth: Ground-truth weights and noise-free features where they are known; for pictures only.
        question: What the run answers, as the summary's title; "" for a general one.
        answer: What the run found, as Markdown, where the weights are not the loop's own; "" for a
            text about the loop's.
        others: Names of further points, at most 4, that every iteration shows in the query's place.
    """

    domain: str
    objectives: Sequence[Objective]
    expert: Expert
    centre: str = "ac"
    mode: str = "optimal"
    seed: int | None = None
    truth: Truth | None = None
    question: str = ""
    answer: str = ""
    others: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if len(self.others) > len(OTHERS):
            raise InvalidInputError(
                f"at most {len(OTHERS)} other points have colours, got {len(self.others)}"
            )
        K = len(self.objectives)
        for what, x in (("expert.mu", self.expert.mu), ("truth.w", self.w_expert)):
            if x is not None and np.shape(x) != (K,):
                raise InvalidInputError(f"{what} must have shape ({K},), got {np.shape(x)}")

    @property
    def w_expert(self) -> Array | None:
        """Ground-truth weights, shape (K,), or None."""
        return None if self.truth is None else self.truth.w

    @property
    def names(self) -> list[str]:
        """Names of the objectives."""
        return [o.name for o in self.objectives]


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
