"""Whole gait cycles: splines through one, and its mean with its mirror image."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.gait.gait import Gait


def mirror_average(walker: Walker, q: Array, step_length: float, half_period: float) -> Gait:
    r"""Mean of a whole cycle and its mirror image, from x = 0 on.

    .. math:: \bar q_i = \tfrac12 (q_i + S (q_{i+N} - L e_x)), \quad i < N

    Args:
        walker: Whose mirror.
        q: Joint positions of a cycle, shape (2 N, nv).
        step_length: L [m].
        half_period: T [s].
    """
    n = len(q) // 2
    second = q[n:].copy()
    second[:, 0] -= step_length
    half = (q[:n] + second @ walker.mirror.T) / 2
    half[:, 0] -= half[0, 0]
    return Gait(half, step_length, half_period)


def drifting_spline(
    x: Array, period: float, drift: Array
) -> Callable[[Array], tuple[Array, Array]]:
    """Cubic spline through one period of samples that repeat but for a steady drift.

    Args:
        x: Samples at equal times from 0 on, the last one not repeated; shape (n, m).
        period: Time after which they repeat.
        drift: Advance per time, shape (m,).

    Returns:
        A function of times (k,): values and derivatives, each of shape (k, m).
    """
    times = np.arange(len(x) + 1) * (period / len(x))
    steady = x - np.outer(times[:-1], drift)
    spline = CubicSpline(times, np.vstack([steady, steady[:1]]), bc_type="periodic")

    def at(time: Array) -> tuple[Array, Array]:
        return spline(time) + np.outer(time, drift), spline(time, 1) + drift

    return at
