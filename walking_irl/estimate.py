r"""Noisy experts: their mean is biased, and the bias is the learner's too.

Disturbances raise quadratic costs, and a simulation differs from the optimiser's model. A learner's
gait suffers the same when it is measured the same way, so the defect

.. math:: c = \hat\mu_\text{closed loop}(\pi) - \mu(\pi)

of the best policy found is taken off the expert's mean. Near the root :math:`\mu(w) = \mu_E - c` an
error e of the mean moves the weights by :math:`H^{-1} e`, which gives the intervals.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import stats

from walking_irl.archive import Archive
from walking_irl.newton import Step
from walking_irl.types import Array, Expert

NEAR = 0.1
"""L1 length of a Newton step below which the best policy is measured."""
MOVED = 0.01
"""L1 distance of the best query beyond which it is measured once more."""
MEASUREMENTS = 2
SETTLED = 1e-3
SHARE_OF_ERROR = 0.5
"""A step shorter than this share of the summed standard errors changes nothing."""
STALL_RATIO = 0.7
CONFIDENCE = 0.95
WEIGHT_FLOOR = 0.002
"""Added to every half-width: solver tolerance and curvature of the defect."""


class NoiseCorrection:
    """Removes the bias of an estimated expert; counts measurements and steps.

    Args:
        expert: With covariance and number of samples.
        measure: Measures a policy as the expert was: mean (K,), covariance (K, K). Without it the
            expert's mean is taken as it is.
    """

    def __init__(
        self, expert: Expert, measure: Callable[[Any], tuple[Array, Array]] | None
    ) -> None:
        assert expert.covariance is not None
        self.mean = np.array(expert.mu, dtype=float)
        self.expert_covariance = self.covariance = np.asarray(expert.covariance)
        self.n_samples = expert.n_samples
        self.suboptimality = expert.suboptimality
        self.measure = measure
        self.measured: list[Array] = []
        self.lengths: list[float] = []

    @property
    def is_done(self) -> bool:
        """Whether the expert's mean has been corrected, or cannot be."""
        return self.measure is None or bool(self.measured)

    def update(self, archive: Archive, step: Step) -> bool:
        """Measure the best policy if it is time to; whether the expert's mean changed."""
        w = step.best.w
        has_moved = not self.measured or np.abs(w - self.measured[-1]).sum() > MOVED
        is_due = step.length < NEAR and has_moved and len(self.measured) < MEASUREMENTS
        self.lengths.append(step.length)
        if self.measure is None or not is_due:
            return False
        mean, covariance = self.measure(step.best.policy)
        self.covariance = self.expert_covariance + covariance
        archive.mu_E = self.mean - (mean - step.best.mu)
        archive.slack = self._quantile(len(mean)) * np.sqrt(np.diag(self.covariance))
        archive.slack = archive.slack + self.suboptimality
        self.measured.append(w)
        self.lengths.clear()
        return True

    def has_settled(self, step: Step) -> bool:
        """Whether further steps would only follow the noise."""
        if not self.is_done:
            return False
        if step.length <= max(SETTLED, SHARE_OF_ERROR * float(self.errors(step).sum())):
            return True
        past = self.lengths
        return len(past) >= 4 and min(past[-2:]) > STALL_RATIO * min(past[:-2])

    def errors(self, step: Step) -> Array:
        """Standard errors of the weights, shape (K,)."""
        A = step.inverse()
        return np.sqrt(np.maximum(np.diag(A @ self.covariance @ A.T), 0))

    def intervals(self, step: Step) -> Array:
        """Student intervals of the weights around a step's end, shape (K, 2)."""
        t = stats.t.ppf((1 + CONFIDENCE) / 2, self.n_samples - 1)
        half = t * self.errors(step) + WEIGHT_FLOOR
        return np.clip(np.column_stack([step.w - half, step.w + half]), 0, 1)

    def _quantile(self, k: int) -> float:
        return float(stats.t.ppf(1 - (1 - CONFIDENCE) / (2 * k), self.n_samples - 1))
