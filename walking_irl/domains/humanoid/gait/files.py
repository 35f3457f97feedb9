"""Gaits as files that anyone can read: ``time`` and one column per joint, ``.npz`` or ``.csv``.

A file holds one whole gait cycle at equal time steps, the last row not repeated: joint angles
[rad], root positions [m] and angles [rad], by the model's joint names.
"""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.gait.gait import Gait, whole_cycle
from walking_irl.errors import InvalidInputError
from walking_irl.files import UNREADABLE, write_arrays, write_file

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
    columns = _read(path)
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
    """Half a cycle of N_KNOTS knots from samples of a whole one."""
    if len(q) % 2:
        q = _resample(q, len(q) + 1)
    n = len(q) // 2
    length = float(np.mean(q[n:, 0] - q[:n, 0]))
    if n != N_KNOTS:
        q = _resample(q, 2 * N_KNOTS, 2 * length)
    other = q[N_KNOTS:].copy()
    other[:, 0] -= length
    half = (q[:N_KNOTS] + other @ walker.mirror.T) / 2
    half[:, 0] -= half[0, 0]
    return Gait(half, length, period / 2)


def _resample(q: Array, n: int, stride: float | None = None) -> Array:
    """Periodic cubic splines through the samples, at ``n`` equal steps."""
    m = len(q)
    stride = (
        stride if stride is not None else 2 * float(np.mean(q[m // 2 :, 0] - q[: m - m // 2, 0]))
    )
    drift = np.zeros(q.shape[1])
    drift[0] = stride
    phase = np.arange(m + 1) / m
    steady = np.vstack([q - np.outer(phase[:-1], drift), q[:1]])
    at = np.arange(n) / n
    return np.asarray(CubicSpline(phase, steady, bc_type="periodic")(at) + np.outer(at, drift))


def _check_ending(path: Path) -> None:
    if path.suffix not in (".npz", ".csv"):
        raise InvalidInputError(f"a gait file ends in .npz or .csv, got {path.name!r}")


def _read(path: Path) -> dict[str, Array]:
    try:
        if path.suffix == ".npz":
            with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
                return {name: np.asarray(data[name], dtype=float).ravel() for name in data.files}
        with path.open(newline="") as text:
            names, *rows = [row for row in csv.reader(text) if row]
        if len(set(names)) < len(names):
            raise ValueError("a column appears twice")
        table = np.array(rows, dtype=float).reshape(len(rows), -1)
        return dict(zip(names, table.T, strict=True))
    except FileNotFoundError as error:
        raise InvalidInputError(f"there is no file {path}") from error
    except UNREADABLE as error:
        raise InvalidInputError(f"{path} is not a readable {path.suffix} table: {error}") from error
