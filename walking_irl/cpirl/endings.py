"""Why a run of CPIRL ends: every ending is a rule, a small object or function that looks and says.

They look at its :class:`~walking_irl.cpirl.outlook.Outlook`, in three groups: on the regret as soon
as there is an answer, on Newton's progress, and where no rule has a next query. Whatever ended it,
the bracket of min f says what that means. Rules that a user adds: :mod:`.stops`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.certainty import bracket_of
from walking_irl.cpirl.gauge import gauge_fixed
from walking_irl.cpirl.levels import Levels
from walking_irl.cpirl.newton_phase import MOST_POOR
from walking_irl.cpirl.outlook import Decision, Ending, Outlook
from walking_irl.errors import FlatPolyhedronError
from walking_irl.types import Status

EndRule = Callable[[Outlook], Ending | None]

_FLOOR = 2e-5
"""Relative regret below which poor Newton steps mean the demonstration's own gap is reached."""
_EXACT_STEP, _ESTIMATED_STEP = 2e-4, 1e-3
"""Newton step (L1) that counts as none."""
_BEATEN = -1e-8
"""Certificate, relative to the expert's features, that proves that a mixture beats it."""
_NEARLY = 1e-3
"""Least relative regret of an expert whose weights are sought although a policy dominates it."""
_CLOSED = 3.0
"""Ratio of the ends of min f's bracket, the lower above 0, below which there is little to learn:
half widths, which follow its root, would become narrower by sqrt(3) at most."""


class Endings(NamedTuple):
    """The rules of a run, in the order in which they are asked."""

    regret: tuple[EndRule, ...]
    newton: tuple[EndRule, ...]
    dead_end: tuple[EndRule, ...]


def endings_of(levels: Levels, is_exact: bool, tol: float, bracket: float | None = None) -> Endings:
    """The rules for a mode and a kind of expert; ``tol`` is the regret that counts as none."""
    least: tuple[EndRule, ...] = (Dominated(tol), GapCloses(tol))
    if bracket is not None:
        least = (BracketNarrow(bracket),)
    return Endings(
        regret=(Matched(tol),) if levels.has_known_minimum else least,
        newton=(
            (gains_nothing, StepsEnd(_EXACT_STEP), MatchIsBest(_EXACT_STEP))
            if is_exact
            else (NoiseExplains(_ESTIMATED_STEP),)
        ),
        dead_end=(repeats_itself, is_flat, is_empty),
    )


def ending(rules: Sequence[EndRule], outlook: Outlook) -> Ending | None:
    """What the first rule says that has something to say."""
    found = (rule(outlook) for rule in rules)
    return next((end for end in found if end is not None), None)


# On the regret.


@dataclass(frozen=True)
class Matched:
    """The newest weights explain the expert: f(w) <= tol |w.mu_E|."""

    tol: float

    def __call__(self, outlook: Outlook) -> Ending | None:
        """See :class:`Endings`; with a model, the minimum is sought more closely than that."""
        bundle = outlook.bundle
        w: Array | None = bundle.W[-1]
        if bundle.has_gauge and not bundle.is_match[-1]:
            w = gauge_fixed(bundle.W[-1])
        if w is None:  # uniform weights explain every expert
            return None
        corner = bundle.mu
        if outlook.model is None:
            corner = bundle.mu + (bundle.error + bundle.expert.suboptimality)
        elif not bundle.is_exact or bundle.is_match[-1]:
            return None
        f = float(bundle.values(w) - w @ corner)
        return Ending(Status.MATCHED) if f <= self.tol * float(bundle.scale(w)) else None


@dataclass(frozen=True)
class Dominated:
    """One policy that was queried is at least as good in every feature, and better in one.

    Near the minimum of the regret of a nearly optimal expert that is no answer: there the best
    policy dominates it by as little as it is sub-optimal, and its weights are sought further.
    """

    tol: float

    def __call__(self, outlook: Outlook) -> Ending | None:
        """See :class:`Endings`; of the policies only evaluated none is kept."""
        bundle = outlook.bundle
        if outlook.model is not None and bundle.relative_regrets.min() <= _NEARLY:
            return None
        d = bundle.differences[: len(bundle.responses)]
        is_above = (d >= 0.0).all(axis=1) & (d.max(axis=1) > self.tol * bundle.unit)
        return Ending(Status.DOMINATED) if is_above.any() else None


@dataclass(frozen=True)
class GapCloses:
    """The best regret and its lower bound meet; below 0, if a mixture beats the expert."""

    tol: float

    def __call__(self, outlook: Outlook) -> Ending | None:
        """See :class:`Endings`."""
        bundle = outlook.bundle
        if outlook.model is not None and bundle.is_exact:  # Newton's steps come closer
            return None
        t = bundle.game.value
        has_mixture = t < -self.tol * bundle.unit
        # Near the minimum features err by the gap's square root: for one policy to beat the expert
        # as the mixture does, the gap must close relative to its advantage.
        unit = -t if has_mixture and bundle.is_exact else bundle.unit
        if bundle.least_robust_regret + bundle.bounded_game.value > self.tol * unit:
            return None
        return Ending(Status.MIXTURE_DOMINATES if has_mixture else Status.GAP_CLOSED)


@dataclass(frozen=True)
class BracketNarrow:
    """The best regret and its lower bound are near, whatever dominates the expert."""

    width: float
    """Relative to |w.mu_E| of the best query."""

    def __call__(self, outlook: Outlook) -> Ending | None:
        """See :class:`Endings`."""
        bundle = outlook.bundle
        w = bundle.W[int(np.argmin(bundle.robust_regrets(bundle.W)))]
        left = bundle.least_robust_regret + bundle.bounded_game.value
        return Ending(Status.GAP_CLOSED, w) if left <= self.width * bundle.scale(w) else None


# On Newton's progress.


def gains_nothing(outlook: Outlook) -> Ending | None:
    """Poor steps where the regret is as low as the demonstration's own gap may be."""
    progress = outlook.progress
    assert progress is not None
    is_low = progress.gap <= _FLOOR
    if not is_low and progress.n_poor >= MOST_POOR:
        is_low = bracket_of(outlook.bundle, progress.target).is_closed(_CLOSED)
    is_over = progress.n_poor >= MOST_POOR and is_low
    return Ending(Status.CONVERGED) if is_over else None


@dataclass(frozen=True)
class StepsEnd:
    """The step from the best query is none; a query that found the demonstration does not count."""

    step: float

    def __call__(self, outlook: Outlook) -> Ending | None:
        """See :class:`Endings`."""
        model, progress = outlook.model, outlook.progress
        assert model is not None and progress is not None
        is_over = progress.length <= self.step and not outlook.bundle.is_match[model.best]
        return Ending(Status.CONVERGED) if is_over else None


@dataclass(frozen=True)
class MatchIsBest:
    """Nothing beats the demonstration where the step leads."""

    step: float

    def __call__(self, outlook: Outlook) -> Ending | None:
        """See :class:`Endings`."""
        bundle, progress = outlook.bundle, outlook.progress
        assert progress is not None
        is_asked = np.abs(bundle.W - progress.target).sum(axis=1) <= self.step
        is_over = bool((is_asked & bundle.is_match).any())
        return Ending(Status.CONVERGED, progress.target) if is_over else None


@dataclass(frozen=True)
class NoiseExplains:
    """The step is no longer than noise explains, or steps no longer become shorter."""

    step: float

    def __call__(self, outlook: Outlook) -> Ending | None:
        """See :class:`Endings`; never before the solver's own defect is measured."""
        progress = outlook.progress
        assert progress is not None
        is_short = progress.length <= max(self.step, progress.noise)
        is_over = progress.is_measured and (is_short or progress.has_stalled)
        return Ending(Status.CONVERGED) if is_over else None


# Where no rule has a next query.


def repeats_itself(outlook: Outlook) -> Ending | None:
    """The centre was asked before, and nudges did not help."""
    end = outlook.dead_end
    assert end is not None
    if end.error is not None:
        return None
    is_best_guess = outlook.model is None and outlook.levels.has_known_minimum
    return Ending(Status.STALLED, end.centre if is_best_guess else None)


def is_flat(outlook: Outlook) -> Ending | None:
    """All that is left is about one point, or one face."""
    end = outlook.dead_end
    assert end is not None
    if not isinstance(end.error, FlatPolyhedronError):
        return None
    w = outlook.bundle.bounded_game.w if outlook.model is None else None
    return Ending(Status.GAP_CLOSED, w)


def is_empty(outlook: Outlook) -> Ending | None:
    """No weights are left: a mixture beats the expert, or its features are off."""
    if outlook.bundle.game.value >= _BEATEN * outlook.bundle.unit:
        return Ending(Status.EMPTY)
    is_asked = not outlook.levels.has_known_minimum
    return Ending(Status.MIXTURE_DOMINATES if is_asked else Status.CONTRADICTED)


# What an ending means, by the bracket of min f.

_UNFINISHED = (Status.BUDGET, Status.STALLED, Status.EMPTY)


def told_true(decision: Decision, outlook: Outlook, tol: float) -> Decision:
    """The ending in the light of what is known of min f; a run that goes on is not asked.

    Where the bracket has closed nothing is left to ask, whatever ended the run. Modes that take
    min f to be 0 are contradicted by an exact expert whose lower bound is above what it is granted.
    Otherwise one above the tolerance says that the expert is not exactly optimal.

    Args:
        decision: What is believed.
        outlook: What is known.
        tol: Regret that counts as none, relative.
    """
    bundle, status, takes_zero = outlook.bundle, decision.status, outlook.levels.has_known_minimum
    if decision.query is not None or not (status.has_weights or status in _UNFINISHED):
        return decision
    none = tol * float(bundle.scale(decision.estimate))
    bracket = bracket_of(bundle, decision.estimate)
    if takes_zero and bundle.is_exact and bracket.lower > max(bundle.expert.suboptimality, none):
        return decision._replace(status=Status.CONTRADICTED)
    if bracket.lower > none and (status.has_weights or bracket.is_closed(_CLOSED)):
        return decision._replace(status=Status.NOT_OPTIMAL)
    return decision
