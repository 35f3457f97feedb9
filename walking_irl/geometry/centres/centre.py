"""What every centre returns: a point of the polyhedron and ellipsoids inside and around it."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from walking_irl.arrays import Array
from walking_irl.geometry.plane import feasible
from walking_irl.geometry.polyhedron import WeightPolyhedron


class Centre(NamedTuple):
    """A centre z_c with E(inner) inside P inside E(outer), where E(rho) is the ellipsoid
    {z : (z - z_c)' shape^-1 (z - z_c) <= rho^2}.
    """  # noqa: D205

    w: Array
    """The centre as weights, shape (K,)."""
    z: Array
    """The centre in the simplex's plane, shape (K-1,)."""
    shape: Array
    """Symmetric positive definite, shape (K-1, K-1)."""
    inner: float
    outer: float
    """Infinite where nothing is known."""


class CentreRule(Protocol):
    """Any rule that picks the next query from the polyhedron."""

    def __call__(self, P: WeightPolyhedron, *, rng: np.random.Generator) -> Centre:
        """Centre of ``P``; raises EmptyPolyhedronError where ``P`` is empty or flat."""
        ...


def feasible_weights(P: WeightPolyhedron, z: Array) -> Array:
    """Weights of plane coordinates, with rounding clipped onto the weights' bounds; shape (K,)."""
    return feasible(P.to_weights(z), P.min_weight)
