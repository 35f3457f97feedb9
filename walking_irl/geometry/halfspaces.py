"""Small dense geometry of bounded sets {z : A z <= b}: ball, log-barrier centre, vertices.

Source: Boyd and Vandenberghe, *Convex Optimization*, sections 8.5 and 9.6. Everything that depends
on size is done in the coordinates whitened by the barrier's Hessian, so that a set of width 1e-6 is
treated as accurately as one of width 1.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dgels
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from walking_irl.arrays import Array
from walking_irl.errors import SolverError
from walking_irl.geometry.dual_simplex import maximise

LAWRENCE_AGREEMENT = 1e-6
"""Relative difference of two volumes by Lawrence's formula that rounding explains."""
FLAT_RADIUS = 1e-7
"""Inscribed radius up to which a set counts as flat: its weights are known well enough there."""

SMALLEST_SLACK = 1e-14
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
        if is_inside and decrement <= 1e-14 or y.min() < SMALLEST_SLACK:
            break
    # A decrement up to 1e-6 is rounding in the slacks of a very thin set: still well centred.
    if not decrement <= 1e-6 or slack.min() < SMALLEST_SLACK:
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


def whitened_rows(A: Array, centre: BarrierCentre, b: Array) -> Array:
    """Rows of the same set in y = R (z - z_centre), with every right-hand side 1; shape (m, n)."""
    slack = b - A @ centre.z
    rows: Array = solve_triangular(centre.R, (A / slack[:, None]).T, trans="T").T
    return rows


def whitened_vertices(rows: Array) -> Array:
    """Vertices of {y : rows y <= 1}, shape (n_vertices, n), without duplicates."""
    if rows.shape[1] == 1:
        return np.array([[1.0 / rows.min()], [1.0 / rows.max()]])
    halfspaces = np.c_[rows, -np.ones(len(rows))]
    origin = np.zeros(rows.shape[1])
    try:
        points = HalfspaceIntersection(halfspaces, origin).intersections
    except QhullError:  # nearly parallel rows: let Qhull joggle its input
        points = HalfspaceIntersection(halfspaces, origin, qhull_options="QJ").intersections
    points = points[np.isfinite(points).all(axis=1)]
    _, first = np.unique(np.round(points, 8), axis=0, return_index=True)
    vertices: Array = points[np.sort(first)]
    return vertices


def whitened_facets(rows: Array) -> NDArray[np.intp]:
    """Indices of the rows that no other rows imply in {y : rows y <= 1}.

    By polarity they are the vertices of the convex hull of the rows themselves.
    """
    if rows.shape[1] == 1:
        return np.unique([int(np.argmin(rows)), int(np.argmax(rows))])
    try:
        hull = ConvexHull(rows)
    except QhullError:
        hull = ConvexHull(rows, qhull_options="QJ")
    return np.sort(hull.vertices).astype(np.intp)


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


def whitened_volume(rows: Array) -> float:
    r"""Volume of the bounded set {y : rows y <= 1}, shape (m, n).

    By the vertices and the n rows through each (J. Lawrence 1991, Polytope volume computation),

    .. math:: \mathrm{vol} = \frac{1}{n!} \sum_v \frac{(c \cdot v)^n}{|\det A_v| \prod_i \gamma_i},
        \qquad A_v^T \gamma = c

    for any c: two random ones must agree. Where more than n rows meet in a vertex, or they do not
    agree, by the convex hull of the vertices, which is exact too but up to 30 times slower.
    """
    n = rows.shape[1]
    if n > 1:
        try:
            met = HalfspaceIntersection(np.c_[rows, -np.ones(len(rows))], np.zeros(n)).dual_facets
        except QhullError:
            met = []
        if met and all(len(f) == n for f in met):
            first, second = (_lawrence(rows[np.array(met)], seed) for seed in (1, 2))
            if first > 0 and abs(first - second) < LAWRENCE_AGREEMENT * first:
                return first
    return hull_volume(whitened_vertices(rows))


def _lawrence(corners: Array, seed: int) -> float:
    """Lawrence's sum over vertices given by their n rows, shape (n_vertices, n, n)."""
    n = corners.shape[1]
    c = np.random.default_rng(seed).normal(size=(n,))
    det = np.abs(np.linalg.det(corners))
    corners, det = corners[det > 1e-300], det[det > 1e-300]
    ones: Array = np.ones((len(corners), n, 1))
    right: Array = np.tile(c[:, None], (len(corners), 1, 1))
    try:
        v = np.linalg.solve(corners, ones)
        gamma = np.linalg.solve(np.swapaxes(corners, 1, 2), right)
    except np.linalg.LinAlgError:
        return -1.0
    with np.errstate(all="ignore"):
        terms = (v[..., 0] @ c) ** n / (det * np.prod(gamma[..., 0], axis=1))
    return float(terms.sum() / math.factorial(n))


def hull_volume(vertices: Array) -> float:
    """Volume of the convex hull of points, shape (m, n), that span their space."""
    if vertices.shape[1] == 1:
        return float(np.ptp(vertices))
    try:
        return float(ConvexHull(vertices).volume)
    except QhullError:
        return float(ConvexHull(vertices, qhull_options="QJ").volume)
