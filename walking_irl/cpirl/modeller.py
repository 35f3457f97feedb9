"""Quadratic model of the regret near its minimum: the best query's sensitivity, and secants."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.bundle import Archive
from walking_irl.cpirl.newton import Step, newton_step, reduced, with_secants


class Model(NamedTuple):
    """Quadratic model of the regret around the best query."""

    best: int
    """Index of that query."""
    B: Array
    """Hessian in the plane of the weights, shape (K-1, K-1)."""
    step: Step
    """To its minimum."""


class Modeller:
    """Fits models to an archive; remembers the last sensitivity that could be trusted.

    Args:
        archive: What is known; at least one response has a sensitivity when a model is fitted.
        min_distance: Secants between closer queries say more about noise than about curvature.
    """

    def __init__(self, archive: Archive, min_distance: float) -> None:
        self.archive, self.min_distance = archive, min_distance
        self._prior: Array | None = None

    def fit(self, regrets: Array) -> Model:
        """Model around the query that is predicted to be nearest to the minimum.

        Args:
            regrets: Of each query, relative, shape (n,).
        """
        archive = self.archive
        W, M = archive.W, archive.M
        best = int(np.argmin(regrets))
        usable = ~archive.is_match()
        if not usable.any():
            usable[:] = True
        for _ in range(2):
            B = self._hessian(W, M, best)
            steps = [
                newton_step(w, mu - archive.mu, B, archive.min_weight)
                for w, mu in zip(W, M, strict=True)
            ]
            best = int(np.argmin(np.where(usable, [s.decrease for s in steps], np.inf)))
        B = self._hessian(W, M, best)
        return Model(best, B, newton_step(W[best], M[best] - archive.mu, B, archive.min_weight))

    def _hessian(self, W: Array, M: Array, best: int) -> Array:
        """Sensitivity at the best query, else the last one that could be trusted; with secants."""
        responses = self.archive.responses
        sensitivity = responses[best].sensitivity
        if sensitivity is None and self._prior is None:
            sensitivity = [r.sensitivity for r in responses if r.sensitivity is not None][-1]
        if sensitivity is not None:
            self._prior = reduced(sensitivity)
        assert self._prior is not None, "some query has a sensitivity"
        return with_secants(self._prior, W, M, best, self.min_distance)
