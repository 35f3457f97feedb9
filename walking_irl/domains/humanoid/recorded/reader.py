"""Files of a person's walk in, a :class:`~.person.Person` out; or one sentence why not."""

from __future__ import annotations

from collections.abc import Sequence
from os.path import commonprefix
from pathlib import Path
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.gait.files import N_KNOTS
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.gait.phase import PASSING, passing_phase
from walking_irl.domains.humanoid.recorded.axes import turned
from walking_irl.domains.humanoid.recorded.cycle import (
    Fit,
    contacts,
    drift_angle,
    half_period,
    phases,
    symmetric_fit,
)
from walking_irl.domains.humanoid.recorded.feet import Feet, feet_of, hips_height
from walking_irl.domains.humanoid.recorded.forces import is_force_table, mean_force
from walking_irl.domains.humanoid.recorded.naming import Channels, channels
from walking_irl.domains.humanoid.recorded.person import Options, Person, averaged
from walking_irl.domains.humanoid.recorded.refusals import check_moves, check_walks
from walking_irl.domains.humanoid.recorded.samples import Samples, samples_of
from walking_irl.domains.humanoid.recorded.tables import Table, read_table
from walking_irl.errors import InvalidInputError

LEGS = tuple(
    f"{joint}_{side}"
    for side in "rl"
    for joint in ("hip_flexion", "hip_adduction", "hip_rotation", "knee", "ankle")
)
LEAST_ROWS = 16  # of a cycle that is fitted alone
LEAST_EVENTS = 4
A_CYCLE = 1.95  # steps from which on a record holds a whole cycle
SINKS = 0.010  # of the soles under load [m]
FLOOR = 20  # percentile of the lowest sole point's height that counts as the floor


class Timing(NamedTuple):
    """Phase of each sample [cycles], shape (n,); half period [s]; steps recorded."""

    phase: Array
    half_period: float
    steps: float


def read_person(paths: Sequence[Path], walker: Walker, options: Options | None = None) -> Person:
    """The walk that one or several recordings of a person show.

    Args:
        paths: Files of joint angles, several trials are averaged; and of ground reaction forces,
            each of which belongs to the file of angles whose name is most alike.
        walker: The body that shall walk it.
        options: What the user knows better.

    Raises:
        InvalidInputError: If a file is no recording of a walk; the message names it and says why.
    """
    trials = read_trials(paths, walker, options)
    return trials[0] if len(trials) == 1 else averaged(trials)


def read_trials(
    paths: Sequence[Path], walker: Walker, options: Options | None = None
) -> list[Person]:
    """The same, each trial by itself."""
    options = options or Options()
    tables = [read_table(path) for path in paths]
    plates = [t for t in tables if is_force_table(t)]
    angles = [t for t in tables if not is_force_table(t)]
    if not angles:
        raise InvalidInputError(
            f"{paths[0]} holds forces only: give the joint angles of the same walk, too"
            if plates
            else "no recording of joint angles is given"
        )
    owner = [max(angles, key=lambda a, p=p: _alike(a.path, p.path)) for p in plates]  # type: ignore[misc]
    return [
        person_of(a, walker, options, [p for p, o in zip(plates, owner, strict=True) if o is a])
        for a in angles
    ]


def _alike(a: Path, b: Path) -> int:
    return len(commonprefix([a.name, b.name]))


def person_of(
    table: Table, walker: Walker, options: Options, plates: Sequence[Table] = ()
) -> Person:
    """The walk of one table.

    Args:
        table: Joint angles.
        walker: The body that shall walk it.
        options: What the user knows better.
        plates: Ground reaction forces of the same walk.

    Raises:
        InvalidInputError: If it is not a walk.
    """
    try:
        found = channels(table, walker.joints, options.convention)
        s = samples_of(found, walker, options)
        check_moves(s.motion, walker)
        timing = _timing(s, walker, found, options)
        s = s.moved(turned(s.motion, drift_angle(timing.phase, s.known, walker.mirror)))
        fit = symmetric_fit(timing.phase, s.known, walker.mirror)
        check_walks(fit, timing.half_period, s, walker)
        return _person(table, found, s, fit, timing, walker, plates)
    except InvalidInputError as error:
        if any(str(t.path) in str(error) for t in (table, *plates)):
            raise
        raise InvalidInputError(f"{table.path}: {error}") from error


def _timing(s: Samples, walker: Walker, c: Channels, options: Options) -> Timing:
    """Where in the cycle each sample is: by contacts where there are many, else by symmetry."""
    t = s.motion.time
    if c.is_percent and options.cycle_time is not None:
        phase = t / options.cycle_time
        return Timing(phase, options.cycle_time / 2, float(2 * np.ptp(phase)))
    heel = s.feet.heel[:, :, 0]
    found = contacts(t, heel[:, 0], heel[:, 1])
    if len(found.time) >= LEAST_EVENTS:
        phase, T = phases(t, found)
        s.motion.is_whole[(t < found.time[0]) | (t > found.time[-1])] = False
        return Timing(phase, T, float(len(found.time) - 1))
    legs = np.array([walker.joints.index(n) for n in LEGS])
    T = half_period(t, s.known, walker.mirror, legs)
    return Timing((t - t[0]) / (2 * T), T, float((t[-1] - t[0]) / T))


def _person(
    table: Table,
    c: Channels,
    s: Samples,
    fit: Fit,
    timing: Timing,
    walker: Walker,
    plates: Sequence[Table],
) -> Person:
    """The record of a walk that was understood."""
    T, steps = timing.half_period, timing.steps
    start = _start(fit, walker)
    knots = start + np.arange(2 * N_KNOTS) / (2 * N_KNOTS)
    q = fit.at(knots)
    q[:, 0] -= q[0, 0]
    pelvis, trunk = _neutral(q, walker) if c.convention != "own" else (0.0, 0.0)
    q[:, 2] = _on_the_floor(q[:, 2], feet_of(walker, q)) - hips_height(walker)
    slow = float(np.sqrt(s.scale))
    deviations, lengths, periods = _cycles(s, fit, timing, start, walker)
    notes = list(s.motion.notes)
    if steps < A_CYCLE:
        notes.append(f"{steps:.1f} steps are less than a gait cycle: both sides count as alike")
    legs = [walker.joints.index(n) for n in LEGS]
    force = mean_force(plates, s.motion, timing.phase, knots)
    return Person(
        gait=Gait(q[:N_KNOTS].copy(), fit.step_length, T * slow),
        sources=(table.path, *(p.path for p in plates)),
        format=table.format,
        convention=c.convention,
        unit=c.unit,
        missing=c.missing,
        notes=tuple(notes),
        rate=s.rate,
        seconds=float(np.ptp(s.motion.time)),
        gaps=s.gaps,
        heading=s.motion.heading,
        belt=s.belt,
        scale=s.scale,
        steps=steps,
        half_period=T,
        step_length=fit.step_length / s.scale,
        residual=_degrees(fit.residuals[:, legs]),
        asymmetry=_degrees(fit.asymmetry[legs]),
        pelvis_offset=float(np.rad2deg(pelvis)),
        trunk_offset=float(np.rad2deg(trunk)),
        deviations=deviations,
        lengths=lengths,
        periods=periods * slow,
        force=force,
    )


def _start(fit: Fit, walker: Walker) -> float:
    """Phase of the gait's first knot, so that the left foot passes the right at mid-step."""
    ankles = feet_of(walker, fit.at(np.arange(2 * N_KNOTS) / (2 * N_KNOTS))).ankle[:, :, 0]
    passing = passing_phase(ankles[:, 1] - ankles[:, 0])
    if passing is None:
        raise InvalidInputError("the feet never pass each other: one leg is dragged behind")
    return passing - PASSING


def _degrees(angles: Array) -> float:
    """Root mean square of angles [deg], gaps left aside."""
    return float(np.rad2deg(np.sqrt(np.nanmean(angles**2))))


def _neutral(q: Array, walker: Walker) -> tuple[float, float]:
    """Take mean pelvic tilt and mean trunk lean out, in place; both are returned [rad].

    Thighs keep their direction in space, and so does the trunk's motion about its mean.
    """
    at = {j: i for i, j in enumerate(walker.joints)}
    tilt = float(q[:, at["root_pitch"]].mean())
    q[:, at["root_pitch"]] -= tilt
    q[:, at["lumbar_flexion"]] += tilt
    lean = float((q[:, at["root_pitch"]] + q[:, at["lumbar_flexion"]]).mean())
    q[:, at["lumbar_flexion"]] -= lean
    for side in "rl":
        q[:, at[f"hip_flexion_{side}"]] -= tilt
        q[:, at[f"shoulder_{side}"]] += lean
    return tilt, lean


def _on_the_floor(heights: Array, feet: Feet) -> Array:
    """Heights of the hips above the floor, so that the lowest soles sink a little [m]."""
    lowest = heights - feet.below
    return np.asarray(heights - np.percentile(lowest, FLOOR) - SINKS)


def _cycles(
    s: Samples, fit: Fit, timing: Timing, start: float, walker: Walker
) -> tuple[Array, Array, Array]:
    """Each whole cycle's deviations (n, N, nv), step length (n,) and half period (n,).

    A record of less than two cycles counts as one, without deviations.
    """
    use = s.motion.is_whole
    t, p, q = s.motion.time[use], timing.phase[use], s.motion.q[use]
    knots = start + np.arange(N_KNOTS) / (2 * N_KNOTS)
    mean = fit.at(knots)
    rows, lengths, periods = [], [], []
    n = int(np.floor(np.ptp(p) + 1e-6))
    for k in range(n if n > 1 else 0):
        inside = (p >= p[0] + k) & (p <= p[0] + k + 1)
        if inside.sum() < LEAST_ROWS or np.ptp(p[inside]) < 0.9:
            continue
        harmonics = min(fit.harmonics, int(inside.sum()) // 6)
        own = symmetric_fit(p[inside], q[inside], walker.mirror, harmonics)
        row = own.at(knots) - mean
        row[:, 0] -= row[0, 0]
        rows.append(row)
        lengths.append(own.step_length)
        periods.append(float(np.polyfit(p[inside], t[inside], 1)[0]) / 2)
    if not rows:
        nothing = np.zeros((1, *mean.shape))
        return nothing, np.array([fit.step_length]), np.array([timing.half_period])
    return np.array(rows), np.array(lengths), np.array(periods)
