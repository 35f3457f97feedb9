r"""The next query where responses carry sensitivities: a Newton step on the expert's regret.

:math:`f(w) = V(w) - w \cdot \mu_E` is convex, with gradient :math:`\mu(w) - \mu_E` and the
sensitivity of :math:`\mu` as its Hessian. For an expert that is optimal for :math:`w_E`, f has its
minimum 0 there. Solvers give the Hessian to a factor of about two (Gauss-Newton), so secants over
all queries correct it: C. G. Broyden, R. Fletcher, D. Goldfarb, D. F. Shanno (1970).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from walking_irl.archive import Archive, Query
from walking_irl.polyhedron import plane_basis
from walking_irl.types import Array

START = 0.02
"""Relative regret of the best query at which Newton steps begin."""
TRUSTED_CURVATURE = (1 / 8, 8.0)
"""Ratios of a secant's curvature to the Hessian's outside which the secant is not believed."""
LEAST_PAIR = 1e-7
LEAST_NOISY_PAIR = 3e-3
"""Differences of closer queries are solver tolerance; of an estimated expert, noise."""
OVERSHOOT = 3.0
"""A predicted decrease beyond this many times f is impossible: min f = 0."""
LONGEST_STEP = 0.3  # L1, for an estimated expert


class Step(NamedTuple):
    """A Newton step from the best query."""

    best: Query
    w: Array
    """Where it leads, shape (K,)."""
    hessian: Array
    """Hessian of f in the simplex's plane, shape (K - 1, K - 1)."""

    @property
    def length(self) -> float:
        """L1 length in weights."""
        return float(np.abs(self.w - self.best.w).sum())

    def inverse(self) -> Array:
        """Inverse Hessian in weights, shape (K, K): dw = inverse @ d mu_E."""
        U = plane_basis(len(self.w))
        return np.asarray(U @ np.linalg.inv(self.hessian) @ U.T)


class NewtonRule:
    """Proposes Newton steps from an archive's queries.

    Args:
        min_weight: Lower bound of every weight.
        is_estimated: Whether the expert is known with an error: the best query is then the one
            nearest to the root of the gradient, secants of close queries are noise, and f may
            become negative.
    """

    def __init__(self, min_weight: float, is_estimated: bool) -> None:
        self.min_weight = min_weight
        self.is_estimated = is_estimated
        self._clean: Array | None = None

    def step(self, archive: Archive) -> Step | None:
        """Step from the best query, or None where no response carries a sensitivity yet."""
        queries = [q for q in archive.queries if not archive.is_demonstration(q)]
        if not queries:
            return None
        regrets = np.array([archive.regret(q.w) / archive.scale(q.w) for q in queries])
        best = int(np.argmin(regrets))
        if regrets[best] > START:
            return None
        hessian = self._hessian(queries, best)
        if hessian is None:
            return None
        if self.is_estimated:
            best = int(np.argmin([_decrement(archive, q, hessian) for q in queries]))
            hessian = self._hessian(queries, best)
            assert hessian is not None
        q = queries[best]
        w = minimise_quadratic(q.w, q.mu - archive.mu_E, hessian, self.min_weight)
        return self._shortened(archive, Step(q, w, hessian))

    def _hessian(self, queries: Sequence[Query], best: int) -> Array | None:
        sensitivity = queries[best].sensitivity
        if sensitivity is not None:
            self._clean = sensitivity
        elif self._clean is None:
            known = [q.sensitivity for q in queries if q.sensitivity is not None]
            if not known:
                return None
            self._clean = known[-1]
        U = plane_basis(len(queries[best].w))
        B = U.T @ self._clean @ U
        B = (B + B.T) / 2
        B += 1e-9 * np.trace(B) * np.eye(len(B))
        Z = np.array([q.w for q in queries]) @ U
        G = np.array([q.mu for q in queries]) @ U
        least = LEAST_NOISY_PAIR if self.is_estimated else LEAST_PAIR
        return secant_hessian(B, Z - Z[best], G - G[best], least)

    def _shortened(self, archive: Archive, s: Step) -> Step:
        move = s.w - s.best.w
        if self.is_estimated:
            return s._replace(w=s.best.w + move * min(1.0, LONGEST_STEP / max(s.length, 1e-12)))
        z = move @ plane_basis(len(move))
        predicted = -float((s.best.mu - archive.mu_E) @ move + z @ s.hessian @ z / 2)
        floor = 1e-9 * archive.scale(s.best.w)
        ratio = predicted / max(archive.regret(s.best.w), floor)
        return s._replace(w=s.best.w + move / ratio) if ratio > OVERSHOOT else s


def _decrement(archive: Archive, q: Query, hessian: Array) -> float:
    """Newton decrement at a query, d' B^-1 d: its squared distance from the root."""
    d = (q.mu - archive.mu_E) @ plane_basis(len(q.w))
    return float(d @ np.linalg.solve(hessian, d))


def secant_hessian(B: Array, S: Array, Y: Array, least: float) -> Array:
    """BFGS updates of a Hessian with secant pairs, the farthest first.

    Args:
        B: Hessian, shape (n, n), symmetric positive definite.
        S: Steps from the best query to all queries, shape (m, n).
        Y: Changes of the gradient over them, shape (m, n).
        least: Shortest step that tells of curvature and not of noise.
    """
    lengths = np.linalg.norm(S, axis=1)
    low, high = TRUSTED_CURVATURE
    for i in np.argsort(lengths)[::-1]:
        s, y = S[i], Y[i]
        if not least < lengths[i] < 1:
            continue
        Bs = B @ s
        curvature, predicted = float(s @ y), float(s @ Bs)
        if low * predicted < curvature < high * predicted:
            B = B - np.outer(Bs, Bs) / predicted + np.outer(y, y) / curvature
    return B


def minimise_quadratic(w: Array, d: Array, hessian: Array, min_weight: float) -> Array:
    """Weights v >= min_weight that minimise d.(v - w) + (v - w)' H (v - w) / 2.

    Args:
        w: Where f has gradient ``d``, shape (K,).
        d: Gradient, shape (K,).
        hessian: Hessian in the simplex's plane, shape (K - 1, K - 1).
        min_weight: Lower bound of every weight.
    """
    U = plane_basis(len(w))
    v: Array = w - U @ np.linalg.solve(hessian, U.T @ d)
    if v.min() >= min_weight:
        return v
    H = U @ hessian @ U.T
    found = minimize(
        lambda v: d @ (v - w) + (v - w) @ H @ (v - w) / 2,
        np.clip(w, min_weight, None),
        jac=lambda v: d + H @ (v - w),
        bounds=[(min_weight, 1)] * len(w),
        constraints=[{"type": "eq", "fun": lambda v: v.sum() - 1, "jac": np.ones_like}],
        method="SLSQP",
        options={"ftol": 1e-14},
    )
    v = np.clip(found.x if found.success else v, min_weight, None)
    return np.asarray(v / v.sum())


def extremes(centre: Array, hessian: Array, tolerance: float, min_weight: float) -> Array:
    r"""Predicted extreme weights of {f <= tolerance}, lower and upper of each; shape (2K, K).

    Around the minimum f is quadratic, so weight j extends by
    :math:`\sqrt{2 \, \text{tol} \, (U H^{-1} U^T)_{jj}}`.
    """
    U = plane_basis(len(centre))
    inverse = U @ np.linalg.inv(hessian) @ U.T
    out = []
    for j in range(len(centre)):
        reach = inverse[j] * np.sqrt(2 * tolerance / inverse[j, j])
        for move in (-reach, reach):
            shrinks = move < 0
            room = (centre - min_weight)[shrinks] / -move[shrinks]
            out.append(centre + move * min(1.0, float(room.min(initial=1.0))))
    return np.array(out)
