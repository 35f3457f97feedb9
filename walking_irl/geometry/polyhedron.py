"""The set of weights that still explain an expert: {w in simplex : w >= min_weight, D w <= 0}.

Geometry lives in orthonormal coordinates z of the simplex's plane, w = 1/K + U z, in which
distances, radii and Chebyshev centres mean the same for every objective (dropping one weight
instead favours that weight).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

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
    barrier_centre,
    chebyshev_ball,
    distinct_rows,
    whitened_facets,
    whitened_rows,
    whitened_vertices,
    whitened_volume,
)

EXACT_OBJECTIVES = 7
"""Largest number of objectives for which vertices and volumes are enumerated exactly."""


@lru_cache(maxsize=64)
def plane_basis(n_objectives: int) -> Array:
    """Orthonormal basis U of {v : sum(v) = 0}, shape (K, K-1), so that w = 1/K + U z."""
    K = n_objectives
    Q, _ = np.linalg.qr(np.c_[np.ones(K), np.eye(K)[:, : K - 1]])
    U: Array = np.ascontiguousarray(Q[:, 1:K])
    U.setflags(write=False)
    return U


def feasible(w: Array, min_weight: float) -> Array:
    """Weights with rounding clipped onto their bounds, (..., K) -> (..., K)."""
    excess = np.maximum(w - min_weight, 0.0)
    share = 1.0 - w.shape[-1] * min_weight
    normalised: Array = min_weight + share * excess / excess.sum(axis=-1, keepdims=True)
    return normalised


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
        if n_objectives < 2:
            raise InvalidInputError(f"need at least 2 objectives, got {n_objectives}")
        if not 0.0 <= n_objectives * min_weight < 1.0:
            raise InvalidInputError(
                f"min_weight must lie in [0, 1/{n_objectives}), got {min_weight}"
            )
        return cls(n_objectives, min_weight, np.empty((0, n_objectives)), np.empty(0, dtype=bool))

    def cut(self, d: Array) -> WeightPolyhedron:
        """The part where d.w <= 0; ``d`` has shape (K,)."""
        d = np.asarray(d, dtype=np.float64)
        if d.shape != (self.n_objectives,):
            raise InvalidInputError(
                f"cut normal must have shape ({self.n_objectives},), got {d.shape}"
            )
        return self.cut_all(d[None])

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
        K = self.n_objectives
        D = np.asarray(D, dtype=np.float64)
        if D.ndim != 2 or D.shape[1] != K:
            raise InvalidInputError(f"cut normals must have shape (m, {K}), got {D.shape}")
        if not np.isfinite(D).all():
            raise InvalidInputError("cut normals must be finite")
        lazy = np.zeros(len(D), dtype=bool) if is_lazy is None else np.asarray(is_lazy, dtype=bool)
        norm = np.linalg.norm(D @ plane_basis(K), axis=1)
        mean = D.mean(axis=1)
        # The simplex lies within distance 1 of its middle: beyond that a row holds or fails on all.
        matters = np.abs(mean) < norm
        contradicts = bool(np.any(~matters & (mean > 0.0)))
        cuts = np.r_[self.cuts, D[matters] / norm[matters, None]]
        cuts, lazy = distinct_rows(cuts, np.r_[self.is_lazy, lazy[matters]])
        return replace(
            self,
            cuts=cuts,
            is_lazy=lazy,
            is_contradictory=self.is_contradictory or contradicts,
        )

    @cached_property
    def A(self) -> Array:
        """Unit rows of A z <= b, shape (K + m, K - 1): the K bounds of the weights, then cuts."""
        U = plane_basis(self.n_objectives)
        rows: Array = np.r_[-U / self._bound_norm, self.cuts @ U]
        return rows

    @cached_property
    def b(self) -> Array:
        """Right-hand sides of A z <= b, shape (K + m,)."""
        K = self.n_objectives
        bounds = np.full(K, (1.0 / K - self.min_weight) / self._bound_norm)
        right: Array = np.r_[bounds, -self.cuts.mean(axis=1)]
        return right

    @property
    def _bound_norm(self) -> float:
        return math.sqrt(1.0 - 1.0 / self.n_objectives)

    def to_weights(self, z: Array) -> Array:
        """Weights of plane coordinates, (..., K-1) -> (..., K)."""
        U = plane_basis(self.n_objectives)
        w: Array = np.asarray(1.0 / self.n_objectives + z @ U.T)
        return w

    def to_plane(self, w: Array) -> Array:
        """Plane coordinates of weights, (..., K) -> (..., K-1)."""
        z: Array = np.asarray(w @ plane_basis(self.n_objectives))
        return z

    def contains(self, w: Array, tol: float = 1e-9) -> bool:
        """Whether no row is missed by more than ``tol`` (a Euclidean distance)."""
        w = np.asarray(w, dtype=np.float64)
        if w.shape != (self.n_objectives,):
            raise InvalidInputError(
                f"weights must have shape ({self.n_objectives},), got {w.shape}"
            )
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
        radius = self.ball.radius
        if radius < -FLAT_RADIUS:
            raise EmptyPolyhedronError(
                f"no weight satisfies all {len(self.cuts)} cuts (they miss by {-radius:.1e})",
                radius,
            )
        if radius <= FLAT_RADIUS:
            raise FlatPolyhedronError(
                f"the weights left by {len(self.cuts)} cuts are flat (radius {radius:.1e})", radius
            )
        return self.ball

    @cached_property
    def barrier(self) -> BarrierCentre:
        """Analytic centre of the bounds, the cuts that are not lazy, and the lazy ones that matter.

        A lazy row enters as soon as it cuts off the centre of those before it; many near-parallel
        rows would otherwise push the centre away from them.

        Raises:
            EmptyPolyhedronError: If the set is empty or flat.
        """
        if not self.is_contradictory:
            try:
                centre = self._barrier_from(np.zeros(self.n_objectives - 1))
                if float(np.min(self.b - self.A @ centre.z)) > FLAT_RADIUS:
                    return centre  # proves the interior without a linear program
            except SolverError:
                pass
        return self._barrier_from(self.chebyshev().z)

    def _barrier_from(self, z: Array) -> BarrierCentre:
        is_used = np.r_[np.ones(self.n_objectives, dtype=bool), ~self.is_lazy]
        while True:
            centre = barrier_centre(self.A[is_used], self.b[is_used], z)
            slack = self.b - self.A @ centre.z
            worst = int(np.argmin(slack))
            if slack[worst] > 0.0 or is_used[worst]:
                return centre
            is_used[worst] = True

    @cached_property
    def _whitened(self) -> Array:
        return whitened_rows(self.A, self.barrier, self.b)

    def _from_whitened(self, y: Array) -> Array:
        """Weights of whitened coordinates, clipped onto the bounds against rounding."""
        z = self.barrier.z + solve_triangular(self.barrier.R, y.T).T
        return feasible(self.to_weights(z), self.min_weight)

    def vertices(self) -> Array:
        """All vertices as weights, shape (n, K); exact enumeration for K <= 7.

        Raises:
            InvalidInputError: If K > 7.
            EmptyPolyhedronError: If the set is empty or flat.
        """
        if self.n_objectives > EXACT_OBJECTIVES:
            raise InvalidInputError(
                f"vertices are enumerated up to {EXACT_OBJECTIVES} objectives, "
                f"got {self.n_objectives}"
            )
        return self._from_whitened(whitened_vertices(self._whitened))

    @property
    def active_rows(self) -> NDArray[np.intp]:
        """Indices into ``A`` of the rows that shape the set: no other rows imply them.

        Raises:
            EmptyPolyhedronError: If the set is empty or flat.
        """
        return whitened_facets(self._whitened)

    def pruned(self) -> WeightPolyhedron:
        """The same set without implied cuts (the bounds of the weights always stay).

        The analytic centre depends on the rows, so pruning moves it; the set does not change.
        """
        K = self.n_objectives
        active = self.active_rows
        keep = active[active >= K] - K
        return replace(self, cuts=self.cuts[keep], is_lazy=self.is_lazy[keep])

    def relevance(self) -> Array:
        """(b_i - a_i.z) / |a_i|_{H^-1} of each row at the analytic centre z, shape (K + m,).

        At least 1 for the rows in the barrier. With m rows there, a relevance of sqrt(m (m - 1))
        proves that the others imply the row, for the Dikin ellipsoid of that radius holds the set.

        Raises:
            EmptyPolyhedronError: If the set is empty or flat.
        """
        root = solve_triangular(self.barrier.R, np.eye(self.n_objectives - 1))
        distance: Array = (self.b - self.A @ self.barrier.z) / np.linalg.norm(self.A @ root, axis=1)
        return distance

    def with_relevant(self, most: int) -> WeightPolyhedron:
        """The same set with all but the ``most`` most relevant cuts lazy.

        Nothing is dropped: a lazy cut enters the barrier where it cuts off its centre, and the
        bounds of the weights are always in it.

        Raises:
            InvalidInputError: If ``most`` is negative.
            EmptyPolyhedronError: If the set is empty or flat.
        """
        if most < 0:
            raise InvalidInputError(f"most must not be negative, got {most}")
        is_lazy = np.ones(len(self.cuts), dtype=bool)
        is_lazy[np.argsort(self.relevance()[self.n_objectives :], kind="stable")[:most]] = False
        return replace(self, is_lazy=is_lazy)

    def volume(self) -> float:
        """(K-1)-dimensional volume; exact for K <= 7, else scaled from the barrier's Hessian.

        The estimate is exact on the simplex itself: vol(simplex) sqrt(det H_simplex / det H). After
        many cuts it is too small, by a factor of 2 in runs and of 100 after 100 random cuts.
        Flat and empty sets have volume 0.
        """
        if self.ball.radius <= FLAT_RADIUS:
            return 0.0
        n = self.n_objectives - 1
        R = self.barrier.R
        if self.n_objectives <= EXACT_OBJECTIVES:
            return whitened_volume(self._whitened) / abs(float(np.prod(R.diagonal())))
        whole = WeightPolyhedron.simplex(self.n_objectives)
        log_ratio = np.log(np.abs(whole.barrier.R.diagonal() / R.diagonal())).sum()
        return math.sqrt(n + 1.0) / math.factorial(n) * math.exp(log_ratio)

    def support(self, c: Array) -> tuple[float, Array]:
        """Largest c.w over the set, and a weight vector that attains it.

        Args:
            c: Direction, shape (K,).

        Raises:
            EmptyPolyhedronError: If no weight satisfies every row.
        """
        c = np.asarray(c, dtype=np.float64)
        w = self.maximisers(c[None])[0]
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
            rows = self._whitened
        except FlatPolyhedronError:
            z = maximise(directions, self.A, self.b + FLAT_RADIUS, basis).x
            return feasible(self.to_weights(z), self.min_weight)
        directions = solve_triangular(self.barrier.R, directions.T, trans="T").T
        norm = np.linalg.norm(directions, axis=1, keepdims=True)
        directions /= np.where(norm > 0.0, norm, 1.0)
        return self._from_whitened(maximise(directions, rows, np.ones(len(rows)), basis).x)

    def intervals(self) -> Array:
        """Smallest and largest value of each weight, shape (K, 2), from 2K linear programs.

        Raises:
            EmptyPolyhedronError: If no weight satisfies every row.
        """
        eye = np.eye(self.n_objectives)
        corners = self.maximisers(np.r_[-eye, eye])
        extremes: Array = np.einsum("bjj->jb", corners.reshape(2, *eye.shape))
        return extremes
