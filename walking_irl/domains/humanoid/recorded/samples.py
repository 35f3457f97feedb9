"""Samples of one recording, made ready for the fit: in order, at equal steps, straight, to size."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.recorded.axes import (
    Motion,
    cut,
    face_forward,
    motion_of,
    straight_stretch,
)
from walking_irl.domains.humanoid.recorded.feet import Feet, belt_speed, feet_of, hips_height
from walking_irl.domains.humanoid.recorded.naming import Channels
from walking_irl.domains.humanoid.recorded.person import Options
from walking_irl.errors import InvalidInputError

MODEL_HEIGHT = 1.75  # [m]
MOST_HZ = 100.0
"""Samples a second that are used: the fit keeps 9 harmonics of a cycle of about a second."""
GAP = 1.8  # times the usual time step
UNEVEN = 0.2  # spread of time steps over the usual one
LEAST_ROWS = 8
SPARSE = 20  # times longer than its rows: a record of gaps
TREADMILL = 0.25  # [m/s]
LEAST_SCALE, MOST_SCALE = 0.4, 2.5
SLOPE = 0.04
PEOPLE = (0.8, 2.3)  # [m]


@dataclass(frozen=True)
class Samples:
    """A straight walk along x in the model's size, at equal steps of the person's time.

    Attributes:
        motion: Joint positions.
        feet: Where the feet are.
        scale: Model's size over the person's.
        belt: Speed of the treadmill's belt [m/s], or 0.
        rate: Rows a second in the file [Hz].
        gaps: Rows that were left out.
    """

    motion: Motion
    feet: Feet
    scale: float
    belt: float
    rate: float
    gaps: int

    @property
    def known(self) -> Array:
        """Joint positions, NaN where a row does not count, shape (n, nv)."""
        return np.where(self.motion.is_whole[:, None], self.motion.q, np.nan)

    def moved(self, motion: Motion) -> Samples:
        """The same samples with other positions of the root."""
        return replace(self, motion=motion)


def samples_of(c: Channels, walker: Walker, options: Options) -> Samples:
    """The straight and steady part of a recording, to size.

    Raises:
        InvalidInputError: If it is too short, lies on its side, or goes backwards or sideways.
    """
    motion = _ordered(_motion(c, walker, options))
    motion, rate, gaps = _even(_chosen(motion, options))
    motion = face_forward(straight_stretch(motion))
    return _sized(motion, walker, c.convention == "own", options, rate, gaps)


def _motion(c: Channels, walker: Walker, options: Options) -> Motion:
    """Channels as joints; the hips lie as far below a pelvis's frame as the person is tall."""
    c = _timed(c, options)
    motion = motion_of(c, walker, hips_height(walker))
    rows = np.flatnonzero(motion.is_whole)
    if not motion.has_height or c.convention == "own" or len(rows) == 0:
        return motion
    some = motion.q[rows[:: max(1, len(rows) // 200)]]
    size = float(np.median(some[:, 2]) / np.median(feet_of(walker, some).below))
    return motion_of(c, walker, hips_height(walker), size)


def _timed(c: Channels, options: Options) -> Channels:
    """Channels whose time is in seconds."""
    if not c.is_percent:
        return c
    period = options.cycle_time
    if period is None:
        raise InvalidInputError(
            "the table is in percent of the gait cycle and has no time: say how long a cycle takes "
            "(--cycle-time SECONDS)"
        )
    if not (np.isfinite(period) and 0.4 < period < 3.0):
        raise InvalidInputError(f"a gait cycle takes 0.4 to 3 seconds, got {period}")
    return replace(c, time=c.time * period)


def _ordered(m: Motion) -> Motion:
    """Rows in the order of their times, each time once."""
    known = np.flatnonzero(np.isfinite(m.time))
    order = known[np.argsort(m.time[known], kind="stable")]
    order = order[np.r_[True, np.diff(m.time[order]) > 0]] if len(order) else order
    if m.is_whole[order].sum() < LEAST_ROWS:
        raise InvalidInputError(
            f"the record is too short: {int(m.is_whole[order].sum())} rows without gaps, expected "
            f"at least {LEAST_ROWS}"
        )
    notes = list(m.notes)
    if len(order) < len(m.time) or np.any(np.diff(order) < 0):
        notes.append("times repeat, are missing or go back: rows were put in order")
    return replace(
        m, time=m.time[order], q=m.q[order], is_whole=m.is_whole[order], notes=tuple(notes)
    )


def _chosen(m: Motion, options: Options) -> Motion:
    """The part of the record that the user asked for."""
    if options.start is None and options.stop is None:
        return m
    start = options.start or 0.0
    stop = np.inf if options.stop is None else options.stop
    if not start < stop:
        raise InvalidInputError(f"the part from {start} to {stop} s is empty")
    inside = (m.time - m.time[0] >= start - 1e-9) & (m.time - m.time[0] <= stop + 1e-9)
    if (inside & m.is_whole).sum() < LEAST_ROWS:
        raise InvalidInputError(
            f"the record is too short: {int((inside & m.is_whole).sum())} rows from {start:g} to "
            f"{stop:g} s of {m.time[-1] - m.time[0]:.2f} s"
        )
    first, last = np.flatnonzero(inside)[[0, -1]]
    return cut(m, slice(int(first), int(last) + 1), f"part from {start:g} to {stop:g} s")


def _even(m: Motion) -> tuple[Motion, float, int]:
    """Equal time steps, at most MOST_HZ; with the rate of the file [Hz] and its rows with gaps."""
    steps = np.diff(m.time)
    usual, good = float(np.median(steps)), m.is_whole
    rate, notes = 1 / usual, list(m.notes)
    gaps = int((~good).sum())
    t = m.time[good]
    if t[-1] - t[0] > SPARSE * usual * len(m.time):
        raise InvalidInputError(
            f"times are not of one recording: {len(m.time)} rows, most {usual:.3g} s apart, span "
            f"{t[-1] - t[0]:.3g} s"
        )
    n = max(round((t[-1] - t[0]) * min(rate, MOST_HZ)), 1)
    even = np.linspace(t[0], t[-1], n + 1)
    is_whole = np.ones(len(even), dtype=bool)
    for before, after in zip(t[:-1], t[1:], strict=True):
        if after - before > GAP * usual:
            is_whole &= (even <= before) | (even >= after)
    longest = float(np.diff(t).max())
    if gaps or longest > GAP * usual:
        notes.append(f"{gaps} rows with a gap left out, the longest gap takes {longest:.2f} s")
    if np.percentile(steps, 95) - np.percentile(steps, 5) > UNEVEN * usual:
        notes.append("time steps are uneven: resampled")
    q = np.column_stack([np.interp(even, t, column) for column in m.q[good].T])
    return replace(m, time=even, q=q, is_whole=is_whole, notes=tuple(notes)), rate, gaps


def _sized(
    m: Motion, walker: Walker, is_own: bool, options: Options, rate: float, gaps: int
) -> Samples:
    """The walk in the model's size, its path moved on with a treadmill's belt."""
    q, notes = m.q.copy(), list(m.notes)
    feet = feet_of(walker, q)
    scale = _scale(m, feet, is_own, options)
    if not m.has_height:
        notes.append("no height of the pelvis: the person's size is unknown, taken as the model's")
        q[:, 2] = feet.below / scale
    q[:, :3] *= scale
    belt = belt_speed(m.time, q[:, 0], feet)
    if options.belt is not None:
        belt = -options.belt * scale
    path = float(np.polyfit(m.time, q[:, 0], 1)[0])
    is_treadmill = options.belt is not None or abs(belt) > max(TREADMILL, 2 * abs(path))
    if is_treadmill or not m.has_path:
        q[:, 0] -= belt * (m.time - m.time[0])
    if not m.has_path:
        notes.append("no path of the pelvis: it moves over the foot that stands")
    elif is_treadmill:
        notes.append("treadmill: the pelvis is moved on with the belt")
    elif abs(belt) > TREADMILL * scale:
        notes.append(
            f"feet that stand slide by {abs(belt) / scale:.2f} m/s: are path and size in one unit?"
        )
    notes += _slope(q, is_treadmill)
    speed = -belt / scale if is_treadmill and m.has_path else 0.0
    return Samples(replace(m, q=q, notes=tuple(notes)), feet, scale, speed, rate, gaps)


def _scale(m: Motion, feet: Feet, is_own: bool, options: Options) -> float:
    """Model's size over the person's."""
    if options.height is not None:
        low, high = PEOPLE
        if not low < options.height < high:
            raise InvalidInputError(f"people are {low} to {high} m tall, got {options.height}")
        return MODEL_HEIGHT / options.height
    if is_own or not m.has_height:
        return 1.0
    scale = float(np.median(feet.below) / np.median(m.q[:, 2]))
    if not LEAST_SCALE < scale < MOST_SCALE:
        raise InvalidInputError(
            f"hips at {np.median(m.q[:, 2]):.2f} m do not fit legs of {np.median(feet.below):.2f} "
            "m: which unit has the pelvis's path? (--height states the size instead)"
        )
    return scale


def _slope(q: Array, is_treadmill: bool) -> list[str]:
    """What to say of a way that is not level."""
    if is_treadmill or np.ptp(q[:, 0]) < 1:
        return []
    slope = float(np.polyfit(q[:, 0], q[:, 2], 1)[0])
    if abs(slope) < SLOPE:
        return []
    return [f"the way rises by {100 * slope:.0f} %: read as if it were level"]
