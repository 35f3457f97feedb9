"""Analytic centre: the point that maximises the product of the slacks (Sonnevend; Ye 1997)."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import solve_triangular

from walking_irl.geometry.centres.centre import Centre, feasible_weights
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.geometry.rows import with_relevant


def analytic(
    P: WeightPolyhedron, *, rng: np.random.Generator | None = None, most: int | None = None
) -> Centre:
    """Analytic centre, argmin of -sum_i log(b_i - a_i.z) over the rows that matter.

    With H the Hessian there and m rows, E(1) lies inside and E(sqrt(m(m-1))) around the set, both
    with shape H^-1. Cuts through analytic centres reach a ball of radius eps in O*(n^2/eps^2)
    queries (Goffin, Luo and Ye 1996); what is observed is a few per dimension, as with the centre
    of gravity. The centre depends on the rows and not only on the set: near-parallel cuts push it
    away, which is why a polyhedron's lazy rows are used only where they cut it off. It is
    equivariant under affine maps.

    Args:
        P: Polyhedron with interior.
        rng: Ignored.
        most: Cuts that shape the centre, the most relevant ones; the rest only keep it inside. None
            for all. From 3 n of them on, CPIRL asks as often as with all.

    Raises:
        EmptyPolyhedronError: If the polyhedron is empty or flat.
        InvalidInputError: If ``most`` is negative.
    """
    if most is not None:
        P = with_relevant(P, most)
    z, R, used_slack = P.barrier
    m = len(used_slack)
    root = solve_triangular(R, np.eye(len(z)))
    # Rows left out of the barrier are satisfied, but may pass through its ellipsoid E(1).
    inner = float(P.whitened.relevance().min())
    return Centre(feasible_weights(P, z), z, root @ root.T, min(1.0, inner), math.sqrt(m * (m - 1)))
