"""Gauge freedom: weights that no behaviour can tell apart.

Where all features of every policy sum to one constant (regions that tile a gridworld), uniform
weights make every policy optimal, and w and a w + (1 - a)/K make the same ones optimal for every
a > 0. Such a set of weights is a cone with apex 1/K; a match is one only if it holds away from it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError

SAME = 1e-9
"""Relative size of what counts as zero."""


def has_constant_sum(D: Array) -> bool:
    """Whether the features of all policies sum to the expert's sum.

    Args:
        D: Differences mu_i - mu_E, shape (n, K). All zero, they say nothing.
    """
    size = float(np.abs(D).max(initial=0.0))
    return size > 0.0 and bool(np.abs(D.sum(axis=1)).max() <= SAME * D.shape[1] * size)


def freedom_in_words(D: Array, names: Sequence[str]) -> str | None:
    """Which changes of the weights no policy found can reveal, or None.

    Args:
        D: Differences mu_i - mu_E, shape (n, K).
        names: Of the K features.

    >>> freedom_in_words(np.array([[1.0, 0.0, 2.0]]), ["speed", "rain", "effort"])
    'every policy found has the same rain, whose weight could be any'
    """
    size = np.abs(D).max(axis=0, initial=0.0)
    if has_constant_sum(D):
        return "all features sum to a constant: adding the same to every weight changes nothing"
    same = [name for name, s in zip(names, size, strict=True) if s <= SAME * size.max()]
    if not size.any() or not same:
        return None
    return f"every policy found has the same {', '.join(same)}, whose weight could be any"


def gauge_fixed(w: Array) -> Array | None:
    """The weights of a ray from 1/K through ``w`` that touch a bound, shape (K,); None for 1/K.

    >>> gauge_fixed(np.array([0.2, 0.3, 0.5])).round(9).tolist()
    [0.0, 0.25, 0.75]
    """
    excess = w - w.min()
    total = float(excess.sum())
    return np.asarray(excess / total) if total > SAME else None


def unidentifiable(M: Array) -> Array:
    """Directions of weights along which no policy found differs from another.

    Args:
        M: Feature expectations of more than K policies, found for different weights, shape (n, K).

    Returns:
        Orthonormal directions, shape (g, K); none where the behaviour depends on every weight.

    Raises:
        InvalidInputError: If there are too few policies to tell.
    """
    n, K = M.shape
    if n <= K:
        raise InvalidInputError(f"need at least {K + 1} policies to look for a gauge, got {n}")
    _, size, directions = np.linalg.svd(M - M.mean(axis=0), full_matrices=True)
    found: Array = directions[np.r_[size, np.zeros(K - len(size))] <= SAME * size[0]]
    return found
