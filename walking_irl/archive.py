"""Everything that CPIRL has evaluated; each policy is a cut, whoever asked for it and why."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from walking_irl.polyhedron import WeightPolyhedron
from walking_irl.types import Array, Expert, Response

IDENTICAL = 1e-12
"""Relative difference of feature expectations below which a policy is the demonstrated one."""


class Query(NamedTuple):
    """A weight vector asked for, and the policy found for it."""

    w: Array
    policy: Any
    mu: Array
    sensitivity: Array | None


class Archive:
    """Queries, all evaluated feature expectations, and the expert that they are held against.

    Attributes:
        mu_E: The expert's feature expectations as understood so far, shape (K,).
        slack: By how much a policy may seem better than the expert, per feature: half-widths of
            ``mu_E`` plus the expert's own suboptimality, shape (K,).
        queries: In the order asked.
    """

    def __init__(self, expert: Expert, min_weight: float = 0.0) -> None:
        self.mu_E = np.array(expert.mu, dtype=float)
        self.slack = np.asarray(expert.error, dtype=float) + expert.suboptimality
        self.queries: list[Query] = []
        self._everything: list[Array] = []
        self._is_lazy: list[bool] = []
        self._simplex = WeightPolyhedron.simplex(len(self.mu_E), min_weight)

    def add(self, w: Array, response: Response) -> None:
        """Keep a response with all policies evaluated on the way."""
        self.queries.append(Query(w, response.policy, response.mu, response.sensitivity))
        passed = [mu for mu in response.evaluated if np.isfinite(mu).all()]
        self._everything += [response.mu, *passed]
        self._is_lazy += [False] + [True] * len(passed)

    @property
    def differences(self) -> Array:
        """d_i = mu_i - mu_E of every evaluated policy, shape (n, K)."""
        return np.array(self._everything).reshape(-1, len(self.mu_E)) - self.mu_E

    def polyhedron(self, level: float = 0.0) -> WeightPolyhedron:
        """Weights for which no evaluated policy beats the expert by more than slack and level."""
        if not self._everything:
            return self._simplex
        return self._simplex.cut_all(self.differences - self.slack - level, np.array(self._is_lazy))

    def regret(self, w: Array) -> float:
        """f(w) = max_i w.(mu_i - mu_E), a lower bound of V(w) - w.mu_E."""
        return float(np.max(self.differences @ w))

    def scale(self, w: Array) -> float:
        """Size of the expert's return abs(w.mu_E), to which tolerances are relative."""
        return max(abs(float(w @ self.mu_E)), 1e-12)

    def relative_regrets(self) -> Array:
        """f(w_k) / abs(w_k.mu_E) of all queries."""
        return np.array([self.regret(q.w) / self.scale(q.w) for q in self.queries])

    def is_demonstration(self, q: Query) -> bool:
        """Whether the solver found nothing but the demonstrated policy itself."""
        return bool(np.abs(q.mu - self.mu_E).max() <= IDENTICAL * np.abs(self.mu_E).max())

    def dominates(self, mu: Array) -> bool:
        """Whether ``mu`` beats the expert: no feature worse, and one better."""
        d = mu - self.mu_E
        return bool(np.all(d >= 0) and np.any(d > IDENTICAL * np.abs(self.mu_E).max()))
