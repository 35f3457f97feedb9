"""Relative entropy IRL (A. Boularias, J. Kober & J. Peters, AISTATS 2011) by importance sampling.

Of all distributions over trajectories whose features match the demonstrations' within eps it takes
the one nearest to a baseline q, P(tau) ~ q(tau) exp(w.F(tau)). In importance weights q / p_sampling
the dynamics cancel: trajectories replace the model. With all trajectories as samples, q of uniform
actions and eps = 0 it is MaxEnt 2008.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.special import logsumexp

from walking_irl.arrays import Array
from walking_irl.baselines.recovered import Recovered, from_weights, not_negative, positive
from walking_irl.errors import InvalidInputError
from walking_irl.rl.demonstrations import Demonstrations, demonstrate
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.rl.tabular import uniform_policy

FEW = 10.0
"""Effective sample size below which an answer rests on a handful of trajectories."""


class Reweighted(NamedTuple):
    """Samples weighed so that their features match the demonstrations'."""

    w: Array
    """Weights, shape (K,)."""
    p: Array
    """Probability of each sampled trajectory, shape (N,)."""
    n_effective: float
    """Effective sample size 1 / sum p^2."""
    n_iter: int


def thresholds(
    n: int, ranges: Array, discount: float, horizon: int, *, confidence: float = 0.95
) -> Array:
    """The paper's tolerance of each feature, by Hoeffding's inequality, shape (K,).

    eps_i = sqrt(-ln(1 - confidence) / (2 n)) (g^(H+1) - 1) / (g - 1) (max f_i - min f_i). For the
    numbers of demonstrations that people have it exceeds every difference of features: w = 0.
    """
    if n < 1 or not 0 < confidence < 1:
        raise InvalidInputError("thresholds need n >= 1 and a confidence in (0, 1)")
    powers = horizon + 1 if discount == 1 else (discount ** (horizon + 1) - 1) / (discount - 1)
    eps: Array = math.sqrt(-math.log(1 - confidence) / (2 * n)) * powers * np.asarray(ranges)
    return eps


def reweight(
    F: Array,
    F_E: Array,
    *,
    eps: Array | float = 0.0,
    log_ratio: Array | None = None,
    ridge: float = 0.0,
) -> Reweighted:
    """Maximise w.F_E - log sum_j rho_j exp(w.F_j) - eps.|w| - ridge/2 |w|^2.

    w = w+ - w- with both >= 0 makes |w| smooth: L-BFGS-B, exact, no subgradient steps. Features
    are standardised first (the ridge is on standardised weights); one that no sample varies gets
    the weight 0.

    Args:
        F: Features of the sampled trajectories, shape (N, K).
        F_E: Mean features of the demonstrations, shape (K,).
        eps: Tolerance of each feature, shape (K,) or one for all.
        log_ratio: log q(tau_j) / p_sampling(tau_j), shape (N,); 0 for samples of q itself.
        ridge: Weight of |w|^2 / 2.

    Raises:
        InvalidInputError: If there are no samples, or features are not finite.
    """
    F, F_E = np.asarray(F, dtype=np.float64), np.asarray(F_E, dtype=np.float64)
    if F.ndim != 2 or not len(F) or F_E.shape != F.shape[1:] or not np.isfinite(F).all():
        raise InvalidInputError(
            f"sampled trajectories need finite features (N, K) and demonstrations (K,), got "
            f"{F.shape} and {F_E.shape}"
        )
    K = len(F_E)
    offset = np.zeros(len(F)) if log_ratio is None else log_ratio - logsumexp(log_ratio)
    deviation = F.std(axis=0)
    is_flat = deviation <= 1e-9 * max(float(deviation.max()), 1e-300)
    scale = np.where(is_flat, 1.0, deviation)
    Z = np.where(is_flat, 0.0, (F - F_E) / scale)
    tolerance = np.broadcast_to(np.asarray(eps, dtype=np.float64), (K,)) / scale

    def objective(v: Array) -> tuple[float, Array]:
        w = v[:K] - v[K:]
        a = offset + Z @ w
        top = logsumexp(a)
        g = Z.T @ np.exp(a - top) + ridge * w
        value = top + tolerance @ (v[:K] + v[K:]) + 0.5 * ridge * w @ w
        return float(value), np.r_[g + tolerance, tolerance - g]

    result = minimize(
        objective,
        np.zeros(2 * K),
        jac=True,
        method="L-BFGS-B",
        bounds=[(0, None)] * (2 * K),
        options={"maxiter": 2000, "maxfun": 10000, "gtol": 1e-10, "ftol": 1e-15},
    )
    w = result.x[:K] - result.x[K:]
    a = offset + Z @ w
    p = np.exp(a - logsumexp(a))
    return Reweighted(w / scale, p, float(1 / (p**2).sum()), int(result.nit))


def relative_entropy(
    mdp: FiniteMDP,
    demonstrations: Demonstrations,
    *,
    rng: np.random.Generator,
    n_samples: int = 2000,
    confidence: float | None = None,
    ridge: float = 1e-2,
) -> Recovered:
    """Weights from trajectories of uniformly random actions, which need no model to be drawn.

    Args:
        mdp: The world; only simulated.
        demonstrations: States and actions.
        rng: Draws the trajectories, from the demonstrations' own first states.
        n_samples: Number of trajectories.
        confidence: Of the paper's thresholds eps; by default eps = 0, as they make all weights 0.
        ridge: Weight of |w|^2 / 2.

    Returns:
        Free weights; ``info`` holds the effective sample size and the residual of the features.
    """
    not_negative(ridge=ridge)
    positive(n_samples=n_samples)
    demonstrations.check(mdp.n_states, mdp.n_actions)
    H, g = demonstrations.horizon, mdp.discount
    start = demonstrations.start(mdp.n_states)
    drawn = demonstrate(mdp, uniform_policy(mdp), n_samples, H, rng=rng, start=start)
    F, F_E = drawn.features(mdp.Phi, g), demonstrations.features(mdp.Phi, g).mean(axis=0)
    eps = np.zeros(mdp.n_objectives)
    if confidence is not None:
        ranges = np.ptp(mdp.Phi, axis=0)
        n = demonstrations.n_trajectories
        eps = thresholds(n, ranges, g, H, confidence=confidence)
    found = reweight(F, F_E, eps=eps, ridge=ridge)
    notes = []
    if not found.w.any():
        notes.append("the tolerance exceeds every difference of features: all weights are 0")
    elif found.n_effective < FEW:
        notes.append(f"the answer rests on {found.n_effective:.1f} effective trajectories")
    info = {
        "effective_sample_size": found.n_effective,
        "residual": float(np.abs(found.p @ F - F_E).max()),
        "solves": 0,
    }
    return from_weights(mdp, found.w, "free", info=info, notes=tuple(notes))
