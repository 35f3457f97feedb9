"""Bodies to draw, and what a cut took away from them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from walking_irl.arrays import Array
from walking_irl.recording.hulls import faces_lost, hull, polygon_lost


def test_hull_draws_outward_triangles_and_true_edges() -> None:
    rng = np.random.default_rng(0)
    body = hull(rng.normal(size=(30, 3)) * 1e-7 + 0.5)
    a, b, c = (body.points[body.triangles[:, i]] for i in range(3))
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a - body.points.mean(axis=0))
    assert np.all(outward > 0)
    assert len(body.points) - len(body.edges) + len(body.triangles) == 2  # Euler, no flat pairs


def test_lost_faces_are_those_outside_what_is_left() -> None:
    cube = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    before, half = hull(cube), hull(cube * [0.5, 1, 1])
    assert len(faces_lost(before, before)) == 0
    lost = faces_lost(before, half)
    untouched = {tuple(np.sort(t)) for t in before.triangles.tolist()} - {
        tuple(np.sort(t)) for t in lost.tolist()
    }
    assert len(lost) == 10 and len(untouched) == 2  # only the face x = 0 is whole


@pytest.mark.parametrize("corners", [0, 3, 7])
def test_lost_polygon_is_what_was_there_and_is_no_more(corners: int) -> None:
    rng = np.random.default_rng(corners)
    before = hull(np.c_[rng.normal(size=(20, 2)), np.zeros(20)])
    after = before
    if corners:  # within the larger one
        share = rng.dirichlet(np.ones(len(before.points)), corners)
        after = hull(share @ before.points)
    points, triangles = polygon_lost(before, after)
    area = [_area(*body[:2]) for body in (before, after)]
    assert _area(points, triangles) == pytest.approx(area[0] - area[1], abs=1e-12)
    middle = points[triangles].mean(axis=1) if len(triangles) else np.empty((0, 3))
    inside = ConvexHull(after.points[:, :2]).equations
    assert (middle[:, :2] @ inside[:, :2].T + inside[:, 2] > -1e-9).any(axis=1).all()


def test_all_of_a_polygon_is_lost_where_a_segment_is_left() -> None:
    triangle = hull(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]))
    points, triangles = polygon_lost(triangle, hull(triangle.points[:2]))
    assert _area(points, triangles) == pytest.approx(0.5)


def _area(points: Array, triangles: NDArray[np.uint32]) -> float:
    a, b, c = (points[triangles.astype(int)[:, i]] for i in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)
