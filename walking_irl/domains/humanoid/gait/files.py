"""Gaits as files that anyone can read: ``time`` and one column per joint, ``.npz`` or ``.csv``.

A file holds one whole gait cycle at equal time steps, the last row not repeated: joint angles
[rad], root positions [m] and angles [rad], by the model's joint names.
"""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.gait.cycles import mirror_average
from walking_irl.domains.humanoid.gait.gait import Gait, whole_cycle
from walking_irl.domains.humanoid.gait.phase import anchored_cycle
from walking_irl.domains.humanoid.recorded.tables import read_table
from walking_irl.errors import InvalidInputError
from walking_irl.files import write_arrays, write_file

N_KNOTS = 40
LEAST_STEP = 0.05  # [m]
UNEVEN = 1e-3
"""Largest relative deviation of a time step from the mean step."""


def save_gait(path: Path, gait: Gait, walker: Walker) -> None:
    """Write one whole cycle of a gait.

    Raises:
        InvalidInputError: If the file's ending is not .npz or .csv, or it cannot be written.
    """
    q = whole_cycle(gait, walker.mirror)
    columns = {
        "time": np.arange(len(q)) * gait.timestep,
        **dict(zip(walker.joints, q.T, strict=True)),
    }
    _check_ending(path)
    if path.suffix == ".npz":
        write_arrays(path, columns)
    else:
        text = io.StringIO(newline="")
        writer = csv.writer(text)
        writer.writerow(columns)
        writer.writerows(zip(*(map(repr, c.tolist()) for c in columns.values()), strict=True))
        write_file(path, text.getvalue().encode())


def load_gait(path: Path, walker: Walker) -> Gait:
    """Read a gait, resampled to the knots of the optimiser and averaged with its mirror image.

    Raises:
        InvalidInputError: If the file cannot be read, or columns are missing, unknown, of unequal
            length or not finite, or time steps are unequal, or the gait does not go forward.
    """
    _check_ending(path)
    columns = read_table(path).columns
    expected = ["time", *walker.joints]
    missing = [c for c in expected if c not in columns]
    unknown = [c for c in columns if c not in expected]
    if missing or unknown:
        parts = [f"misses {', '.join(missing)}"] if missing else []
        parts += [f"has unknown columns {', '.join(unknown)}"] if unknown else []
        raise InvalidInputError(
            f"{path} {' and '.join(parts)}; {walker.name} needs time and joints"
        )
    if len({len(c) for c in columns.values()}) != 1 or len(columns["time"]) < 8:
        raise InvalidInputError(f"{path} needs columns of one length of at least 8 rows")
    table = np.column_stack([columns[c] for c in expected])
    if not np.isfinite(table).all():
        raise InvalidInputError(f"{path} holds numbers that are not finite")
    steps = np.diff(table[:, 0])
    if steps.min() <= 0 or np.ptp(steps) > UNEVEN * steps.mean():
        raise InvalidInputError(f"{path} needs equal, increasing time steps over one gait cycle")
    gait = _symmetric(table[:, 1:], float(steps.mean()) * len(table), walker)
    if not gait.step_length > LEAST_STEP:
        raise InvalidInputError(
            f"{path} is not a walk: it moves {gait.step_length:.3g} m forward per step"
        )
    return gait


def _symmetric(q: Array, period: float, walker: Walker) -> Gait:
    """Half a cycle of N_KNOTS knots from samples of a whole one, wherever that starts."""
    length = _step_length(q[:, 0])
    q = anchored_cycle(walker, q, length, 2 * N_KNOTS)
    return mirror_average(walker, q, length, period / 2)


def _step_length(x: Array) -> float:
    """L of a symmetric walk, x(t + T) = x(t) + L, from equal samples of a cycle, shape (m,) [m]."""
    m = len(x)
    if m % 2 == 0:
        return float(np.mean(x[m // 2 :] - x[: m // 2]))
    phase = np.arange(m) / m
    waves = [f(4 * np.pi * k * phase) for k in range(1, min(m // 4, 20)) for f in (np.cos, np.sin)]
    columns = np.column_stack([2 * phase, np.ones(m), *waves])
    return float(np.linalg.lstsq(columns, x, rcond=None)[0][0])


def _check_ending(path: Path) -> None:
    if path.suffix not in (".npz", ".csv"):
        raise InvalidInputError(f"a gait file ends in .npz or .csv, got {path.name!r}")
