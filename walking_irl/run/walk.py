r"""What a person walks for: weights of a recorded walk that no weights make optimal, and how sure.

The search of :mod:`~walking_irl.run.joint` ends where it depends a little on where it began, so it
begins at several weights; the end of the smallest loss is told, and what the others say differently
is part of its half widths. How much better the person could walk is then bracketed as CPIRL
brackets a regret in its minimise mode.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.loop import cpirl
from walking_irl.domains.humanoid.domain import MIN_WEIGHT
from walking_irl.domains.humanoid.recorded.closeness import Walk, degrees_apart, sagittal_apart
from walking_irl.domains.humanoid.recorded.feasible import Feasible, feasible_gait
from walking_irl.domains.humanoid.spec import WalkerSpec
from walking_irl.geometry.game import game_lp
from walking_irl.run.joint import LEAST_GAP, OBSERVATIONS, Fit, Point, joint_fit
from walking_irl.run.remembered import Remembered
from walking_irl.types import Expert, Iteration
from walking_irl.workers import run_tasks

BRACKET = 0.004
"""Width to which the least regret is bracketed, relative to the cost."""
MAX_SOLVES = 20
"""Of the bracket's search."""
DEVIATIONS = 1.96
"""Standard deviations that a half width holds: 95 % of a normal distribution."""
NARROWEST = 0.02
"""Least half width that is ever told of a person's weight."""


@dataclass(frozen=True)
class Explanation:
    """What a person walks for.

    Attributes:
        fit: The end of the smallest loss.
        bracket: How much better the nearest gait could be, relative to its cost: least regret of
            any weights, lower and upper bound.
        solves: Forward solves of the bracket.
        history: Its iterations, whose polyhedra close in on the weights of least regret.
        half: Half widths of the weights, shape (K,): root of the sum of squares of the parts that
            follow; at least NARROWEST.
        allowed: What the walk and the spread of weights among walkers leave open at 95 %, and the
            open bracket adds, shape (K,).
        starts: Largest difference of the answer from another start, shape (K,).
        trials: Largest difference of a single trial's answer, shape (K,); 0 where there is one.
        others: Ends from other starts.
        apart: How far the best gait is from the recording, each joint [deg].
    """

    fit: Fit
    bracket: tuple[float, float]
    solves: int
    history: tuple[Iteration, ...]
    half: Array
    allowed: Array
    starts: Array
    trials: Array
    others: tuple[Point, ...]
    apart: dict[str, float]

    @property
    def end(self) -> Point:
        """Weights, nearest gait and best gait."""
        return self.fit.last

    @property
    def w(self) -> Array:
        """The weights, shape (K,)."""
        return self.end.w

    @property
    def intervals(self) -> Array:
        """Bounds of each weight, shape (K, 2)."""
        return np.clip(np.column_stack([self.w - self.half, self.w + self.half]), 0.0, 1.0)

    @property
    def sagittal(self) -> float:
        """Distance of the best gait from the recording at hips, knees and ankles [deg]."""
        return sagittal_apart(self.apart)


def starting_weights(reference: Array) -> Array:
    """Weights that searches start from, far apart: reference, even, and a third, shape (3, K)."""
    K = len(reference)
    third = reference * np.exp(np.where(np.arange(K) % 2 == 0, 0.5, -0.5))
    return np.array([reference, np.full(K, 1.0 / K), third / third.sum()])


def nearest(spec: WalkerSpec, walk: Walk, executor: Executor | None = None) -> Feasible:
    """The nearest gait under the reference weights."""
    return feasible_gait(spec, walk, spec.stack.reference_weights, executor=executor)


def explain(
    spec: WalkerSpec,
    walk: Walk,
    near: Feasible,
    *,
    trials: Sequence[Walk] = (),
    starts: Array | None = None,
    executor: Executor | None = None,
) -> Explanation:
    """Weights of a walk with half widths.

    Args:
        spec: Which body, and its costs.
        walk: The recorded walk, the mean of all trials.
        near: Its nearest gait under the reference weights.
        trials: Each trial, where there are several.
        starts: Starting weights, shape (n, K); None: :func:`starting_weights`.
        executor: Searches from starts and for trials side by side.

    Raises:
        SolverError: If no gait is found for some weights.
    """
    starts = starting_weights(spec.stack.reference_weights) if starts is None else starts
    found: list[Fit] = run_tasks(
        joint_fit, [(spec, walk, w, near, near.total_costs) for w in starts], executor
    )
    fit = min(found, key=lambda f: f.last.loss)
    end = fit.last
    at_trials = [(spec, t, end.w, end.near, near.total_costs) for t in trials]
    single: list[Fit] = run_tasks(joint_fit, at_trials, executor)
    bracket, solves, history = bracketed(spec, fit)
    others = tuple(f.last for f in found if f is not fit)
    by_start = _farthest(end.w, [p.w for p in others])
    by_trial = _farthest(end.w, [f.last.w for f in single])
    allowed = half_widths(fit, bracket[1] - bracket[0])
    half = np.sqrt(allowed**2 + by_start**2 + by_trial**2)
    return Explanation(
        fit=fit,
        bracket=bracket,
        solves=solves,
        history=history,
        half=np.maximum(half, NARROWEST),
        allowed=allowed,
        starts=by_start,
        trials=by_trial,
        others=others,
        apart=degrees_apart(spec.walker, end.gait, walk.shown),
    )


def half_widths(fit: Fit, open_bracket: float = 0.0) -> Array:
    """Half widths of a fit alone, shape (K,).

    Args:
        fit: Where the search came to rest.
        open_bracket: Width of the gap's bracket, by which it may be too large.
    """
    more = OBSERVATIONS * open_bracket / (fit.last.gap + LEAST_GAP)
    return np.asarray(np.sqrt((DEVIATIONS**2 + more) * np.diag(fit.covariance)))


def _farthest(w: Array, others: Sequence[Array]) -> Array:
    """Largest difference of each weight, shape (K,)."""
    return np.asarray(np.abs(np.array([w, *others]) - w).max(axis=0))


class Bracketed(NamedTuple):
    """How much better a gait could be."""

    bounds: tuple[float, float]
    """Of its least regret, relative to its cost."""
    solves: int
    history: tuple[Iteration, ...]


def bracketed(spec: WalkerSpec, fit: Fit) -> Bracketed:
    """Least regret of the nearest gait, relative to its cost.

    Args:
        spec: Which body, and its costs.
        fit: Where the search came to rest.
    """
    end = fit.last
    forward = Remembered(end.near.gait, spec, fit.answers)
    mu = -end.near.total_costs
    history = list(
        cpirl(
            forward,
            Expert(mu, np.zeros(len(mu)), demonstration=end.near.gait),
            mode="minimise",
            bracket=BRACKET,
            max_solves=MAX_SOLVES,
            min_weight=MIN_WEIGHT,
            rng=np.random.default_rng(0),
        )
    )
    policies = forward.policies()
    asked = np.array([end.w, *(it.w for it in history)])
    upper = float(((asked @ policies.T).max(axis=1) - asked @ mu).min())
    lower = -float(game_lp(policies - mu, MIN_WEIGHT).value)
    upper = max(upper, 0.0)
    bounds = (min(max(lower, 0.0), upper) / end.cost, upper / end.cost)
    return Bracketed(bounds, forward.solves, tuple(history))
