"""Newton's method on the expert's regret f(w) = V(w) - w.mu_E, in the simplex's plane.

The gradient is mu(w) - mu_E, the Hessian the sensitivity d mu/d w. A domain's sensitivity may be
wrong by a factor of two (Gauss-Newton), so secants between queries correct it (BFGS; Nocedal and
Wright, *Numerical Optimization*, section 6.1).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from walking_irl.polyhedron import plane_basis
from walking_irl.types import Array

SECANT_RATIO = 8.0
"""A secant whose curvature differs more than this from the model's is not trusted."""


class Step(NamedTuple):
    """Minimiser of the local model over the weights, and how much it promises to lower f."""

    w: Array
    decrease: float


def reduced(sensitivity: Array) -> Array:
    """Hessian in the plane, (K, K) -> (K-1, K-1), symmetric, with a floor on its curvature."""
    U = plane_basis(len(sensitivity))
    B = U.T @ sensitivity @ U
    values, vectors = np.linalg.eigh(0.5 * (B + B.T))
    floor = 1e-9 * max(float(values[-1]), 1e-300)
    positive: Array = (vectors * np.maximum(values, floor)) @ vectors.T
    return positive


def with_secants(B: Array, W: Array, M: Array, best: int, min_distance: float) -> Array:
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
        if not model / SECANT_RATIO < curvature < model * SECANT_RATIO:
            continue
        Bs = B @ s
        B = B - np.outer(Bs, Bs) / model + np.outer(y, y) / curvature
    return 0.5 * (B + B.T)


def newton_step(w: Array, gradient: Array, B: Array, min_weight: float) -> Step:
    """Minimise g.(v - w) + (v - w)'H(v - w)/2 over weights v >= min_weight, sum(v) = 1.

    Solved exactly as a least-distance problem (Lawson and Hanson, *Solving Least Squares Problems*,
    chapter 23).

    Args:
        w: Query, shape (K,).
        gradient: mu(w) - mu_E, shape (K,).
        B: Reduced Hessian, positive definite, shape (K-1, K-1).
        min_weight: Lower bound of every weight.
    """
    U = plane_basis(len(w))
    g = U.T @ gradient
    L = np.linalg.cholesky(B)
    free = -np.linalg.solve(B, g)
    v = w + U @ free
    if v.min() < min_weight:
        v = v + U @ np.linalg.solve(L.T, _least_distance(np.linalg.solve(L, U.T).T, min_weight - v))
        v = np.maximum(v, min_weight)
    v = v / v.sum()
    z = U.T @ (v - w)
    return Step(v, -float(g @ z + 0.5 * z @ B @ z))


def _least_distance(G: Array, h: Array) -> Array:
    """Shortest y with G y >= h, shapes (m, n) and (m,); the rows must be consistent."""
    n = G.shape[1]
    E = np.r_[G.T, h[None]]
    u, _ = nnls(E, np.r_[np.zeros(n), 1.0])
    r = E @ u - np.r_[np.zeros(n), 1.0]
    y: Array = -r[:n] / r[n]
    return y


def extremes(w: Array, B: Array, drop: float, min_weight: float) -> Array:
    """Predicted extreme weights of {f <= drop} around a minimum at ``w``; shape (2K, K).

    Weight j reaches w_j +- sqrt(2 drop (U B^-1 U')_jj); rows come in pairs (+, -), shortened where
    a weight would fall below half its bound.
    """
    U = plane_basis(len(w))
    C = U @ np.linalg.solve(B, U.T)
    steps = C / np.sqrt(np.maximum(np.diag(C), 1e-300))[:, None] * np.sqrt(2.0 * drop)
    out = []
    for step in steps:
        for v in (step, -step):
            room = np.where(v < 0.0, (w - 0.5 * min_weight) / np.maximum(-v, 1e-300), np.inf)
            out.append(np.maximum(w + min(1.0, float(room.min())) * v, 0.0))
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
