"""Ground reaction forces from files of force plates, as one curve of a step.

OpenSim's files name a plate by foot (``ground_force_r_vy``), by number (``ground_force_1_vy``,
``1_ground_force_vy``) or not at all. A plate sees a foot or it does not: of each foot only stances
that load the plate fully count.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.recorded.axes import TO_MODEL, Motion
from walking_irl.domains.humanoid.recorded.tables import Table
from walking_irl.errors import InvalidInputError

FORCE = re.compile(r"^(?P<plate>.*force.*?)_?v(?P<axis>[xyz])$", re.I)
SIDE = re.compile(r"(?:^|_)(r|right|l|left)(?:_|$)", re.I)
MID_SWING = {"r": 0.75, "l": 0.25}
"""Phases at which a foot is in the air: its stances are told apart there."""
FULL = 0.7  # of the highest peak: a stance that loads the plate by less is cut off
IN_THE_AIR = 0.1  # of a stance's peak: what a plate may read before and after it
COVERED = 0.6  # share of the cycle that must have been seen; the rest is swing
LEAST_ROWS = 8


def is_force_table(table: Table) -> bool:
    """Whether a table holds ground reaction forces."""
    return any(FORCE.match(n.strip()) for n in table.columns) and not any(
        "hip_flexion" in n for n in table.columns
    )


def mean_force(plates: Sequence[Table], m: Motion, phase: Array, knots: Array) -> Array | None:
    """Force under the right foot, mean of both feet, over a whole cycle.

    Args:
        plates: Tables of forces.
        m: The walk that they belong to, in its own time, with its heading.
        phase: Of the walk's samples [cycles].
        knots: Phases at which the force is wanted [cycles], shape (2 N,); the first is the gait's.

    Returns:
        Shape (2 N, 3), x forward, y left, z up [body weights], or None without plates.

    Raises:
        InvalidInputError: If plates and walk have no time in common, or no stance is whole.
    """
    stances: list[Array] = []
    for table in plates:
        stances += _stances(table, m, phase, knots[0])
    if not plates:
        return None
    names = ", ".join(str(t.path) for t in plates)
    highest = max((float(np.nanmax(s[:, 3])) for s in stances), default=0.0)
    whole = [s for s in stances if np.nanmax(s[:, 3]) > FULL * highest > 0]
    if not whole:
        raise InvalidInputError(f"{names}: no foot loads a plate during the walk")
    at = knots - knots[0]
    seen = np.concatenate(whole)
    bins = np.floor((seen[:, 0] % 1.0) * len(at) + 0.5).astype(int) % len(at)
    count = np.bincount(bins, minlength=len(at))
    if np.mean(count > 0) < COVERED:
        raise InvalidInputError(
            f"{names}: only {100 * np.mean(count > 0):.0f} % of a gait cycle were seen"
        )
    sums = [np.bincount(bins, seen[:, 1 + k], len(at)) for k in range(3)]
    has = count > 0
    curve = np.column_stack([np.interp(at, at[has], s[has] / count[has], period=1.0) for s in sums])
    weight = 2 * float(curve[:, 2].mean())  # momentum is periodic: both feet carry one weight
    return np.asarray(curve / weight)


def _stances(table: Table, m: Motion, phase: Array, first: float) -> list[Array]:
    """Each stance's phase from the gait's first knot and force as the right foot's, (n, 4)."""
    time, plates = _plates(table)
    rows = (time >= m.time[0]) & (time <= m.time[-1])
    if rows.sum() < LEAST_ROWS:
        raise InvalidInputError(
            f"{table.path} and the joint angles have no time in common: {time[0]:.2f} to "
            f"{time[-1]:.2f} s and {m.time[0]:.2f} to {m.time[-1]:.2f} s"
        )
    heading = np.deg2rad(m.heading)
    cos, sin = np.cos(heading), np.sin(heading)
    at = np.interp(time[rows], m.time, phase) - first
    moves = np.interp(time[rows], m.time, np.gradient(phase, m.time)) > 0  # within the contacts
    out = []
    for name, force in plates.items():
        f = np.nan_to_num(force[rows] @ TO_MODEL.T)
        f[:, :2] = f[:, :2] @ np.array([[cos, -sin], [sin, cos]])
        side = _side(name, at, f[:, 2])
        if side == "l":
            f[:, 1] *= -1
        p = at if side == "r" else at - 0.5
        stance = np.floor(p - MID_SWING["r"])
        for k in np.unique(stance):
            part = (stance == k) & moves
            if part.sum() > LEAST_ROWS and _is_whole(f[part, 2]):
                out.append(np.column_stack([p[part], f[part]]))
    return out


def _is_whole(vertical: Array) -> bool:
    """Whether a foot comes down and leaves again while it is seen."""
    peak = float(vertical.max())
    return peak > 0 and max(vertical[0], vertical[-1]) < IN_THE_AIR * peak


def _plates(table: Table) -> tuple[Array, Mapping[str, Array]]:
    """Times [s] and force of each plate [N], shape (n, 3), in the file's axes."""
    columns = {n.strip().lower(): c for n, c in table.columns.items()}
    if "time" not in columns:
        raise InvalidInputError(f"{table.path} misses time")
    axes: dict[str, dict[str, Array]] = {}
    for name, column in columns.items():
        if found := FORCE.match(name):
            axes.setdefault(found["plate"], {})[found["axis"]] = column
    plates = {
        n: np.column_stack([a[k] for k in "xyz"]) for n, a in axes.items() if set(a) == set("xyz")
    }
    if not plates:
        raise InvalidInputError(f"{table.path} misses a force's vx, vy and vz")
    return columns["time"], plates


def _side(name: str, at: Array, vertical: Array) -> str:
    """Whose foot a plate carries: by its name, or by when it is loaded."""
    if found := SIDE.search(name):
        return found[1][0].lower()
    middle = np.angle(np.sum(vertical * np.exp(2j * np.pi * at))) / (2 * np.pi)
    return "r" if 0.0 <= middle % 1.0 < 0.5 else "l"
