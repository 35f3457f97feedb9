"""Bounded sets {z : A z <= b}: their largest ball and their log-barrier centre.

Source: Boyd and Vandenberghe, *Convex Optimization*, sections 8.5 and 9.6.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgels

from walking_irl.arrays import Array
from walking_irl.errors import SolverError
from walking_irl.geometry.dual_simplex import maximise

FLAT_RADIUS = 1e-7
"""Inscribed radius up to which a set counts as flat: its weights are known well enough there."""

_SMALLEST_SLACK = 1e-14
"""A smaller slack, of rows with norm 1, is rounding."""


class Ball(NamedTuple):
    """Largest inscribed ball; a negative radius says by how much the rows miss each other."""

    z: Array
    radius: float


class BarrierCentre(NamedTuple):
    """Analytic centre: argmin of -sum_i log(b_i - a_i.z); the Hessian there is ``R' R``."""

    z: Array
    R: Array
    slack: Array


def chebyshev_ball(A: Array, b: Array) -> Ball:
    """Largest ball in {A z <= b}; the rows must have norm 1.

    Args:
        A: Unit rows, shape (m, n); the first n + 1 of them bound a simplex.
        b: Right-hand sides, shape (m,).

    Returns:
        Centre, shape (n,), and radius. The centre need not be unique.
    """
    n = A.shape[1]
    lifted = np.c_[A, np.ones(len(b))]
    z = maximise(np.eye(n + 1)[n:], lifted, b, np.arange(n + 1)[None]).x[0, :n]
    return Ball(z, float(np.min(b - A @ z)))


def barrier_centre(A: Array, b: Array, z: Array, max_iter: int = 60) -> BarrierCentre:
    """Analytic centre by Newton steps from any start (Boyd and Vandenberghe, section 10.3).

    The slacks y are variables of their own, so that a start may miss rows: the residual
    r = y + A z - b shrinks by 1 - t in a step of length t and is gone after a full one. Each step
    is a least-squares problem in the scaled rows A/y, whose condition number is the square root of
    the Hessian's. Where the rows have no interior the steps do not end.

    Args:
        A: Rows that bound z, shape (m, n).
        b: Right-hand sides, shape (m,).
        z: Start, shape (n,).
        max_iter: Bound on Newton steps; about ten are needed.

    Returns:
        Centre, triangular root ``R`` of the Hessian, and slacks ``b - A z``, shape (m,).

    Raises:
        SolverError: If Newton does not converge to a point strictly inside; as a rule because
            there is none.
    """
    n = len(z)
    slack = b - A @ z
    y = np.where(slack > 0.0, slack, 1.0)
    decrement = np.inf
    for _ in range(max_iter):
        residual = y - slack
        is_inside = not residual.any()
        scaled = A / y[:, None]
        step = -dgels(scaled, 1.0 + residual / y)[1][:n]
        move = scaled @ step
        rate = move + residual / y
        decrement = float(move @ move)
        t = _step_length(rate, decrement, is_inside)
        z = z + t * step
        slack = b - A @ z
        y = slack if is_inside or t == 1.0 else y * (1.0 - t * rate)
        if is_inside and decrement <= 1e-14 or y.min() < _SMALLEST_SLACK:
            break
    # A decrement up to 1e-6 is rounding in the slacks of a very thin set: still well centred.
    if not decrement <= 1e-6 or slack.min() < _SMALLEST_SLACK:
        raise SolverError(f"analytic centre: Newton decrement {decrement:.1e}")
    return BarrierCentre(z, np.asarray(np.linalg.qr(A / slack[:, None], mode="r")), slack)


def _step_length(rate: Array, decrement: float, is_inside: bool) -> float:
    """Step that keeps the slacks y (1 - t rate) positive and, inside, lowers the barrier."""
    fastest = float(rate.max())
    t = min(1.0, 0.95 / fastest) if fastest > 0.0 else 1.0
    if is_inside and decrement >= 0.05:  # below: region of quadratic convergence
        while -np.log1p(-t * rate).sum() > -0.01 * t * decrement:
            t *= 0.5
    return t


def lazy_barrier_centre(A: Array, b: Array, is_lazy: NDArray[np.bool_], z: Array) -> BarrierCentre:
    """Analytic centre of the rows that are not lazy, and of the lazy ones that matter.

    A lazy row enters as soon as it cuts off the centre of those before it; many near-parallel
    rows would otherwise push the centre away from them.

    Args:
        A: Rows that bound z, shape (m, n).
        b: Right-hand sides, shape (m,).
        is_lazy: Which rows may be left out, shape (m,); the others bound z.
        z: Start, shape (n,).

    Raises:
        SolverError: See :func:`barrier_centre`.
    """
    is_used = ~is_lazy
    while True:
        centre = barrier_centre(A[is_used], b[is_used], z)
        slack = b - A @ centre.z
        worst = int(np.argmin(slack))
        if slack[worst] > 0.0 or is_used[worst]:
            return centre
        is_used[worst] = True


def distinct_rows(cuts: Array, is_lazy: NDArray[np.bool_]) -> tuple[Array, NDArray[np.bool_]]:
    """Drop repeated unit cuts (within 1e-9), first ones kept; eager if any copy was."""
    if len(cuts) < 2:
        return cuts, is_lazy
    _, first, group = np.unique(np.round(cuts, 9), axis=0, return_index=True, return_inverse=True)
    group = group.reshape(-1)
    lazy = np.ones(len(first), dtype=bool)
    np.logical_and.at(lazy, group, is_lazy)
    order = np.argsort(first)
    return cuts[first[order]], lazy[order]
