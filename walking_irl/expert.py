"""What trajectories say of an expert: mean features, confidence half-widths, its optimality gap.

Half-widths hold with probability ``confidence`` for all K features at once, so that every cut
built from the corner mu + error + suboptimality keeps the expert's weights.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Literal, TypeVar

import numpy as np
from scipy.special import stdtrit

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.types import Expert, Response

Bound = Literal["student", "bernstein", "hoeffding"]
Trajectory = TypeVar("Trajectory")


def student_quantile(confidence: float, n_samples: Array | int, n_tests: int = 1) -> Array:
    """Student's two-sided quantile for means of n samples, and for so many intervals at once.

    Args:
        confidence: Probability that all intervals hold (Bonferroni), in (0, 1).
        n_samples: Samples behind each mean, any shape.
        n_tests: Number of intervals.

    Returns:
        The quantiles, of the shape of ``n_samples``.
    """
    df = np.maximum(np.asarray(n_samples) - 1, 1)
    found: Array = np.asarray(stdtrit(df, 1.0 - (1.0 - confidence) / (2 * n_tests)))
    return found


def half_widths(
    returns: Array,
    *,
    bound: Bound = "student",
    confidence: float = 0.95,
    ranges: Array | None = None,
    n_policies: int = 1,
) -> Array:
    """Half-widths e with |mean - mu| <= e for all features and policies at once, shape (K,).

    With delta = 1 - confidence, N policies, K features, m samples of range C_j and s.d. s_j:
    Hoeffding C sqrt(ln(2KN/delta)/(2m)); empirical Bernstein (Maurer and Pontil 2009)
    sqrt(2 s^2 L/m) + 7 C L/(3(m-1)), L = ln(4KN/delta); Student t_{1-delta/(2KN), m-1} s/sqrt(m).
    Student's is the practical one (it assumes near-normal means); Hoeffding's needs > 1e4 samples.

    Args:
        returns: Features of independent trajectories, shape (m, K).
        bound: Which inequality.
        confidence: Probability that all half-widths hold, in (0, 1).
        ranges: Length C_j of the interval that holds each feature, shape (K,); for the
            distribution-free bounds.
        n_policies: Number N of policies that are estimated like this one.

    Raises:
        InvalidInputError: If there are fewer than 2 trajectories, or the range is missing.
    """
    returns = _returns(returns)
    m, K = returns.shape
    if not 0.0 < confidence < 1.0 or n_policies < 1:
        raise InvalidInputError("confidence must lie in (0, 1) and n_policies be positive")
    delta, deviation = 1.0 - confidence, returns.std(axis=0, ddof=1)
    if bound == "student":
        quantile = float(student_quantile(confidence, m, K * n_policies))
        widths: Array = quantile * deviation / math.sqrt(m)
        return widths
    if bound not in ("bernstein", "hoeffding"):
        raise InvalidInputError(
            f"unknown bound {bound!r}; choose from bernstein, hoeffding, student"
        )
    if ranges is None:
        raise InvalidInputError(f"the {bound} bound needs the features' ranges, shape ({K},)")
    C = np.asarray(ranges, dtype=np.float64)
    if bound == "hoeffding":
        widths = C * math.sqrt(math.log(2 * K * n_policies / delta) / (2 * m))
        return widths
    L = math.log(4 * K * n_policies / delta)
    widths = deviation * math.sqrt(2 * L / m) + 7 * C * L / (3 * (m - 1))
    return widths


def expert_from_returns(
    returns: Array,
    *,
    bound: Bound = "student",
    confidence: float = 0.95,
    ranges: Array | None = None,
    suboptimality: float = 0.0,
    demonstration: Any = None,
) -> Expert:
    """Expert known by independent trajectories; ``returns`` has shape (m, K)."""
    returns = _returns(returns)
    return Expert(
        mu=returns.mean(axis=0),
        error=half_widths(returns, bound=bound, confidence=confidence, ranges=ranges),
        suboptimality=suboptimality,
        covariance=np.cov(returns.T).reshape(returns.shape[1], -1) / len(returns),
        n_samples=len(returns),
        demonstration=demonstration,
    )


def expert_from_trajectories(
    trajectories: Sequence[Trajectory],
    features: Callable[[Trajectory], Any],
    discount: float | None = None,
    *,
    bound: Bound = "student",
    confidence: float = 0.95,
    ranges: Array | None = None,
    suboptimality: float = 0.0,
    demonstration: Any = None,
) -> Expert:
    """Expert known by recorded trajectories, with error bars.

    >>> walks = [[1.0, 2.0, 0.5], [1.5, 1.5], [0.5, 2.0, 1.0, 0.5]]
    >>> expert = expert_from_trajectories(walks, lambda x: [[-v, -(v**2)] for v in x])
    >>> expert.mu.round(3).tolist(), expert.n_samples
    ([-3.5, -5.083], 3)

    Args:
        trajectories: At least 2, independent of each other, of any kind and length.
        features: Maps one of them to the features of its steps, shape (T, K), or to their sums,
            shape (K,). Larger is better: costs enter with a minus sign, as in the ``mu`` of the
            learner's solver, which must mean the same quantity.
        discount: Weight of each step relative to the one before, in (0, 1]; None for plain sums.
        bound: Which error bars, see :func:`half_widths`.
        confidence: Probability that all of them hold.
        ranges: Of the sums, shape (K,), for the distribution-free bounds.
        suboptimality: By how much a policy may beat the expert, in units of ``w.mu``.
        demonstration: What was seen of the policy itself, or None.

    Raises:
        InvalidInputError: If there are fewer than 2 trajectories, or their features have different
            or wrong shapes or are not finite; the message names the trajectory.
    """
    if discount is not None and not 0.0 < discount <= 1.0:
        raise InvalidInputError(f"the discount must lie in (0, 1], got {discount}")
    trajectories = list(trajectories)
    if len(trajectories) < 2:
        raise InvalidInputError(
            f"need at least 2 trajectories to know how far their mean may be off, got "
            f"{len(trajectories)}; an expert that is known exactly is Expert(mu, error=0 * mu)"
        )
    sums = [_summed(features(t), discount, i) for i, t in enumerate(trajectories)]
    for i, total in enumerate(sums):
        if total.shape != sums[0].shape:
            raise InvalidInputError(
                f"trajectory {i} has {len(total)} features, trajectory 0 has {len(sums[0])}"
            )
    return expert_from_returns(
        np.array(sums),
        bound=bound,
        confidence=confidence,
        ranges=ranges,
        suboptimality=suboptimality,
        demonstration=demonstration,
    )


def _summed(features: Any, discount: float | None, index: int) -> Array:
    """Sum of a trajectory's features, (T, K) or (K,) -> (K,)."""
    name = f"the features of trajectory {index}"
    try:
        phi = np.asarray(features, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(
            f"{name} must be numbers of shape (T, K) or (K,): {error}"
        ) from None
    if phi.ndim not in (1, 2) or phi.size == 0:
        raise InvalidInputError(f"{name} must have shape (T, K) or (K,), got {phi.shape}")
    if not np.isfinite(phi).all():
        raise InvalidInputError(f"{name} must be finite")
    if phi.ndim == 1:
        if discount is not None:
            raise InvalidInputError(
                f"{name} have shape {phi.shape}: sums already; a discount needs those of each step"
            )
        return phi
    weights = np.ones(len(phi)) if discount is None else discount ** np.arange(len(phi))
    total: Array = weights @ phi
    return total


def paired_half_widths(learner: Array, expert: Array, *, confidence: float = 0.95) -> Array:
    """Half-widths of mu - mu_E from trajectories with common random numbers, shape (K,).

    Evaluating both on the same initial states cancels what they share.

    Args:
        learner: Features from the same initial states as the expert's, shape (m, K).
        expert: Shape (m, K).
        confidence: Probability that all half-widths hold.
    """
    learner, expert = _returns(learner), _returns(expert)
    if learner.shape != expert.shape:
        raise InvalidInputError(f"paired features differ in shape: {learner.shape}, {expert.shape}")
    return half_widths(learner - expert, confidence=confidence)


def suboptimality_from_restarts(w: Array, mu: Array, restarts: Sequence[Response]) -> float:
    """eps_E: by how much a policy may beat the one with ``mu``, from further solves at ``w``.

    The best restart's advantage, plus three standard deviations of all restarts: the best one need
    not be optimal either, and is the farther from it the more independent errors a solve makes.
    With ten restarts this covers the gap where there are up to about eight of them, and in 8 of 10
    cases where there are fifteen. For a synthetic expert pass its own weights; blind, an estimate.

    Args:
        w: Weights, shape (K,).
        mu: Features of the expert's policy, shape (K,).
        restarts: Answers for ``w`` from other starts, at least 2.

    Raises:
        InvalidInputError: If there are fewer than 2 restarts.
    """
    if len(restarts) < 2:
        raise InvalidInputError(f"need at least 2 restarts, got {len(restarts)}")
    values = np.array([float(w @ r.mu) for r in restarts])
    return max(0.0, float(values.max()) - float(w @ mu)) + 3.0 * float(values.std(ddof=1))


def check_expert(expert: Expert) -> None:
    """What an algorithm asks of an expert before it starts.

    Raises:
        InvalidInputError: If the features or their error bars are not finite, of one shape and
            non-negative, or contradict the covariance.
    """
    mu, error = np.asarray(expert.mu), np.asarray(expert.error)
    is_shaped = mu.ndim == 1 and len(mu) > 0 and error.shape == mu.shape
    if not is_shaped or not np.isfinite(np.r_[mu, error]).all():
        raise InvalidInputError(
            f"the expert needs finite mu and error of one shape (K,), got {mu.shape}, {error.shape}"
        )
    if error.min() < 0.0 or not 0.0 <= expert.suboptimality < np.inf:
        raise InvalidInputError("the expert's error and suboptimality must not be negative")
    if expert.covariance is not None:
        _check_covariance(np.asarray(expert.covariance), error)


def _check_covariance(C: Array, error: Array) -> None:
    K = len(error)
    if C.shape != (K, K) or not np.isfinite(C).all():
        raise InvalidInputError(f"the expert's covariance needs finite shape ({K}, {K})")
    size = max(float(np.abs(C).max()), 1e-300)
    if np.abs(C - C.T).max() > 1e-9 * size or np.linalg.eigvalsh(C)[0] < -1e-9 * size:
        raise InvalidInputError("the expert's covariance must be symmetric without negative values")
    if np.any(error < (1.0 - 1e-9) * np.sqrt(np.maximum(np.diag(C), 0.0))):
        raise InvalidInputError(
            "the expert's error bars are narrower than one standard error of its covariance; give "
            "half-widths of a confidence interval, or no covariance for an exact expert"
        )


def _returns(returns: Array) -> Array:
    returns = np.asarray(returns, dtype=np.float64)
    if returns.ndim != 2 or len(returns) < 2 or not np.isfinite(returns).all():
        raise InvalidInputError(
            f"features must be finite with shape (m >= 2, K), got {returns.shape}"
        )
    return returns
