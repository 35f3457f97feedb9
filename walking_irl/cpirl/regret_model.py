"""Quadratic model of the expert's regret f(w) = V(w) - w.mu_E near its minimum, and its steps.

The gradient is mu(w) - mu_E, the Hessian the sensitivity d mu/d w, both in the simplex's plane. A
domain's sensitivity may be wrong by a factor of two (Gauss-Newton), so secants between queries
correct it (BFGS; Nocedal and Wright, *Numerical Optimization*, section 6.1).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from walking_irl.arrays import Array
from walking_irl.cpirl.bundle import Bundle
from walking_irl.geometry.plane import feasible, plane_basis

_SECANT_RATIO = 8.0
"""A secant whose curvature differs more than this from the model's is not trusted."""
_MUCH_SHORTENED = 0.05
"""Share of a step to an extreme below which it follows the bound that it meets instead."""


class Step(NamedTuple):
    """Minimiser of the local model over the weights, and how much it promises to lower f."""

    w: Array
    decrease: float


class RegretModel(NamedTuple):
    """Quadratic model of the regret around the best query."""

    best: int
    """Index of that query."""
    B: Array
    """Hessian in the plane of the weights, shape (K-1, K-1)."""
    step: Step
    """To its minimum."""
    prior: Array
    """The Hessian before its secants: the last that could be trusted, shape (K-1, K-1)."""

    @classmethod
    def fit(cls, bundle: Bundle, min_distance: float, prior: Array | None = None) -> RegretModel:
        """Model around the query that is predicted to be nearest to the minimum.

        Args:
            bundle: At least one of its responses has a sensitivity.
            min_distance: Secants between closer queries say more about noise than about curvature.
            prior: Of the model before, for a best query without a sensitivity.
        """
        W, gradients = bundle.W, bundle.M - bundle.mu
        best = int(np.argmin(bundle.relative_regrets))
        usable = np.ones(len(W), dtype=bool) if bundle.is_match.all() else ~bundle.is_match
        for _ in range(2):
            prior = _trusted_hessian(bundle, best, prior)
            B = _with_secants(prior, W, bundle.M, best, min_distance)
            pairs = zip(W, gradients, strict=True)
            steps = [newton_step(w, g, B, bundle.min_weight) for w, g in pairs]
            best = int(np.argmin(np.where(usable, [s.decrease for s in steps], np.inf)))
        prior = _trusted_hessian(bundle, best, prior)
        B = _with_secants(prior, W, bundle.M, best, min_distance)
        return cls(best, B, newton_step(W[best], gradients[best], B, bundle.min_weight), prior)


def _trusted_hessian(bundle: Bundle, best: int, prior: Array | None) -> Array:
    """Sensitivity at the best query, else the last one that could be trusted; (K-1, K-1)."""
    sensitivity = bundle.responses[best].sensitivity
    if sensitivity is None and prior is not None:
        return prior
    known = [r.sensitivity for r in bundle.responses if r.sensitivity is not None]
    return reduced(known[-1] if sensitivity is None else sensitivity)


def reduced(sensitivity: Array) -> Array:
    """Hessian in the plane, (K, K) -> (K-1, K-1), symmetric, with a floor on its curvature."""
    U = plane_basis(len(sensitivity))
    B = U.T @ sensitivity @ U
    values, vectors = np.linalg.eigh(0.5 * (B + B.T))
    floor = 1e-9 * max(float(values[-1]), 1e-300)
    positive: Array = (vectors * np.maximum(values, floor)) @ vectors.T
    return positive


def _with_secants(B: Array, W: Array, M: Array, best: int, min_distance: float) -> Array:
    """BFGS updates of ``B`` with the pairs (query k, query ``best``), farthest first.

    Args:
        B: Reduced Hessian at query ``best``, shape (K-1, K-1).
        W: Queries, shape (n, K).
        M: Feature expectations of their policies, shape (n, K).
        best: Index of the query around which the model holds.
        min_distance: Pairs closer than this say more about noise than about curvature.

    Returns:
        Corrected Hessian, positive definite, shape (K-1, K-1).
    """
    U = plane_basis(W.shape[1])
    S, Y = (W[best] - W) @ U, (M[best] - M) @ U
    distance = np.linalg.norm(S, axis=1)
    for k in np.argsort(-distance):
        if distance[k] < min_distance:
            break
        s, y = S[k], Y[k]
        curvature, model = float(s @ y), float(s @ B @ s)
        if not model / _SECANT_RATIO < curvature < model * _SECANT_RATIO:
            continue
        Bs = B @ s
        B = B - np.outer(Bs, Bs) / model + np.outer(y, y) / curvature
    return 0.5 * (B + B.T)


def newton_step(w: Array, gradient: Array, B: Array, min_weight: float) -> Step:
    """Minimise g.(v - w) + (v - w)'H(v - w)/2 over weights v >= min_weight, sum(v) = 1.

    By an active-set method from ``w`` (Nocedal and Wright, *Numerical Optimization*, algorithm
    16.3): each step minimises over the weights that are not at their bound and goes as far as the
    next bound, so that a Hessian that is nearly singular cannot lead outside.

    Args:
        w: Query, shape (K,).
        gradient: mu(w) - mu_E, shape (K,).
        B: Reduced Hessian, positive definite, shape (K-1, K-1).
        min_weight: Lower bound of every weight.
    """
    U = plane_basis(len(w))
    v = w - U @ np.linalg.solve(B, U.T @ gradient)
    if not v.min() >= min_weight:
        v = _bounded_minimum(feasible(w, min_weight), w, gradient, U @ B @ U.T, min_weight)
    v = feasible(v, min_weight)
    z = U.T @ (v - w)
    decrease = -float((U.T @ gradient) @ z + 0.5 * z @ B @ z)
    if not (np.isfinite(decrease) and decrease > 0.0):
        return Step(feasible(w, min_weight), 0.0)
    return Step(v, decrease)


def _bounded_minimum(v: Array, w: Array, gradient: Array, H: Array, min_weight: float) -> Array:
    """Minimiser of the model about ``w`` over the weights, from weights ``v``; shape (K,)."""
    K = len(w)
    is_free = v > min_weight
    for _ in range(10 * K):
        p = _free_step(H, gradient + H @ (v - w), is_free)
        room = np.full(K, np.inf)
        room[p < 0.0] = (v[p < 0.0] - min_weight) / -p[p < 0.0]
        blocking = int(np.argmin(room))
        if room[blocking] < 1.0:
            v = v + room[blocking] * p
            v[blocking], is_free[blocking] = min_weight, False
            continue
        v = v + p
        g = gradient + H @ (v - w)
        price = np.where(is_free, np.inf, g - g[is_free].mean())
        leaves = int(np.argmin(price))
        if not price[leaves] < -1e-12 * max(float(np.abs(g).max()), 1e-300):
            break
        is_free[leaves] = True
    return v


def _free_step(H: Array, g: Array, is_free: NDArray[np.bool_]) -> Array:
    """Minimiser of g.p + p'Hp/2 over sum(p) = 0 in which only free weights move, shape (K,)."""
    p = np.zeros(len(g))
    if is_free.sum() < 2:
        return p
    V = plane_basis(int(is_free.sum()))
    part = H[np.ix_(is_free, is_free)]
    p[is_free] = -V @ np.linalg.lstsq(V.T @ part @ V, V.T @ g[is_free], rcond=None)[0]
    return p


def extremes(w: Array, B: Array, drop: float, min_weight: float) -> Array:
    """Predicted extreme weights of {f <= drop} around a minimum at ``w``; shape (2K, K).

    Weight j reaches w_j +- sqrt(2 drop (U B^-1 U')_jj); rows come in pairs (+, -), shortened where
    a weight would fall below half its bound, or bent along the bound where next to nothing is left.
    """
    U = plane_basis(len(w))
    C = U @ np.linalg.solve(B, U.T)
    steps = C / np.sqrt(np.maximum(np.diag(C), 1e-300))[:, None] * np.sqrt(2.0 * drop)
    out = []
    for step in steps:
        for v in (step, -step):
            room = np.where(v < 0.0, (w - 0.5 * min_weight) / np.maximum(-v, 1e-300), np.inf)
            share = min(1.0, float(room.min()))
            end = w + v if share < _MUCH_SHORTENED else w + share * v
            out.append(np.maximum(end, 0.5 * min_weight))
    W: Array = np.array(out) / np.sum(out, axis=1, keepdims=True)
    return W


def standard_errors(B: Array, covariance: Array) -> Array:
    """Of the weights, from an error of mu_E with this covariance: sqrt diag(A S A'), shape (K,).

    dw = A d mu with A = U B^-1 U'.
    """
    U = plane_basis(len(covariance))
    A = U @ np.linalg.solve(B, U.T)
    errors: Array = np.sqrt(np.maximum(np.diag(A @ covariance @ A.T), 0.0))
    return errors
