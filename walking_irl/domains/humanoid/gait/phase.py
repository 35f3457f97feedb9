"""Where a gait's cycle starts: the left foot passes the right one at knot N/2 of 2 N."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array

PASSING = 0.25
"""Phase at which the left foot passes the right one [cycles]: the middle of the first step."""


def moved_on(q: Array, step_length: float, phase: float) -> Array:
    """A whole cycle (2 N, nv) that starts at another phase [cycles], by its Fourier series."""
    n = len(q)
    drift = np.zeros_like(q)
    drift[:, 0] = 2 * step_length * np.arange(n) / n
    f = np.fft.rfft(q - drift, axis=0)
    k = np.arange(len(f))[:, None]
    out = np.fft.irfft(f * np.exp(2j * np.pi * k * phase), n, axis=0) + drift
    out[:, 0] += 2 * step_length * phase
    return np.asarray(out)


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
