"""Newton's method on the regret, near the end: one way for an exact expert, one for an estimated.

Both fit the regret's quadratic model, step to its minimum, and give up where their steps do not
gain what they promise; then a centre is asked instead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.bundle import Bundle
from walking_irl.cpirl.levels import Levels
from walking_irl.cpirl.outlook import Outlook, Progress, Query
from walking_irl.cpirl.regret_model import RegretModel, standard_errors
from walking_irl.types import Rule

Measure = Callable[[Any], tuple[Array, Array]]
"""Maps a policy to the mean (K,) and covariance (K, K) of its measured features."""

_NEWTON_GAP = 0.02
"""Newton's method takes over once the best regret is within this of optimal, relative."""
_SLACK = 2e-4
"""By how much, relative to |w.mu_E|, a Newton query may miss a cut."""
_CLEARLY_WORSE = 2e-4
"""Relative rise of the regret that noise does not explain."""
_LONGEST_STEP = 0.3
"""Longest Newton step (L1) where min f is not known to be 0."""
MOST_POOR = 2
"""Poor Newton queries in a row after which a centre is asked."""
_MEASURE_WITHIN, _MEASURE_AGAIN, _MOST_MEASUREMENTS = 0.1, 0.01, 2
"""A learner's policy is measured once the step is below the first (L1), again if it moves."""


class NewtonPhase(Protocol):
    """What the loop asks of Newton's method."""

    def fit(self, bundle: Bundle) -> RegretModel | None:
        """Model of the regret, or None while its minimum is not near."""
        ...

    def advance(self, outlook: Outlook) -> Outlook:
        """The outlook with what came of the newest query; it has a model."""
        ...

    def query(self, outlook: Outlook) -> Query | None:
        """The next query, or None where a centre must be tried instead."""
        ...

    def estimate(self, outlook: Outlook) -> Array:
        """Minimum of the model where the policies found do not speak against it, or best query."""
        ...


class ExactNewton:
    """For features that are no sample mean: every cut holds, and min f may be known."""

    min_distance = 1e-7

    def __init__(self, levels: Levels) -> None:
        self.levels = levels
        self._prior: Array | None = None
        self._n_poor, self._best_before = 0, np.inf

    def fit(self, bundle: Bundle) -> RegretModel | None:
        """See :class:`NewtonPhase`."""
        if not (_has_sensitivity(bundle) and _is_near(bundle, self.levels)):
            return None
        model = RegretModel.fit(bundle, self.min_distance, self._prior)
        self._prior = model.prior
        return model

    def advance(self, outlook: Outlook) -> Outlook:
        """Count a step that left more than nine tenths of the best regret as poor."""
        assert outlook.model is not None
        f = outlook.bundle.relative_regrets
        if outlook.rule is Rule.NEWTON:
            is_poor = float(f[-1]) > 0.9 * self._best_before
            self._n_poor = self._n_poor + 1 if is_poor else 0
        self._best_before = float(f.min())
        target = self._target(outlook, outlook.model)
        progress = Progress(
            target,
            length=float(np.abs(target - outlook.bundle.W[outlook.model.best]).sum()),
            n_poor=self._n_poor,
            gap=self._best_before - self.levels.lower_bound(outlook.bundle),
        )
        return replace(outlook, progress=progress)

    def query(self, outlook: Outlook) -> Query | None:
        """See :class:`NewtonPhase`."""
        if outlook.model is None or outlook.progress is None:
            return None
        bundle, v = outlook.bundle, outlook.progress.target
        if self._n_poor >= MOST_POOR or bundle.is_match[outlook.model.best]:
            self._n_poor = 0
            return None
        cuts = bundle.rows(self.levels.explaining(bundle))
        if float((cuts @ v).max()) > _SLACK * float(bundle.scale(v)):
            return None
        return Query(v, Rule.NEWTON, self.levels.polyhedron(bundle))

    def estimate(self, outlook: Outlook) -> Array:
        """See :class:`NewtonPhase`."""
        if outlook.model is None:
            return _best_query(outlook.bundle)
        return _plausible(outlook.bundle, self._target(outlook, outlook.model), _SLACK)

    def _target(self, outlook: Outlook, model: RegretModel) -> Array:
        """Shorten a step that promises more than f, whose minimum is known to be 0."""
        bundle = outlook.bundle
        w: Array = bundle.W[model.best]
        move = model.step.w - w
        if self.levels.has_known_minimum:
            unit = float(bundle.scale(w))
            regret = float(bundle.relative_regrets[model.best] * bundle.scale(w))
            ratio = model.step.decrease / max(regret, 1e-12 * unit)
            return w + move / ratio if ratio > 3.0 else model.step.w
        return w + move * _share(float(np.abs(move).sum()))


class EstimatedNewton:
    """For features that are a sample mean: f may pass below 0, cuts say less, noise ends it.

    Args:
        levels: What the mode says of the regret.
        measure: Measures a policy as the expert was measured; the difference to its ``mu``, the
            solver's own defect, corrects the expert.
    """

    min_distance = 3e-3

    def __init__(self, levels: Levels, measure: Measure | None) -> None:
        self.levels, self.measure = levels, measure
        self._prior: Array | None = None
        self._is_near, self._n_poor = False, 0
        self._measured: list[Array] = []
        self._lengths: list[float] = []

    def fit(self, bundle: Bundle) -> RegretModel | None:
        """See :class:`NewtonPhase`; once near, for good."""
        if not _has_sensitivity(bundle):
            return None
        self._is_near = (
            self._is_near
            or bundle.least_robust_regret <= 0.0
            or _above_unexplained(bundle) <= _NEWTON_GAP
        )
        if not self._is_near:
            return None
        model = RegretModel.fit(bundle, self.min_distance, self._prior)
        self._prior = model.prior
        return model

    def advance(self, outlook: Outlook) -> Outlook:
        """Measure the solver's defect where it is time; count a step that made f worse as poor."""
        n_measured = len(self._measured)
        bundle, model = self._corrected(outlook)
        assert bundle.covariance is not None
        length = float(np.abs(model.step.w - bundle.W[model.best]).sum())
        self._lengths.append(length)
        f, lengths = bundle.relative_regrets, self._lengths
        is_poor = outlook.rule is Rule.NEWTON and float(f[-1] - f[:-1].min()) > _CLEARLY_WORSE
        self._n_poor = self._n_poor + 1 if is_poor else 0
        progress = Progress(
            model.step.w,
            length,
            self._n_poor,
            noise=0.5 * float(standard_errors(model.B, bundle.covariance).sum()),
            is_measured=self.measure is None or bool(self._measured),
            has_stalled=(
                len(lengths) >= 4
                and len(self._measured) == n_measured
                and min(lengths[-2:]) > 0.7 * min(lengths[:-2])
            ),
        )
        return replace(outlook, bundle=bundle, model=model, progress=progress)

    def query(self, outlook: Outlook) -> Query | None:
        """See :class:`NewtonPhase`; after a poor step half as far."""
        if outlook.model is None or outlook.progress is None:
            return None
        if self._n_poor >= MOST_POOR:
            self._n_poor = 0
            return None
        bundle, progress = outlook.bundle, outlook.progress
        w = bundle.W[outlook.model.best]
        v = w + (progress.target - w) * (_share(progress.length) * 0.5**self._n_poor)
        if np.abs(bundle.W - v).sum(axis=1).min() <= 1e-9:  # asked before: learn elsewhere
            return None
        return Query(v, Rule.NEWTON, self.levels.polyhedron(bundle))

    def estimate(self, outlook: Outlook) -> Array:
        """See :class:`NewtonPhase`."""
        if outlook.model is None:
            return _best_query(outlook.bundle)
        return _plausible(outlook.bundle, outlook.model.step.w, _NEWTON_GAP)

    def _corrected(self, outlook: Outlook) -> tuple[Bundle, RegretModel]:
        """Measure the best policy as the expert was measured, and correct the expert by it."""
        bundle, model = outlook.bundle, outlook.model
        assert model is not None
        w = bundle.W[model.best]
        is_far = np.abs(model.step.w - w).sum() >= _MEASURE_WITHIN
        if self.measure is None or is_far or len(self._measured) >= _MOST_MEASUREMENTS:
            return bundle, model
        if self._measured and np.abs(w - self._measured[-1]).sum() <= _MEASURE_AGAIN:
            return bundle, model
        response = bundle.responses[model.best]
        mean, covariance = self.measure(response.policy)
        self._measured.append(w)
        bundle = bundle.corrected(mean - response.mu, covariance)
        model = RegretModel.fit(bundle, self.min_distance, self._prior)
        self._prior = model.prior
        return bundle, model


def _has_sensitivity(bundle: Bundle) -> bool:
    return any(r.sensitivity is not None for r in bundle.responses)


def _is_near(bundle: Bundle, levels: Levels) -> bool:
    return float(bundle.relative_regrets.min()) - levels.lower_bound(bundle) <= _NEWTON_GAP


def _above_unexplained(bundle: Bundle) -> float:
    """Best regret above what no weights explain, relative to |w.mu_E| there.

    How perturbations are paid for is such a defect: it is in min f, too.
    """
    best = int(np.argmin(bundle.relative_regrets))
    unexplained = max(-bundle.nominal_game.value, 0.0) / float(bundle.scale(bundle.W[best]))
    return float(bundle.relative_regrets[best]) - unexplained


def _share(length: float) -> float:
    """Of a step of this length (L1), such that it is not too long."""
    return min(1.0, _LONGEST_STEP / max(length, 1e-300))


def _best_query(bundle: Bundle) -> Array:
    best: Array = bundle.W[int(np.argmin(bundle.relative_regrets))]
    return best


def _plausible(bundle: Bundle, v: Array, slack: float) -> Array:
    """``v`` unless its regret exceeds that of the best query by more than the slack, relative."""
    allowed = max(float(bundle.relative_regrets.min()), 0.0) + slack
    is_plausible = bundle.regrets(v[None])[0] <= allowed * bundle.scale(v)
    return v if is_plausible else _best_query(bundle)
