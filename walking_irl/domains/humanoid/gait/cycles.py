"""Whole gait cycles: splines through one, and its mean with its mirror image."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

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
    r"""Cubic spline through one period of samples that repeat but for a steady drift.

    Its slopes s solve :math:`s_{i-1} + 4 s_i + s_{i+1} = 3 (x_{i+1} - x_{i-1}) / h`, a circulant
    system, which Fourier's transform makes diagonal.

    Args:
        x: Samples at equal times from 0 on, the last one not repeated; shape (n, m).
        period: Time after which they repeat.
        drift: Advance per time, shape (m,).

    Returns:
        A function of times (k,): values and derivatives, each of shape (k, m).
    """
    n, h = len(x), period / len(x)
    steady = x - np.outer(h * np.arange(n), drift)
    right = 3 * (np.roll(steady, -1, axis=0) - np.roll(steady, 1, axis=0)) / h
    eigenvalues = 4 + 2 * np.cos(2 * np.pi * np.arange(n // 2 + 1) / n)
    slopes = np.fft.irfft(np.fft.rfft(right, axis=0) / eigenvalues[:, None], n, axis=0)

    def at(time: Array) -> tuple[Array, Array]:
        knot = np.floor(np.asarray(time) / h)
        u = (time / h - knot)[:, None]
        i = knot.astype(int) % n
        j = (i + 1) % n
        rise = steady[j] - steady[i]
        first, last = h * slopes[i], h * slopes[j]
        bend, twist = 3 * rise - 2 * first - last, first + last - 2 * rise
        value = steady[i] + u * (first + u * (bend + u * twist))
        slope = (first + u * (2 * bend + 3 * u * twist)) / h
        return value + np.outer(time, drift), slope + drift

    return at
