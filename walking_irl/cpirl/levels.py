"""Levels: how much regret the weights that explain an expert may have, by mode.

A policy with the difference d cuts (d - level).w <= 0 away. The level is 0 for an optimal expert
(Algorithm 2), a tolerance for a set of weights (Theorem A3), and falls with the best regret found
for an expert that need not be optimal (level cutting planes, in place of Algorithm 3).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.bundle import Bundle
from walking_irl.errors import InvalidInputError
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.types import MODES, Mode

_BIAS_MARGIN = 1.25
"""Share of the best regret that a noisy expert's bias may explain."""


class Levels(Protocol):
    """What a mode says of the regret."""

    @property
    def has_known_minimum(self) -> bool:
        """Whether min f is 0, as of an optimal expert."""
        ...

    @property
    def is_set(self) -> bool:
        """Whether the level is a tolerance, whose set of weights has bounds that can be reached."""
        ...

    def explaining(self, bundle: Bundle) -> Array:
        """Level of the weights that explain the expert, shape (K,)."""
        ...

    def probed(self, bundle: Bundle, level: float, w: Array) -> Array:
        """Level that cuts the intervals {f <= level} out, shape (K,).

        Cuts grant the expert its sub-optimality; here ``level``, in units of w.mu at the weights
        ``w``, says it all.
        """
        ...

    def polyhedron(self, bundle: Bundle) -> WeightPolyhedron:
        """Weights among which the next query is sought."""
        ...

    def lower_bound(self, bundle: Bundle) -> float:
        """Lower bound on min f, relative to the expert's largest feature."""
        ...


@dataclass(frozen=True)
class Optimal:
    """Regret 0, or what noise may have made the expert look worse than it is."""

    has_known_minimum = True
    is_set = False

    def explaining(self, bundle: Bundle) -> Array:
        """See :class:`Levels`."""
        if bundle.is_exact or not bundle.responses:
            return np.zeros(bundle.K)
        return np.full(bundle.K, _BIAS_MARGIN * max(bundle.least_robust_regret, 0.0))

    def probed(self, bundle: Bundle, level: float, w: Array) -> Array:
        """See :class:`Levels`."""
        own = np.full(bundle.K, level - bundle.expert.suboptimality)
        return own if bundle.is_exact else np.maximum(self.explaining(bundle), own)

    def polyhedron(self, bundle: Bundle) -> WeightPolyhedron:
        """See :class:`Levels`."""
        return bundle.polyhedron(self.explaining(bundle))

    def lower_bound(self, bundle: Bundle) -> float:
        """See :class:`Levels`."""
        return 0.0


@dataclass(frozen=True)
class Tolerance(Optimal):
    """Regret of at most ``tol`` |w.mu_E|."""

    tol: float
    is_set = True

    def explaining(self, bundle: Bundle) -> Array:
        """See :class:`Levels`."""
        level: Array = self.tol * bundle.units
        return level

    def probed(self, bundle: Bundle, level: float, w: Array) -> Array:
        """See :class:`Levels`; relative to each weight's own return, as the tolerance is."""
        relative = level / max(float(w @ np.abs(bundle.mu)), 1e-300)
        own = relative * np.abs(bundle.mu) - bundle.expert.suboptimality
        return np.asarray(np.maximum(self.explaining(bundle), own))


@dataclass(frozen=True)
class LeastRegret:
    """The best regret found so far."""

    has_known_minimum = False
    is_set = False

    def explaining(self, bundle: Bundle) -> Array:
        """See :class:`Levels`."""
        best = max(bundle.least_robust_regret, 0.0) if bundle.responses else 0.0
        return np.full(bundle.K, best)

    def probed(self, bundle: Bundle, level: float, w: Array) -> Array:
        """See :class:`Levels`."""
        own = level - bundle.expert.suboptimality
        if bundle.is_exact:
            return np.full(bundle.K, own)
        return self.explaining(bundle) + max(own, 0.0)

    def polyhedron(self, bundle: Bundle) -> WeightPolyhedron:
        """Weights that may still lower the regret, be it below 0, as noisy features allow.

        The expert's own gap is no reason to ask anywhere else.
        """
        if not bundle.responses:
            return bundle.polyhedron(np.zeros(bundle.K))
        level = bundle.least_robust_regret - bundle.expert.suboptimality
        return bundle.polyhedron(np.full(bundle.K, level))

    def lower_bound(self, bundle: Bundle) -> float:
        """See :class:`Levels`."""
        return -bundle.bounded_game.value / bundle.unit


def levels_of(mode: Mode, tol: float) -> Levels:
    """Levels of a mode; ``tol`` is relative to |w.mu_E|.

    Raises:
        InvalidInputError: If there is no such mode.
    """
    if mode not in MODES:
        raise InvalidInputError(f"unknown mode {mode!r}; choose from {', '.join(MODES)}")
    all_levels: dict[Mode, Levels] = {
        "optimal": Optimal(),
        "set": Tolerance(tol),
        "minimise": LeastRegret(),
    }
    return all_levels[mode]
