"""Natural policy gradients (S. Kakade 2002), and ascent along any estimate of the gradient."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.rl.episodes import Episodes
from walking_irl.rl.gpomdp import gpomdp


class Ascent(NamedTuple):
    """The path of a policy search."""

    theta: Array
    """Mean of the last quarter of the path, shape (P,): it averages the noise of the steps."""
    path: Array
    """Parameters before the first and after every step, shape (n_iter + 1, P)."""


def fisher(episodes: Episodes, discount: float) -> Array:
    """Fisher matrix of the policy under discounted visits: E sum_t gamma^t score score', (P, P)."""
    g = discount ** np.arange(episodes.scores.shape[1])
    F: Array = np.einsum("t,ntp,ntq->pq", g, episodes.scores, episodes.scores, optimize=True)
    return F / len(episodes.scores)


def natural_gradient(gradient: Array, F: Array, *, ridge: float = 0.0) -> Array:
    """F^-1 times the gradient (P,) or (P, K): the same step whatever the parameters' coordinates.

    Args:
        gradient: Plain gradient, of all features or of one reward.
        F: Fisher matrix, shape (P, P).
        ridge: Added to F, relative to its mean diagonal; > 0 where F is singular (softmax).
    """
    level = ridge * float(np.trace(F)) / len(F)
    return np.asarray(np.linalg.solve(F + level * np.eye(len(F)), gradient))


def ascend(
    theta: Array,
    w: Array,
    episodes: Callable[[Array], Episodes],
    *,
    discount: float,
    estimate: Callable[[Episodes, float], Array] = gpomdp,
    is_natural: bool = True,
    ridge: float = 0.0,
    step: float = 0.1,
    n_iter: int = 60,
) -> Ascent:
    """Climb w.mu(theta) in normalised steps whose length falls as ``step`` / sqrt(1 + i).

    Args:
        theta: First parameters, shape (P,).
        w: Weights of the features, shape (K,).
        episodes: Samples episodes under given parameters; it owns its random numbers.
        discount: gamma.
        estimate: Of d mu / d theta, :func:`gpomdp` or :func:`reinforce`.
        is_natural: Whether steps are natural.
        ridge: See :func:`natural_gradient`.
        step: Length of the first step.
        n_iter: Steps.
    """
    if n_iter < 1 or not step > 0:
        raise InvalidInputError(f"expected steps of positive length, got {n_iter} of {step}")
    path = [np.asarray(theta, dtype=float)]
    for i in range(n_iter):
        batch = episodes(path[-1])
        direction = estimate(batch, discount) @ w
        if is_natural:
            direction = natural_gradient(direction, fisher(batch, discount), ridge=ridge)
        size = max(float(np.linalg.norm(direction)), 1e-300)
        path.append(path[-1] + step / np.sqrt(1 + i) * direction / size)
    last = max(1, n_iter // 4)
    return Ascent(np.mean(path[-last:], axis=0), np.array(path))
