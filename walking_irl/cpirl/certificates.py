"""What a run of CPIRL proves: bounds on losses and weights, each a theorem as a function.

``D`` stacks the differences d_i = mu_i - mu_E of the policies found (or their robust versions),
shape (n, K). The loss of policy i under weights w is L_i(w) = -d_i.w; under the expert's own
weights it is what imitating with policy i costs.
"""

from __future__ import annotations

import math

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.geometry.centres.centre import Centre
from walking_irl.geometry.game import finite_rows
from walking_irl.geometry.plane import plane_basis
from walking_irl.geometry.polyhedron import WeightPolyhedron


def single_policy_bounds(P: WeightPolyhedron, D: Array) -> Array:
    """U_i = max {L_i(w) : w in P} >= L_i(w_E) for each policy by itself, shape (n,)."""
    D = finite_rows(D, P.n_objectives)
    losses: Array = np.einsum("ij,ij->i", -D, P.maximisers(-D))
    return losses


def radius(P: WeightPolyhedron, w: Array) -> float:
    """Upper bound on max {||v - w||_2 : v in P} (exact for K <= 7 on sets with interior).

    With it, L_i(w_E) <= radius(P, w_i) ||Pi d_i||_2 - f(w_i) (Theorem 6.2.2), Pi d = d - mean(d),
    and ||w_E - w||_2 <= radius(P, w) (Theorem 6.2.7).
    """
    w = _weights(w, P.n_objectives)
    if P.n_objectives <= 7 and not P.is_flat:
        return float(np.linalg.norm(P.vertices() - w, axis=1).max())
    lo, hi = P.intervals().T
    return float(np.linalg.norm(np.maximum(np.abs(hi - w), np.abs(lo - w))))


def radius_bound(P: WeightPolyhedron, w: Array, d: Array, regret: float) -> float:
    """Theorem 6.2.2: L(w_E) <= radius(P, w) ||Pi d||_2 - f(w) for the policy found at ``w``."""
    d = finite_rows(np.atleast_2d(d), P.n_objectives)[0]
    return radius(P, w) * float(np.linalg.norm(d - d.mean())) - regret


def loss_bound(w_E: Array, w: Array, d: Array, regret: float) -> float:
    """Lemma 6.2.1: the loss of the policy found at ``w`` is bounded by the weights' distance.

    f(w) + L(w_E) = (w_E - w).(mu_E - mu), both terms are >= 0, hence
    L(w_E) <= min(||w_E - w||_2 ||Pi d||_2, ||w_E - w||_1 span(d)/2) - f(w).
    """
    w_E, w = _weights(w_E), _weights(w)
    step = w_E - w
    euclidean = np.linalg.norm(step) * np.linalg.norm(d - d.mean())
    return float(min(euclidean, 0.5 * np.abs(step).sum() * np.ptp(d)) - regret)


def ellipsoid_bounds(centre: Centre, d: Array) -> tuple[float, float]:
    """Closed-form bracket of U = max {-d.w : w in P} from a centre's ellipsoids (Theorem 6.2.4).

    -d.c + inner ||q||_S <= U <= -d.c + outer ||q||_S with q = -U'd and S the centre's shape.
    """
    d = finite_rows(np.atleast_2d(d), len(centre.w))[0]
    q = plane_basis(len(centre.w)).T @ d
    length = math.sqrt(max(float(q @ centre.shape @ q), 0.0))
    middle = -float(d @ centre.w)
    return middle + centre.inner * length, middle + centre.outer * length


def ellipsoid_intervals(centre: Centre) -> Array:
    """Per-weight intervals from the outer ellipsoid, shape (K, 2): they contain P's (6.2.7)."""
    U = plane_basis(len(centre.w))
    half = centre.outer * np.sqrt(np.einsum("ij,jk,ik->i", U, centre.shape, U))
    bounds: Array = np.c_[centre.w - half, centre.w + half]
    return bounds


def diameter_bounds(centre: Centre) -> tuple[float, float]:
    """2 inner lambda <= diam(P) <= 2 outer lambda, lambda the longest semi-axis (6.2.8)."""
    longest = math.sqrt(float(np.linalg.eigvalsh(centre.shape)[-1]))
    return 2.0 * centre.inner * longest, 2.0 * centre.outer * longest


def curvature_bound(regret: float, curvature: float) -> float:
    """||w_E - w||_2 <= sqrt(2 f(w) / h) where f(v) >= h ||v - w_E||^2 / 2: from regret to weights.

    A small volume bounds no distance; this needs the regret's smallest curvature h in the plane of
    the weights (of the Hessian d mu/d w, on smooth fronts).

    Raises:
        InvalidInputError: If the regret is negative or the curvature not positive.
    """
    if not (regret >= 0.0 and curvature > 0.0):
        raise InvalidInputError(
            f"need a regret >= 0 and a curvature > 0, got {regret} and {curvature}"
        )
    return math.sqrt(2.0 * regret / curvature)


def least_certificate(P: WeightPolyhedron, D: Array) -> float:
    """Lower bound t_k >= r min_i ||Pi d_i||_2, r the inscribed radius of the set that D leaves.

    A set that holds a large ball cannot have a small certificate.
    """
    D = finite_rows(D, P.n_objectives)
    return max(P.ball.radius, 0.0) * float(
        np.linalg.norm(D - D.mean(axis=1, keepdims=True), axis=1).min()
    )


def volume_bound(D: Array, volume_ratio: float) -> float:
    """Theorem A1: t_k <= B a/(1 - a), a = (vol P_k / vol simplex)^(1/(K-1)), B = max d_ij^+.

    Args:
        D: All cuts of P_k, shape (n, K).
        volume_ratio: vol P_k / vol simplex, in [0, 1); exact or an upper bound, which the
            estimate of more than 7 weights' volumes is not.
    """
    D = finite_rows(D)
    if not 0.0 <= volume_ratio < 1.0:
        raise InvalidInputError(f"volume_ratio must lie in [0, 1), got {volume_ratio}")
    alpha = volume_ratio ** (1.0 / (D.shape[1] - 1))
    return float(max(D.max(), 0.0) * alpha / (1.0 - alpha))


_GRAVITY_RATE = -math.log(1.0 - 1.0 / math.e)
"""Volume lost per cut through the centre of gravity, in nats (Gruenbaum)."""
_ELLIPSOID_RATE = -math.log(0.843)
"""The same for the largest inscribed *ellipsoid* (not the polyhedron) and its centre."""


def iteration_bound(n_objectives: int, accuracy: float, centre: str = "cg") -> float:
    """Forward solves after which t_k <= accuracy B (Theorems A1, 6.2.5 and 6.2.6).

    n ln(1 + 1/accuracy) / rate with n = K - 1 and the rate 0.459 per cut for the centre of
    gravity; 0.171 for the inscribed ellipsoid, whose often quoted factor 1 - 1/n is false. For the
    analytic centre any k with k a^(2 + 2K/k) > 1.74 n^2 (n + 1) ln(1 + k/(2n)),
    a = accuracy/(1 + accuracy) (Theorem A2, after Goffin, Luo and Ye 1996): polynomial, and far
    above what is observed, which is as few as for the centre of gravity.

    Raises:
        InvalidInputError: If the centre has no such bound, or the accuracy is not in (0, 1).
    """
    rates = {"cg": _GRAVITY_RATE, "mvie": _ELLIPSOID_RATE}
    if centre not in (*rates, "ac"):
        raise InvalidInputError(
            f"no iteration bound for centre {centre!r}; choose from ac, cg, mvie"
        )
    if not 0.0 < accuracy < 1.0:
        raise InvalidInputError(f"accuracy must lie in (0, 1), got {accuracy}")
    if centre == "ac":
        return _analytic_bound(n_objectives, accuracy / (1.0 + accuracy))
    return (n_objectives - 1) * math.log1p(1.0 / accuracy) / rates[centre]


def _analytic_bound(K: int, alpha: float) -> float:
    """Smallest k of Theorem A2 above its sign change, by bisection on log k."""
    from scipy.optimize import brentq  # takes .3 s, and is needed here alone

    n = K - 1

    def excess(log_k: float) -> float:
        k = math.exp(log_k)
        right = 1.74 * n**2 * (n + 1) * math.log1p(k / (2 * n))
        return log_k + (2.0 + 2.0 * K / k) * math.log(alpha) - math.log(right)

    low, high = 0.0, 1.0
    while excess(high) <= 0.0:
        low, high = high, 2.0 * high
    return math.exp(float(brentq(excess, low, high)))


def level_bound(n_objectives: int, accuracy: float) -> float:
    """Theorem A3: cuts through centres of gravity until f(w_k) <= accuracy max_j f(e_j)."""
    if not 0.0 < accuracy < 1.0:
        raise InvalidInputError(f"accuracy must lie in (0, 1), got {accuracy}")
    return (n_objectives - 1) * math.log(1.0 / accuracy) / _GRAVITY_RATE


def _weights(w: Array, n_objectives: int | None = None) -> Array:
    w = np.asarray(w, dtype=np.float64)
    if w.ndim != 1 or n_objectives not in (None, len(w)) or not np.isfinite(w).all():
        raise InvalidInputError(f"weights must be finite with shape (K,), got shape {w.shape}")
    return w
