"""A bounded set seen from its log-barrier centre, in the coordinates that make it round.

In y = R (z - z_c), R' R the barrier's Hessian at its centre z_c, the set {z : A z <= b} becomes
{y : rows y <= 1}, which holds the unit ball. Everything that depends on size is done there, so that
a set of width 1e-6 is treated as accurately as one of width 1.

Source: Boyd and Vandenberghe, *Convex Optimization*, section 8.5.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from walking_irl.arrays import Array
from walking_irl.geometry.dual_simplex import maximise
from walking_irl.geometry.halfspaces import BarrierCentre

_LAWRENCE_AGREEMENT = 1e-6
"""Relative difference of two volumes by Lawrence's formula that rounding explains."""


class Whitened(NamedTuple):
    """{y : rows y <= 1} with y = R (z - z_c)."""

    rows: Array
    """Shape (m, n); row i is that of the set's own row i."""
    centre: BarrierCentre
    """The point z_c, and the root R of the Hessian there."""

    @classmethod
    def of(cls, A: Array, b: Array, centre: BarrierCentre) -> Whitened:
        """The set {z : A z <= b}, rows of shape (m, n), around a point strictly inside."""
        slack = b - A @ centre.z
        rows: Array = solve_triangular(centre.R, (A / slack[:, None]).T, trans="T").T
        return cls(rows, centre)

    def to_plane(self, y: Array) -> Array:
        """Points z of whitened ones, (..., n) -> (..., n)."""
        z: Array = self.centre.z + solve_triangular(self.centre.R, y.T).T
        return z

    def relevance(self) -> Array:
        """(b_i - a_i.z_c) / |a_i|_{H^-1} of each row: its distance from the centre, shape (m,).

        At least 1 for the rows in the barrier. With m rows there, a relevance of sqrt(m (m - 1))
        proves that the others imply the row, for the Dikin ellipsoid of that radius holds the set.
        """
        distance: Array = 1.0 / np.linalg.norm(self.rows, axis=1)
        return distance

    def vertices(self) -> Array:
        """All vertices in whitened coordinates, without duplicates; shape (n_vertices, n)."""
        if self.rows.shape[1] == 1:
            return np.array([[1.0 / self.rows.min()], [1.0 / self.rows.max()]])
        halfspaces = np.c_[self.rows, -np.ones(len(self.rows))]
        origin = np.zeros(self.rows.shape[1])
        try:
            points = HalfspaceIntersection(halfspaces, origin).intersections
        except QhullError:  # nearly parallel rows: let Qhull joggle its input
            points = HalfspaceIntersection(halfspaces, origin, qhull_options="QJ").intersections
        points = points[np.isfinite(points).all(axis=1)]
        _, first = np.unique(np.round(points, 8), axis=0, return_index=True)
        vertices: Array = points[np.sort(first)]
        return vertices

    def active_rows(self) -> NDArray[np.intp]:
        """Indices of the rows that no other rows imply.

        By polarity they are the vertices of the convex hull of the rows themselves.
        """
        if self.rows.shape[1] == 1:
            return np.unique([int(np.argmin(self.rows)), int(np.argmax(self.rows))])
        try:
            hull = ConvexHull(self.rows)
        except QhullError:
            hull = ConvexHull(self.rows, qhull_options="QJ")
        return np.sort(hull.vertices).astype(np.intp)

    def maximisers(self, C: Array, basis: NDArray[np.intp]) -> Array:
        """Points z that attain the largest c.z over the set for each row c of ``C``.

        Args:
            C: Directions, shape (p, n).
            basis: Of each direction, see :func:`~walking_irl.geometry.dual_simplex.maximise`.

        Returns:
            Vertices, shape (p, n).
        """
        C = solve_triangular(self.centre.R, C.T, trans="T").T
        norm = np.linalg.norm(C, axis=1, keepdims=True)
        C /= np.where(norm > 0.0, norm, 1.0)
        return self.to_plane(maximise(C, self.rows, np.ones(len(self.rows)), basis).x)

    def volume(self) -> float:
        r"""Volume of the set, in the units of z.

        By the vertices and the n rows through each (J. Lawrence 1991, Polytope volume computation),

        .. math:: \mathrm{vol} = \frac{1}{n!} \sum_v \frac{(c \cdot v)^n}{|\det A_v|
            \prod_i \gamma_i}, \qquad A_v^T \gamma = c

        for any c: two random ones must agree. Where more than n rows meet in a vertex, or they do
        not agree, by the convex hull of the vertices, which is exact too but up to 30 times slower.
        """
        return self._volume() / abs(float(np.prod(self.centre.R.diagonal())))

    def _volume(self) -> float:
        """The same in whitened coordinates."""
        n = self.rows.shape[1]
        if n > 1:
            halfspaces = np.c_[self.rows, -np.ones(len(self.rows))]
            try:
                met = HalfspaceIntersection(halfspaces, np.zeros(n)).dual_facets
            except QhullError:
                met = []
            if met and all(len(f) == n for f in met):
                first, second = (_lawrence(self.rows[np.array(met)], seed) for seed in (1, 2))
                if first > 0 and abs(first - second) < _LAWRENCE_AGREEMENT * first:
                    return first
        return _hull_volume(self.vertices())


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


def _hull_volume(vertices: Array) -> float:
    """Volume of the convex hull of points, shape (m, n), that span their space."""
    if vertices.shape[1] == 1:
        return float(np.ptp(vertices))
    try:
        return float(ConvexHull(vertices).volume)
    except QhullError:
        return float(ConvexHull(vertices, qhull_options="QJ").volume)
