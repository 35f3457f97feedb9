"""Convex hulls for drawing: meshes with true edges only, at any scale."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from walking_irl.arrays import Array

COPLANAR = 1e-6
"""Faces whose unit normals differ by less are one face (after scaling to unit size)."""
CREASE = 0.25
"""The same for pictures of round sets, whose hundreds of edges would hide what is inside."""
FLAT = 1e-7
"""A shadow thinner than this share of its length is drawn as flat."""


class Hull(NamedTuple):
    """A convex body ready to draw: in 3-D, or flat (a polygon, a segment, a point)."""

    points: Array
    """Corner points, shape (n, 3)."""
    triangles: NDArray[np.uint32]
    """Indices into ``points``, outward, shape (m, 3); empty for a segment or a point."""
    edges: Array
    """End points of the true edges, or of the sharper ones, shape (e, 2, 3)."""


def hull(points: Array, crease: float = COPLANAR) -> Hull:
    """Convex hull of 3-D points, shape (n, 3), of any extent and any dimension 0..3.

    Edges are those whose faces' unit normals differ by more than ``crease``.

    >>> cube = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    >>> len(hull(cube).edges), len(hull(1e-9 * cube).edges), len(hull(cube[:4]).edges)
    (12, 12, 4)
    """
    middle = points.mean(axis=0)
    size = float(np.abs(points - middle).max())
    if size == 0.0:
        return Hull(points[:1], np.empty((0, 3), np.uint32), np.empty((0, 2, 3)))
    unit = (points - middle) / size
    _, extent, axes = np.linalg.svd(unit, full_matrices=False)
    rank = int(np.sum(extent > FLAT * extent[0]))
    try:
        body = _solid(unit, crease) if rank == 3 else {2: _polygon, 1: _segment}[rank](unit, axes)
    except QhullError:  # too thin for Qhull after all: its longest extent is what can be seen
        body = _segment(unit, axes)
    return Hull(middle + size * body.points, body.triangles, middle + size * body.edges)


def _solid(unit: Array, crease: float) -> Hull:
    qhull = ConvexHull(unit)
    triangles = qhull.simplices.copy()
    a, b, c = (unit[triangles[:, i]] for i in range(3))
    normals = qhull.equations[:, :3]
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), normals) < 0
    triangles[inward] = triangles[inward][:, [0, 2, 1]]
    edges = [
        np.delete(triangle, j)
        for i, (triangle, neighbours) in enumerate(
            zip(qhull.simplices, qhull.neighbors, strict=True)
        )
        for j, n in enumerate(neighbours)
        if n > i and np.linalg.norm(normals[i] - normals[n]) > crease
    ]
    return _compact(unit, triangles, np.array(edges).reshape(-1, 2))


def _polygon(unit: Array, axes: Array) -> Hull:
    ring = ConvexHull(unit @ axes[:2].T).vertices
    fan = np.array([[ring[0], ring[i], ring[i + 1]] for i in range(1, len(ring) - 1)])
    return _compact(unit, fan, np.c_[ring, np.roll(ring, -1)])


def _segment(unit: Array, axes: Array) -> Hull:
    along = unit @ axes[0]
    ends = np.array([[np.argmin(along), np.argmax(along)]])
    return _compact(unit, np.empty((0, 3), int), ends)


def _compact(points: Array, triangles: NDArray[np.int64], edges: NDArray[np.int64]) -> Hull:
    """Keep only the points that are used."""
    used, place = np.unique(np.r_[triangles.ravel(), edges.ravel()], return_inverse=True)
    new = place[: triangles.size].reshape(-1, 3).astype(np.uint32)
    return Hull(points[used], new, points[edges])


def faces_lost(before: Hull, after: Hull, tolerance: float = 1e-9) -> NDArray[np.uint32]:
    """Triangles of ``before`` that reach outside ``after``: the skin of what a cut took away."""
    if len(after.triangles) == 0 or len(before.triangles) == 0:
        return before.triangles
    a, b, c = (after.points[after.triangles[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1)
    normals, a = normals[length > 0] / length[length > 0, None], a[length > 0]
    beyond = (before.points @ normals.T - np.einsum("ij,ij->i", a, normals)).max(axis=1)
    lost: NDArray[np.uint32] = before.triangles[
        (beyond > tolerance)[before.triangles.astype(int)].any(axis=1)
    ]
    return lost


def polygon_lost(before: Hull, after: Hull) -> tuple[Array, NDArray[np.uint32]]:
    """What a cut took away from a polygon in the plane z = 0: points (n, 3) and triangles (m, 3).

    Where ``after`` is no polygon any more, all of ``before``.
    """
    if len(after.triangles) == 0 or len(before.triangles) == 0:
        return before.points, before.triangles
    rest = before.edges[:, 0]
    pieces: list[Array] = []
    triangles: list[list[int]] = []
    ring = after.edges[:, 0]
    centre, size = ring.mean(axis=0), float(np.abs(before.points - before.points[0]).max())
    for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        outward = np.array([b[1] - a[1], a[0] - b[0], 0.0])
        outward *= np.sign(outward @ (a - centre)) / np.linalg.norm(outward)
        piece, rest = _half(rest, (rest - a) @ outward), _half(rest, (a - rest) @ outward)
        if len(piece) > 2 and ((piece - a) @ outward).max() > FLAT * size:
            first = sum(len(found) for found in pieces)
            triangles += [[first, first + i, first + i + 1] for i in range(1, len(piece) - 1)]
            pieces.append(piece)
    points = np.vstack([np.empty((0, 3)), *pieces])
    return points, np.array(triangles, np.uint32).reshape(-1, 3)


def _half(ring: Array, height: Array) -> Array:
    """The part of a convex polygon, corners (n, 3), whose ``height`` (n,) is not negative."""
    kept = []
    for p, q, h, k in zip(
        ring, np.roll(ring, -1, axis=0), height, np.roll(height, -1), strict=True
    ):
        if h >= 0:
            kept.append(p)
        if (h < 0 < k) or (k < 0 < h):
            kept.append(p + h / (h - k) * (q - p))
    return np.array(kept).reshape(-1, 3)
