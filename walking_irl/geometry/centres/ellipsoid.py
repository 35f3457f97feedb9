"""Maximum-volume inscribed ellipsoid (John; Tarasov, Khachiyan and Erlikh 1988).

Solved by the primal-dual interior-point method of Zhang and Gao, "On numerical solution of the
maximum volume ellipsoid problem", SIAM J. Optim. 14 (2003), in coordinates whitened by the
analytic centre; cvxpy (imported only then) is the fallback.
"""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from walking_irl.arrays import Array
from walking_irl.errors import SolverError
from walking_irl.geometry.centres.centre import Centre, feasible_weights
from walking_irl.geometry.polyhedron import WeightPolyhedron

_GAP = 1e-9
"""Complementarity gap at which the interior-point method stops (of log det, per row)."""


class Ellipsoid(NamedTuple):
    """{centre + B u : |u| <= 1} with ``square`` = B B'."""

    centre: Array
    square: Array


def ellipsoid(P: WeightPolyhedron, *, rng: np.random.Generator | None = None) -> Centre:
    """Centre of the largest ellipsoid c + B u inside the polyhedron; shape B B'.

    A cut through it leaves a largest ellipsoid of at most 0.843 times the volume of the old one, in
    any dimension. The polyhedron itself need **not** shrink by a factor 1 - 1/n, as is sometimes
    stated: a simplex with extra tangent planes keeps 0.74 > 2/3 of its area-like volume at n = 3
    and 0.97 > 0.9 at n = 10. P lies within n (E - c) + c. Equivariant under affine maps and
    independent of redundant rows.

    Args:
        P: Polyhedron with interior.
        rng: Ignored.

    Raises:
        EmptyPolyhedronError: If the polyhedron is empty or flat.
        SolverError: If neither method finds an inscribed ellipsoid.
    """
    inscribed = _lazy_inscribed(P.whitened.rows)
    z = P.whitened.to_plane(inscribed.centre)
    half = solve_triangular(P.barrier.R, np.linalg.cholesky(inscribed.square))
    # Outer factor n, enlarged by the solver's relative error.
    return Centre(feasible_weights(P, z), z, half @ half.T, 1.0, len(z) * (1.0 + 1e-3))


def _lazy_inscribed(rows: Array) -> Ellipsoid:
    """Largest ellipsoid in {y : rows y <= 1}, rows entering only once they are violated."""
    n = rows.shape[1]
    order = np.argsort(-np.linalg.norm(rows, axis=1))
    is_used = np.zeros(len(rows), dtype=bool)
    is_used[: n + 1] = True  # the bounds of the weights keep the set bounded
    is_used[order[: 6 * n]] = True
    while True:
        found = inscribed_ellipsoid(rows[is_used])
        reach = _reach(rows, found)
        if reach.max() <= 1.0 + 1e-7 or is_used[reach > 1.0 + 1e-7].all():
            return _shrunk(rows, found)
        worst = np.argsort(-reach)[: 4 * n]
        is_used[worst[reach[worst] > 1.0]] = True


def _reach(rows: Array, e: Ellipsoid) -> Array:
    """Largest value of each row over the ellipsoid: a.c + |B' a|, shape (m,)."""
    reach: Array = rows @ e.centre + np.sqrt(np.einsum("ij,jk,ik->i", rows, e.square, rows))
    return reach


def _shrunk(rows: Array, e: Ellipsoid) -> Ellipsoid:
    """The ellipsoid scaled about its centre so that it is inside exactly."""
    slack = 1.0 - rows @ e.centre
    factor = float(np.min(slack / np.sqrt(np.einsum("ij,jk,ik->i", rows, e.square, rows))))
    if not 0.99 < factor:
        raise SolverError(f"the inscribed ellipsoid sticks out by a factor {1.0 / factor:.3f}")
    return Ellipsoid(e.centre, e.square * min(1.0, factor) ** 2)


def inscribed_ellipsoid(rows: Array) -> Ellipsoid:
    """Largest ellipsoid in {y : rows y <= 1}; the set must be bounded and contain the origin.

    Args:
        rows: Shape (m, n), m > n.

    Raises:
        SolverError: If the interior-point method and every solver of cvxpy fail.
    """
    try:
        return _interior_point(rows)
    except (SolverError, np.linalg.LinAlgError):
        return cvxpy_ellipsoid(rows)


def _interior_point(A: Array, max_iter: int = 100) -> Ellipsoid:
    """Zhang and Gao's method: E^-2 = A' diag(y) A, and y_i z_i = mu for the slacks z_i.

    The stationarity conditions are A' diag(y) h = 0 and h + z = 1 - A x with
    h_i = |B a_i|; Newton steps on (x, y, z) with B eliminated.
    """
    m, n = A.shape
    x, y = np.zeros(n), np.ones(m)
    slack = 1.0 - A @ x
    h2 = np.einsum("ij,jk,ik->i", A, np.linalg.inv((A.T * y) @ A), A)
    h = np.sqrt(h2)
    t = float(np.min(slack / h))
    y = y / t**2
    z = np.maximum(0.1, slack - t * h)
    for _ in range(max_iter):
        square = np.linalg.inv((A.T * y) @ A)
        Q = A @ square @ A.T
        h = np.sqrt(np.diagonal(Q))
        gap = float(y @ z) / m
        mu = max(min(0.5, gap) * gap, 0.1 * _GAP)
        r1, r2, r3 = -A.T @ (y * h), slack - h - z, mu - y * z
        residual = max(np.abs(r1).max(), np.abs(r2).max(), np.abs(r3).max())
        if residual < _GAP and gap < 10.0 * _GAP:
            return Ellipsoid(x, np.asarray(square, dtype=np.float64))
        y2h, YA = 2.0 * y * h, y[:, None] * A
        YQ = y[:, None] * Q
        G = YQ * YQ.T + np.diag(np.maximum(1e-60, y2h * z))
        T = np.linalg.solve(G, (h + z)[:, None] * YA)
        M = (y2h[:, None] * T - YA).T
        r3y = r3 / y
        dx = np.linalg.solve(M @ A, r1 + M @ (r2 - r3y))
        Adx = A @ dx
        dy_y = np.linalg.solve(G, y2h * (Adx - (r2 - r3y)))
        dz = r3y - z * dy_y
        limits = [np.min(v, initial=-0.5) for v in (-Adx / slack, dy_y, dz / z)]
        step = max(0.75, 1.0 - residual) * min(1.0, *(-1.0 / v for v in limits))
        x, y, z = x + step * dx, y * (1.0 + step * dy_y), z + step * dz
        slack = slack - step * Adx
        if not np.isfinite(slack).all():
            break
    raise SolverError("the interior-point method for the inscribed ellipsoid did not converge")


def cvxpy_ellipsoid(rows: Array) -> Ellipsoid:
    """The same ellipsoid as a conic program: max log det B, |B a_i| + a_i.c <= 1.

    Raises:
        SolverError: If no solver succeeds.
    """
    import cvxpy

    n = rows.shape[1]
    for solver in ("CLARABEL", "SCS"):
        B, c = cvxpy.Variable((n, n), PSD=True), cvxpy.Variable(n)
        inside = cvxpy.norm(rows @ B, 2, axis=1) + rows @ c <= 1.0
        problem = cvxpy.Problem(cvxpy.Maximize(cvxpy.log_det(B)), [inside])
        try:
            with warnings.catch_warnings():  # the caller checks that the result is inscribed
                warnings.simplefilter("ignore")
                problem.solve(solver=solver)
        except cvxpy.SolverError:
            continue
        if problem.status == cvxpy.OPTIMAL and B.value is not None:
            return Ellipsoid(np.asarray(c.value), np.asarray(B.value @ B.value.T))
    raise SolverError(f"no conic solver found the ellipsoid inscribed in {len(rows)} rows")
