"""The set of weights that still explain an expert: {w in simplex : w >= min_weight, D w <= 0}.

Geometry lives in orthonormal coordinates z of the simplex's plane, w = 1/K + U z, in which
distances, radii and Chebyshev centres mean the same for every objective (dropping one weight
instead favours that weight).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from walking_irl.arrays import Array
from walking_irl.errors import (
    EmptyPolyhedronError,
    FlatPolyhedronError,
    InvalidInputError,
    SolverError,
)
from walking_irl.geometry.dual_simplex import maximise
from walking_irl.geometry.halfspaces import (
    FLAT_RADIUS,
    Ball,
    BarrierCentre,
    chebyshev_ball,
    distinct_rows,
    lazy_barrier_centre,
)
from walking_irl.geometry.plane import feasible, plane_basis
from walking_irl.geometry.whitened import Whitened

EXACT_OBJECTIVES = 7
"""Largest number of objectives for which vertices and volumes are enumerated exactly."""


@dataclass(frozen=True, eq=False)
class WeightPolyhedron:
    """{w : w >= min_weight, sum(w) = 1, cuts w <= 0}; immutable, :meth:`cut` returns a new one.

    Attributes:
        n_objectives: K, at least 2.
        min_weight: Lower bound of every weight.
        cuts: Distinct cut normals, scaled to unit length within the plane, shape (m, K).
        is_lazy: Which cuts an analytic centre may leave out while it satisfies them, shape (m,).
        is_contradictory: Whether some cut excluded the whole simplex by itself.
    """

    n_objectives: int
    min_weight: float
    cuts: Array
    is_lazy: NDArray[np.bool_]
    is_contradictory: bool = False

    @classmethod
    def simplex(cls, n_objectives: int, min_weight: float = 0.0) -> WeightPolyhedron:
        """All weights on the simplex with every weight at least ``min_weight``.

        >>> WeightPolyhedron.simplex(3).contains(np.array([0.2, 0.3, 0.5]))
        True

        Raises:
            InvalidInputError: If K < 2 or not 0 <= K min_weight < 1.
        """
        K = n_objectives
        if K < 2:
            raise InvalidInputError(f"need at least 2 objectives, got {K}")
        if not 0.0 <= K * min_weight < 1.0:
            raise InvalidInputError(f"min_weight must lie in [0, 1/{K}), got {min_weight}")
        return cls(K, min_weight, np.empty((0, K)), np.empty(0, dtype=bool))

    def cut(self, d: Array) -> WeightPolyhedron:
        """The part where d.w <= 0; ``d`` has shape (K,)."""
        return self.cut_all(_vector(d, self.n_objectives, "cut normal")[None])

    def cut_all(self, D: Array, is_lazy: NDArray[np.bool_] | None = None) -> WeightPolyhedron:
        """The part where every row of ``D`` satisfies d.w <= 0.

        Rows are scaled to unit length within the plane; rows that hold on the whole simplex and
        repetitions (within 1e-9) are dropped.

        Args:
            D: Cut normals, shape (m, K), in any units.
            is_lazy: Rows that an analytic centre may ignore while it satisfies them, shape (m,).

        Raises:
            InvalidInputError: If ``D`` has another width or a value that is not finite.
        """
        K, D = self.n_objectives, _normals(D, self.n_objectives)
        lazy = np.zeros(len(D), dtype=bool) if is_lazy is None else np.asarray(is_lazy, dtype=bool)
        norm, mean = np.linalg.norm(D @ plane_basis(K), axis=1), D.mean(axis=1)
        # The simplex lies within distance 1 of its middle: beyond that a row holds or fails on all.
        matters = np.abs(mean) < norm
        fails = self.is_contradictory or bool(np.any(~matters & (mean > 0.0)))
        unit = D[matters] / norm[matters, None]
        cuts, lazy = distinct_rows(np.r_[self.cuts, unit], np.r_[self.is_lazy, lazy[matters]])
        return replace(self, cuts=cuts, is_lazy=lazy, is_contradictory=fails)

    @cached_property
    def A(self) -> Array:
        """Unit rows of A z <= b, shape (K + m, K - 1): the K bounds of the weights, then cuts."""
        U = plane_basis(self.n_objectives)
        return np.asarray(np.r_[-U / _bound_norm(self.n_objectives), self.cuts @ U])

    @cached_property
    def b(self) -> Array:
        """Right-hand sides of A z <= b, shape (K + m,)."""
        K = self.n_objectives
        bounds = np.full(K, (1.0 / K - self.min_weight) / _bound_norm(K))
        return np.asarray(np.r_[bounds, -self.cuts.mean(axis=1)])

    def to_weights(self, z: Array) -> Array:
        """Weights of plane coordinates, (..., K-1) -> (..., K)."""
        return np.asarray(1.0 / self.n_objectives + z @ plane_basis(self.n_objectives).T)

    def to_plane(self, w: Array) -> Array:
        """Plane coordinates of weights, (..., K) -> (..., K-1)."""
        return np.asarray(w @ plane_basis(self.n_objectives))

    def contains(self, w: Array, tol: float = 1e-9) -> bool:
        """Whether no row is missed by more than ``tol`` (a Euclidean distance)."""
        w = _vector(w, self.n_objectives, "weights")
        if self.is_contradictory or abs(w.sum() - 1.0) > max(tol, 1e-9):
            return False
        return bool(np.all(self.A @ self.to_plane(w) <= self.b + tol))

    @cached_property
    def ball(self) -> Ball:
        """Largest inscribed ball; radius < 0 where the set is empty (-inf for a contradiction)."""
        if self.is_contradictory:
            return Ball(np.zeros(self.n_objectives - 1), -math.inf)
        return chebyshev_ball(self.A, self.b)

    @property
    def is_flat(self) -> bool:
        """Whether the set is not empty but too thin to have a numerical interior."""
        return -FLAT_RADIUS <= self.ball.radius <= FLAT_RADIUS

    def chebyshev(self) -> Ball:
        """Largest inscribed ball of a set with interior.

        Raises:
            EmptyPolyhedronError: If no weight satisfies every row.
            FlatPolyhedronError: If the inscribed radius is at most 1e-7.
        """
        radius, n = self.ball.radius, len(self.cuts)
        if radius < -FLAT_RADIUS:
            miss = f"(they miss by {-radius:.1e})"
            raise EmptyPolyhedronError(f"no weight satisfies all {n} cuts {miss}", radius)
        if radius <= FLAT_RADIUS:
            size = f"(radius {radius:.1e})"
            raise FlatPolyhedronError(f"the weights left by {n} cuts are flat {size}", radius)
        return self.ball

    @cached_property
    def barrier(self) -> BarrierCentre:
        """Analytic centre of the bounds, the cuts that are not lazy, and the lazy ones that matter.

        Raises:
            EmptyPolyhedronError: If the set is empty or flat.
        """
        return _barrier(self)

    @cached_property
    def whitened(self) -> Whitened:
        """The set in the coordinates that its analytic centre makes round.

        Raises:
            EmptyPolyhedronError: If the set is empty or flat.
        """
        return Whitened.of(self.A, self.b, self.barrier)

    def _weights(self, z: Array) -> Array:
        """Weights of points of the set, with rounding clipped onto the weights' bounds."""
        return feasible(self.to_weights(z), self.min_weight)

    def vertices(self) -> Array:
        """All vertices as weights, shape (n, K); exact enumeration for K <= 7.

        Raises:
            InvalidInputError: If K > 7.
            EmptyPolyhedronError: If the set is empty or flat.
        """
        K, most = self.n_objectives, EXACT_OBJECTIVES
        if K > most:
            raise InvalidInputError(f"vertices are enumerated up to {most} objectives, got {K}")
        return self._weights(self.whitened.to_plane(self.whitened.vertices()))

    def volume(self) -> float:
        """(K-1)-dimensional volume; exact for K <= 7, else scaled from the barrier's Hessian.

        The estimate is exact on the simplex itself: vol(simplex) sqrt(det H_simplex / det H). After
        many cuts it is too small, by a factor of 2 in runs and of 100 after 100 random cuts.
        Flat and empty sets have volume 0.
        """
        if self.ball.radius <= FLAT_RADIUS:
            return 0.0
        if self.n_objectives <= EXACT_OBJECTIVES:
            return self.whitened.volume()
        return _estimated_volume(self)

    def support(self, c: Array) -> tuple[float, Array]:
        """Largest c.w over the set, and a weight vector that attains it.

        Args:
            c: Direction, shape (K,).

        Raises:
            EmptyPolyhedronError: If no weight satisfies every row.
        """
        w = self.maximisers(np.asarray(c, dtype=np.float64)[None])[0]
        return float(c @ w), w

    def maximisers(self, C: Array) -> Array:
        """Weights that attain the largest c.w over the set for each row c; (p, K) -> (p, K).

        Raises:
            EmptyPolyhedronError: If no weight satisfies every row.
        """
        K = self.n_objectives
        directions = C @ plane_basis(K)
        # Over the simplex alone c.w is largest in a corner: on all bounds but that of the best c_j.
        basis = (C.argmax(axis=1)[:, None] + np.arange(1, K)) % K
        try:
            return self._weights(self.whitened.maximisers(directions, basis))
        except FlatPolyhedronError:
            return self._weights(maximise(directions, self.A, self.b + FLAT_RADIUS, basis).x)

    def intervals(self) -> Array:
        """Smallest and largest value of each weight, shape (K, 2), from 2K linear programs.

        Raises:
            EmptyPolyhedronError: If no weight satisfies every row.
        """
        eye = np.eye(self.n_objectives)
        corners = self.maximisers(np.r_[-eye, eye])
        return np.asarray(np.einsum("bjj->jb", corners.reshape(2, *eye.shape)))


def _bound_norm(n_objectives: int) -> float:
    """Length within the plane of the normal of a weight's own bound."""
    return math.sqrt(1.0 - 1.0 / n_objectives)


def _vector(value: Array, n_objectives: int, name: str) -> Array:
    vector = np.asarray(value, dtype=np.float64)
    if vector.shape != (n_objectives,):
        raise InvalidInputError(f"{name} must have shape ({n_objectives},), got {vector.shape}")
    return vector


def _normals(D: Array, n_objectives: int) -> Array:
    D = np.asarray(D, dtype=np.float64)
    if D.ndim != 2 or D.shape[1] != n_objectives:
        raise InvalidInputError(f"cut normals must have shape (m, {n_objectives}), got {D.shape}")
    if not np.isfinite(D).all():
        raise InvalidInputError("cut normals must be finite")
    return D


def _barrier(P: WeightPolyhedron) -> BarrierCentre:
    """From the middle of the simplex, or, where that fails, from the largest inscribed ball."""
    is_lazy = np.r_[np.zeros(P.n_objectives, dtype=bool), P.is_lazy]
    if not P.is_contradictory:
        try:
            centre = lazy_barrier_centre(P.A, P.b, is_lazy, np.zeros(P.n_objectives - 1))
            if float(np.min(P.b - P.A @ centre.z)) > FLAT_RADIUS:
                return centre  # proves the interior without a linear program
        except SolverError:
            pass
    return lazy_barrier_centre(P.A, P.b, is_lazy, P.chebyshev().z)


def _estimated_volume(P: WeightPolyhedron) -> float:
    """The simplex's volume, scaled by the determinants of the two barriers' Hessians."""
    n, whole = P.n_objectives - 1, WeightPolyhedron.simplex(P.n_objectives).barrier
    log_ratio = np.log(np.abs(whole.R.diagonal() / P.barrier.R.diagonal())).sum()
    return math.sqrt(n + 1.0) / math.factorial(n) * math.exp(log_ratio)
