"""Where a gait's cycle starts: the left foot passes the right one at knot N/2 of 2 N."""

from __future__ import annotations

import mujoco
import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.gait.cycles import drifting_spline

PASSING = 0.25
"""Phase at which the left foot passes the right one [cycles]: the middle of the first step."""


def passing_phase(ahead: Array) -> float | None:
    """Phase [cycles] at which the left foot passes the right one, or None.

    Args:
        ahead: How far the left ankle is before the right, over a whole cycle, shape (2 N,) [m].
    """
    after = np.roll(ahead, -1)
    crossings = np.flatnonzero((ahead <= 0) & (after > 0))
    if len(crossings) == 0:
        return None
    i = int(crossings[np.argmax((after - ahead)[crossings])])
    return float((i + ahead[i] / (ahead[i] - after[i])) / len(ahead))


def ankles_ahead(walker: Walker, q: Array) -> Array:
    """How far the left ankle is before the right one in each posture, shape (n,) [m]."""
    model, data = walker.model, mujoco.MjData(walker.model)
    right, left = (model.site(f"ankle_{side}").id for side in "rl")
    ahead = np.empty(len(q))
    for k, row in enumerate(q):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        ahead[k] = data.site_xpos[left, 0] - data.site_xpos[right, 0]
    return ahead


def anchored_cycle(walker: Walker, q: Array, step_length: float, n: int | None = None) -> Array:
    """A whole cycle moved on in time so that the left foot passes the right at its quarter.

    Args:
        walker: Who walks.
        q: Joint positions over one cycle, the last sample not repeated, shape (m, nv).
        step_length: L [m].
        n: Samples wanted; as many as there are by default.

    Returns:
        Shape (n, nv), from x = 0 on. Where ``n`` is the file's own number, rows are only rotated,
        so the start is the nearest sample; splines between the samples otherwise.
    """
    m = len(q)
    n = n or m
    passing = passing_phase(ankles_ahead(walker, q))
    start = 0.0 if passing is None else (passing - PASSING) * m
    whole = round(start)
    drift = np.zeros(q.shape[1])
    drift[0] = 2 * step_length
    if n == m:
        out = np.roll(q, -whole, axis=0)
        out[m - whole % m :, 0] += 2 * step_length
    else:
        out = drifting_spline(q, 1.0, drift)((start / m + np.arange(n) / n) % 1.0)[0]
        out[:, 0] += 2 * step_length * np.floor(start / m + np.arange(n) / n)
    out[:, 0] -= out[0, 0]
    return np.asarray(out)
