"""A person's walk from recordings: one symmetric cycle of the model's body, and what was seen.

The person's mean pelvic tilt and trunk lean are taken out: frames of pelvis and trunk differ by
10-20 degrees between marker sets, while thighs and trunk keep their directions in space. Lengths
are scaled to the model's legs and times to the square root of that (A. L. Hof 1996, Gait Posture
4:222); angles stay as they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.recorded.closeness import Walk
from walking_irl.errors import InvalidInputError

ONE_PERSON = 1.15
"""Largest ratio of sizes that recordings of one person are read with."""


@dataclass(frozen=True)
class Options:
    """What the user knows better than the file.

    Attributes:
        start: First second that is used, from the file's first row, or None.
        stop: Last second that is used, or None.
        height: Of the person [m], or None.
        belt: Speed of the treadmill [m/s], or None.
        cycle_time: Duration of a gait cycle [s], for tables in percent of the cycle.
        convention: Whose signs the angles have, or None.
    """

    start: float | None = None
    stop: float | None = None
    height: float | None = None
    belt: float | None = None
    cycle_time: float | None = None
    convention: str | None = None


@dataclass(frozen=True)
class Person:
    """One person's walk, as the model's body would walk it, and what stands behind it.

    Attributes:
        gait: Symmetric mean cycle in the model's size; the left foot passes the right at mid-step.
        sources: Files that it was read from.
        format: What the first file is, in words.
        convention: Whose names and signs it uses.
        unit: Of its angles.
        missing: Columns that were not there; their joints rest at zero.
        notes: What was decided on the way, a sentence each.
        rate: Rows a second [Hz].
        seconds: Duration of the parts used [s].
        gaps: Rows left out.
        heading: Direction of the walk in the laboratory [deg].
        belt: Speed of the treadmill's belt [m/s], or 0.
        scale: Model's size over the person's.
        steps: Steps that were recorded.
        half_period: Duration of a step of the person [s].
        step_length: Of the person [m].
        residual: Root mean square of legs' angles about the cycle [deg].
        asymmetry: Of the legs' mean angles, right against left, root mean square [deg].
        pelvis_offset: Mean pelvic tilt that was taken out [deg].
        trunk_offset: Mean lean of the trunk that was taken out [deg].
        deviations: Of each whole cycle's joint positions from the mean, shape (n, N, nv).
        lengths: Step length of each whole cycle in the model's size, shape (n,) [m].
        periods: Half period of each whole cycle in the model's time, shape (n,) [s].
        force: Ground reaction force under the right foot (mean of both feet) over the whole cycle
            from the gait's first knot, x forward, y left, z up, shape (2 N, 3) [body weights]; or
            None.
    """

    gait: Gait
    sources: tuple[Path, ...]
    format: str
    convention: str
    unit: str
    missing: tuple[str, ...]
    notes: tuple[str, ...]
    rate: float
    seconds: float
    gaps: int
    heading: float
    belt: float
    scale: float
    steps: float
    half_period: float
    step_length: float
    residual: float
    asymmetry: float
    pelvis_offset: float
    trunk_offset: float
    deviations: Array = field(repr=False)
    lengths: Array = field(repr=False)
    periods: Array = field(repr=False)
    force: Array | None = field(default=None, repr=False)

    @property
    def speed(self) -> float:
        """Walking speed of the person [m/s]."""
        return self.step_length / self.half_period

    @property
    def cadence(self) -> float:
        """Steps a minute."""
        return 60 / self.half_period

    @property
    def cycles(self) -> int:
        """Whole cycles that were recorded."""
        return len(self.deviations)

    @property
    def walk(self) -> Walk:
        """The walk as data: its gait, how well that is known, and its force."""
        known: Array | float = (
            0.0 if self.cycles < 2 else self._rows.var(axis=0, ddof=1) / self.cycles
        )
        force = None if self.force is None else self.force[:, 2]
        return Walk(self.gait, self.missing, known, force)

    @property
    def _rows(self) -> Array:
        """Deviations of each cycle's gait vector, shape (n, N nv + 2)."""
        flat = self.deviations.reshape(self.cycles, -1)
        return np.column_stack([flat, self.lengths, self.periods])

    @property
    def covariance(self) -> Array | None:
        """Covariance of the mean gait's vector [q row by row, L, T]; None from fewer than 2 cycles.

        Its rank is the number of cycles less one.
        """
        n = self.cycles
        if n < 2:
            return None
        return np.asarray(np.cov(self._rows.T) / n)


def averaged(trials: Sequence[Person]) -> Person:
    """Several trials of one person as one, each weighted by its steps.

    Raises:
        InvalidInputError: If they differ by more than one person's trials do.
    """
    scales = [p.scale for p in trials]
    if max(scales) > ONE_PERSON * min(scales):
        raise InvalidInputError(
            f"the recordings are not of one person: sizes differ by a factor of "
            f"{max(scales) / min(scales):.2f}"
        )
    weight = np.array([p.steps for p in trials]) / sum(p.steps for p in trials)

    def mean(values: Sequence[float]) -> float:
        return float(weight @ np.array(values))

    def together(values: Sequence[Array]) -> Array:
        return np.concatenate(values)

    forces = [p.force for p in trials if p.force is not None]
    vector = np.tensordot(weight, np.array([p.gait.to_vector() for p in trials]), 1)
    gait = Gait.from_vector(vector, trials[0].gait.q.shape[1])
    return replace(
        trials[0],
        gait=gait,
        sources=tuple(s for p in trials for s in p.sources),
        notes=tuple(f"{p.sources[0].name}: {n}" for p in trials for n in p.notes),
        missing=tuple(dict.fromkeys(m for p in trials for m in p.missing)),
        seconds=sum(p.seconds for p in trials),
        gaps=sum(p.gaps for p in trials),
        steps=sum(p.steps for p in trials),
        scale=mean(scales),
        half_period=mean([p.half_period for p in trials]),
        step_length=mean([p.step_length for p in trials]),
        residual=mean([p.residual for p in trials]),
        asymmetry=mean([p.asymmetry for p in trials]),
        belt=mean([p.belt for p in trials]),
        deviations=together([p.deviations + (p.gait.q - gait.q) for p in trials]),
        lengths=together([p.lengths for p in trials]),
        periods=together([p.periods for p in trials]),
        force=np.mean(forces, axis=0) if forces else None,
    )
