"""What every centre returns: a point of the polyhedron and ellipsoids inside and around it."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
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


class OwnCentre(Protocol):
    """A centre of one's own: only asked where ``P`` has an interior, of which it returns a point.

    >>> def middle(P, *, rng):
    ...     return P.vertices().mean(axis=0)
    """

    def __call__(self, P: WeightPolyhedron, *, rng: np.random.Generator) -> Centre | Array:
        """A point strictly inside ``P``, as a centre or as weights of shape (K,)."""
        ...


def checked(rule: OwnCentre) -> CentreRule:
    """The rule with a named error where it is not a centre."""

    def centre(P: WeightPolyhedron, *, rng: np.random.Generator) -> Centre:
        P.chebyshev()  # raises where there is no interior
        found = rule(P, rng=rng)
        if isinstance(found, Centre):
            return found
        w = np.asarray(found, dtype=np.float64)
        if w.shape != (P.n_objectives,) or not np.isfinite(w).all() or not P.contains(w):
            raise InvalidInputError(
                f"a centre must return {P.n_objectives} weights inside the polyhedron, got {found}"
            )
        z = P.to_plane(w)
        radius = max(float(np.min(P.b - P.A @ z)), 0.0)
        return Centre(feasible_weights(P, z), z, radius**2 * np.eye(len(z)), 1.0, math.inf)

    return centre


def feasible_weights(P: WeightPolyhedron, z: Array) -> Array:
    """Weights of plane coordinates, with rounding clipped onto the weights' bounds; shape (K,)."""
    return feasible(P.to_weights(z), P.min_weight)
