"""Chebyshev centre: the middle of the largest inscribed ball (Elzinga and Moore 1975)."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import EmptyPolyhedronError, FlatPolyhedronError, InvalidInputError
from walking_irl.geometry.centres.centre import Centre, feasible_weights
from walking_irl.geometry.halfspaces import FLAT_RADIUS, chebyshev_ball
from walking_irl.geometry.polyhedron import WeightPolyhedron

Coordinates = Literal["orthonormal", "drop-last"]


def chebyshev(
    P: WeightPolyhedron,
    *,
    rng: np.random.Generator | None = None,
    coordinates: Coordinates = "orthonormal",
) -> Centre:
    """Centre of the largest inscribed ball; cheap, but a cut through it may remove next to nothing.

    There is no geometric guarantee on the volume (Kelley-like worst case exponential in n), and the
    centre of a long polyhedron is not unique. It depends on the coordinates: in orthonormal ones
    the centre of the simplex is 1/K; dropping the last weight, as in the reference implementation
    of the algorithm, favours that weight (1/(1 + sqrt(K-1)) on the simplex).

    Args:
        P: Polyhedron with interior.
        rng: Ignored.
        coordinates: "orthonormal", or "drop-last" to reproduce the reference implementation.

    Raises:
        EmptyPolyhedronError: If the polyhedron is empty or flat.
        InvalidInputError: If the coordinates are unknown.
    """
    if coordinates == "orthonormal":
        z, radius = P.chebyshev()
    elif coordinates == "drop-last":
        z, radius = _drop_last(P)
    else:
        raise InvalidInputError(
            f"unknown coordinates {coordinates!r}; choose from orthonormal, drop-last"
        )
    return Centre(feasible_weights(P, z), z, radius**2 * np.eye(len(z)), 1.0, math.inf)


def _drop_last(P: WeightPolyhedron) -> tuple[Array, float]:
    """Centre in the coordinates w[:K-1], and the radius of a ball around it in the plane."""
    K = P.n_objectives
    P.chebyshev()
    rows = np.r_[-np.eye(K), P.cuts]
    bounds = np.r_[np.full(K, -P.min_weight), np.zeros(len(P.cuts))]
    A = rows[:, : K - 1] - rows[:, K - 1 :]
    b = bounds - rows[:, K - 1]
    norm = np.linalg.norm(A, axis=1)
    x = chebyshev_ball(A / norm[:, None], b / norm).z
    z = P.to_plane(np.r_[x, 1.0 - x.sum()])
    radius = float(np.min(P.b - P.A @ z))
    if radius <= 0.0:
        error = FlatPolyhedronError if radius >= -FLAT_RADIUS else EmptyPolyhedronError
        raise error(f"no interior point found (radius {radius:.1e})", radius)
    return z, radius
