"""Approximations of a value function from its values at n states."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError

ValueFunction = Callable[[Any], Array]
"""Values of N states, shape (N,)."""
Approximator = Callable[[Any, Array], ValueFunction]
"""fit(states, values): a value function from the values (n,) at n states."""


def linear(features: Callable[[Any], Array], ridge: float = 1e-8) -> Approximator:
    """V(s) = features(s).theta by least squares, theta = (F'F + ridge n I)^-1 F'y.

    Args:
        features: Maps N states to (N, p).
        ridge: Penalty on theta per sample; 0 for plain least squares.
    """

    def fit(states: Any, values: Array) -> ValueFunction:
        F = features(states)
        gram = F.T @ F + ridge * len(F) * np.eye(F.shape[1])
        theta = np.linalg.lstsq(gram, F.T @ values)[0]
        return lambda s: np.asarray(features(s) @ theta)

    return fit


def nearest_neighbours(points: Callable[[Any], Array], k: int) -> Approximator:
    """V(s) = mean value of the k nearest samples: an averager, which cannot expand differences.

    Value iteration with an averager is a contraction (G. Gordon, Stable function approximation in
    dynamic programming, 1995).

    Args:
        points: Maps N states to places (N, d), in which nearness is Euclidean.
        k: Neighbours, at least 1.

    Raises:
        InvalidInputError: If there are fewer samples than ``k``, or ``k`` is below 1.
    """
    if k < 1:
        raise InvalidInputError(f"k nearest neighbours need k >= 1, got {k}")

    def fit(states: Any, values: Array) -> ValueFunction:
        if len(values) < k:
            raise InvalidInputError(f"{k} neighbours need as many samples, got {len(values)}")
        tree = cKDTree(points(states))

        def value(s: Any) -> Array:
            _, near = tree.query(points(s), np.arange(1, k + 1))
            return np.asarray(values[near].mean(axis=1))

        return value

    return fit


def radial_basis(centres: Array, width: float) -> Callable[[Array], Array]:
    """Features exp(-|x - c|^2 / (2 width^2)) of points (N, d), and a constant: (N, n + 1)."""

    def features(x: Array) -> Array:
        d2 = ((x[:, None, :] - centres[None]) ** 2).sum(axis=-1)
        return np.asarray(np.c_[np.exp(-d2 / (2 * width**2)), np.ones(len(x))])

    return features
