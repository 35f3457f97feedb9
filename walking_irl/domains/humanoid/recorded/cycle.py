r"""One mirror-symmetric cycle of joint positions from samples at any times.

A symmetric walk obeys :math:`q(\varphi + 1/2) = S q(\varphi) + L e_x`. So the half sum
:math:`(q + S q)/2` has even harmonics of the cycle only and the half difference odd ones, and one
linear least-squares fit of both needs neither equal time steps nor whole cycles nor events.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.signal import find_peaks

from walking_irl.arrays import Array, Indices
from walking_irl.errors import InvalidInputError

HARMONICS = 9
COARSE_HARMONICS = 6
"""Of the fit that finds the half period: more of them would fit anything."""
HALF_PERIODS = (0.28, 0.9)  # [s]
GRID = 0.005  # [s]
LEAST_STEPS = 1.3
"""Steps that a record must hold: a half period shows only where its mirror image begins."""
MOST_EVENTS_GAP, LEAST_EVENTS_GAP = 1.2, 0.24  # between contacts of different feet [s]


class Fit(NamedTuple):
    """A symmetric cycle fitted to samples.

    ``even`` (e, nv), ``odd`` (o, nv) are coefficients of the bases, ``forward`` (e,) those of x
    without its advance; ``residuals`` (n, nv) is NaN where a row was left out; ``asymmetry`` (nv,)
    is the constant difference of both sides, which was dropped.
    """

    even: Array
    odd: Array
    forward: Array
    step_length: float
    residuals: Array
    asymmetry: Array
    harmonics: int

    def at(self, phase: Array) -> Array:
        """Joint positions at phases [cycles], shape (n, nv)."""
        E, D = basis(phase, 0, self.harmonics), basis(phase, 1, self.harmonics)
        q = E @ self.even + D @ self.odd
        q[:, 0] = E @ self.forward + 2 * self.step_length * phase
        return q


def basis(phase: Array, first: int, harmonics: int) -> Array:
    """Even (first = 0) or odd (1) harmonics at phases [cycles]: columns cos, sin; 1 for k = 0."""
    columns = []
    for k in range(first, harmonics + 1, 2):
        columns += [np.cos(2 * np.pi * k * phase)]
        columns += [np.sin(2 * np.pi * k * phase)] if k else []
    return np.column_stack(columns)


def symmetric_fit(phase: Array, q: Array, mirror: Array, harmonics: int = HARMONICS) -> Fit:
    """Least-squares symmetric cycle through samples.

    Args:
        phase: Of each sample [cycles], shape (n,).
        q: Joint positions, shape (n, nv); x goes forward.
        mirror: S, shape (nv, nv).
        harmonics: Highest harmonic of the cycle.
    """
    ok = np.isfinite(q).all(1)
    p, half_sum = phase[ok], (q + q @ mirror.T)[ok] / 2
    half_difference = q[ok] - half_sum
    E, D = basis(p, 0, harmonics), basis(p, 1, harmonics)
    even = np.linalg.lstsq(E, half_sum, rcond=None)[0]
    is_whole = np.ptp(p) > 0.9  # else a constant difference cannot be told from a slow harmonic
    with_bias = np.column_stack([D, np.ones_like(p)]) if is_whole else D
    odd = np.linalg.lstsq(with_bias, half_difference, rcond=None)[0]
    forward = np.linalg.lstsq(np.column_stack([E, p]), half_sum[:, 0], rcond=None)[0]
    residuals = np.full_like(q, np.nan)
    residuals[ok] = q[ok] - E @ even - with_bias @ odd
    moved = np.column_stack([E, p]) @ forward + (with_bias @ odd)[:, 0]
    residuals[ok, 0] = q[ok, 0] - moved
    asymmetry = odd[-1] if is_whole else np.zeros(q.shape[1])
    n = D.shape[1]
    length = float(forward[-1]) / 2
    e, o, f = (np.asarray(c, dtype=float) for c in (even, odd[:n], forward[:-1]))
    return Fit(e, o, f, length, residuals, np.asarray(asymmetry, dtype=float), harmonics)


def drift_angle(phase: Array, q: Array, mirror: Array) -> float:
    """Direction of the walk in the plane of x and y [rad], sway left aside.

    Args:
        phase: Of each sample [cycles], shape (n,).
        q: Joint positions, shape (n, nv), NaN where they do not count.
        mirror: S, shape (nv, nv).

    Returns:
        The angle, or 0 where less than a cycle was recorded (sway and drift look alike there) and
        where the walk goes backwards.
    """
    ok = np.isfinite(q).all(1)
    p = phase[ok]
    if np.ptp(p) < 0.9:
        return 0.0
    E, D = basis(p, 0, 4), basis(p, 1, 3)
    x = (q + q @ mirror.T)[ok, 0] / 2
    along = np.linalg.lstsq(np.column_stack([E, p]), x, rcond=None)[0]
    aside = np.linalg.lstsq(np.column_stack([D, np.ones_like(p), p]), q[ok, 1], rcond=None)[0]
    return float(np.arctan2(aside[-1], along[-1])) if along[-1] > 0 else 0.0


class Events(NamedTuple):
    """Alternating initial contacts: times [s] and whether each is the right foot's."""

    time: Array
    is_right: Array


def contacts(time: Array, right: Array, left: Array) -> Events:
    """Initial contacts: the heel is farthest before the pelvis.

    J. A. Zeni, J. G. Richards, J. S. Higginson (2008), Gait Posture 27:710.

    Args:
        time: At equal steps, shape (n,) [s].
        right: How far the right heel is before the pelvis, shape (n,) [m].
        left: The same of the left.

    Returns:
        The longest run in which both feet take turns.
    """
    hz = 1 / float(np.median(np.diff(time)))
    found = []
    for x, is_right in ((right, True), (left, False)):
        peaks, _ = find_peaks(x, prominence=0.15, distance=max(1, int(0.45 * hz)))
        found += [(float(time[i]), is_right) for i in peaks]
    runs: list[list[tuple[float, bool]]] = [[]]
    for event in sorted(found):
        last = runs[-1][-1] if runs[-1] else None
        if last and (
            event[1] == last[1] or not LEAST_EVENTS_GAP < event[0] - last[0] < MOST_EVENTS_GAP
        ):
            runs.append([])
        runs[-1].append(event)
    best = max(runs, key=len)
    return Events(np.array([t for t, _ in best]), np.array([r for _, r in best], dtype=bool))


def phases(time: Array, events: Events) -> tuple[Array, float]:
    """Phase of each time [cycles], linear between contacts, and the mean half period [s]."""
    start = 0.0 if events.is_right[0] else 0.5
    at = np.interp(time, events.time, start + 0.5 * np.arange(len(events.time)))
    return at, float(np.mean(np.diff(events.time)))


def half_period(time: Array, q: Array, mirror: Array, legs: Indices) -> float:
    """The half period [s] under which a short record is best its own mirror image.

    Args:
        time: Shape (n,) [s].
        q: Joint positions, shape (n, nv), NaN where they do not count.
        mirror: S, shape (nv, nv).
        legs: Columns that are judged.

    Raises:
        InvalidInputError: If the record is too short to show any.
    """
    seconds = float(time[-1] - time[0])

    def misfit(T: float) -> float:
        fit = symmetric_fit((time - time[0]) / (2 * T), q, mirror, COARSE_HARMONICS)
        return float(np.sqrt(np.nanmean(fit.residuals[:, legs] ** 2)))

    low, high = HALF_PERIODS
    grid = np.arange(low, min(high, seconds / LEAST_STEPS), GRID)
    if len(grid) < 5 or grid[-1] < 0.4:
        raise InvalidInputError(
            f"the record is too short: {seconds:.2f} s hold less than a step and a third"
        )
    cost = [misfit(T) for T in grid]
    best = int(np.argmin(cost))
    around = (grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)])
    found = minimize_scalar(misfit, bounds=around, method="bounded", options={"xatol": 1e-4})
    return float(found.x) if found.fun < cost[best] else float(grid[best])
