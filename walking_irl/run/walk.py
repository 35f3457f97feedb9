r"""What a person walks for: weights from a recorded walk that no weights make optimal.

For weights w and a pull tau towards the recording,

.. math:: \min_y [w \cdot G(y) + \tau d(y)^2] - \min_x w \cdot G(x) \ge 0

is what the recording costs more than the best gait. It is lowered in turn: the nearest gait y for
the weights (:mod:`~walking_irl.domains.humanoid.recorded.feasible`), then the weights of the least
regret of y, as CPIRL finds them in its minimise mode. Where it ends depends a little on where it
starts, so it starts from several weights, and what they disagree on is part of the answer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.loop import cpirl
from walking_irl.cpirl.regret_model import reduced
from walking_irl.domains.humanoid.domain import MIN_WEIGHT
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.recorded.closeness import degrees_apart, sagittal_apart
from walking_irl.domains.humanoid.recorded.feasible import (
    Feasible,
    feasible_gait,
)
from walking_irl.domains.humanoid.spec import WalkerSpec
from walking_irl.geometry.game import game_lp
from walking_irl.geometry.plane import plane_basis
from walking_irl.run.remembered import Remembered
from walking_irl.types import Expert
from walking_irl.workers import run_tasks

BRACKET = 0.004
"""Width to which the least regret is bracketed, relative to the cost."""
MAX_SOLVES = 20
"""Of one search for the least regret."""
ROUNDS = 3
"""Most turns of gait and weights."""
RESTS = 0.01
"""Relative fall of the gap below which it rests."""
SLACK = 0.03
"""Sub-optimality of the nearest gait, beyond the least, that half widths allow for, relative to the
cost. From walkers of known weights (``benchmarks/known_walkers.py``): 1 % would miss some."""
NARROWEST = 0.02
"""Least half width that is ever told of a person's weight."""


class Round(NamedTuple):
    """One turn: the nearest gait for the weights before, and the weights of its least regret."""

    near: Feasible
    w: Array
    """Shape (K,)."""
    bracket: tuple[float, float]
    """Of the least regret of the nearest gait, relative to its cost."""
    best: Gait
    """The best gait for the weights."""
    costs: Array
    """Its total costs, shape (K,)."""
    spread: Array
    """Covariance of weights a unit of regret allows, U H^-1 U', shape (K, K)."""
    gap: float
    """What the recording costs more than the best gait, pull included."""
    solves: int

    @property
    def cost(self) -> float:
        """Of the nearest gait."""
        return float(self.w @ self.near.total_costs)

    def allowed(self) -> Array:
        """Half widths that SLACK and the open bracket allow, shape (K,)."""
        slack = (SLACK + self.bracket[1] - self.bracket[0]) * self.cost
        return np.asarray(np.sqrt(2 * slack * np.maximum(np.diag(self.spread), 0.0)))


@dataclass(frozen=True)
class Walk:
    """A recorded walk, as the model's body would walk it.

    Attributes:
        shown: The gait as recorded.
        missing: Columns that the recording has not got.
    """

    shown: Gait
    missing: tuple[str, ...] = ()


@dataclass(frozen=True)
class Explanation:
    """What a person walks for.

    Attributes:
        w: Weights, shape (K,).
        half: Their half widths, shape (K,): from SLACK and the bracket, from starts and from
            trials, as the root of the sum of squares; at least NARROWEST.
        allowed: The first part, shape (K,).
        starts: Largest difference of an answer from other starting weights, shape (K,).
        trials: Largest difference of a single trial's answer, shape (K,); 0 where there is one.
        rounds: Of the answer that is told, the last one its end.
        others: Last rounds from other starts.
        apart: How far the best gait is from the recording, each joint [deg].
    """

    w: Array
    half: Array
    allowed: Array
    starts: Array
    trials: Array
    rounds: tuple[Round, ...]
    others: tuple[Round, ...]
    apart: dict[str, float]

    @property
    def last(self) -> Round:
        """The answer's last round."""
        return self.rounds[-1]

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
    w = spec.stack.reference_weights
    return feasible_gait(spec, walk.shown, w, missing=walk.missing, executor=executor)


def explain(
    spec: WalkerSpec,
    walk: Walk,
    near: Feasible,
    *,
    trials: Sequence[Walk] = (),
    rounds: int | None = None,
    executor: Executor | None = None,
    on_answer: Callable[[str], None] = lambda what: None,
) -> Explanation:
    """Weights of a walk with half widths.

    Args:
        spec: Which body, and its costs.
        walk: The recorded walk, the mean of all trials.
        near: Its nearest gait under the reference weights.
        trials: Each trial, where there are several.
        rounds: Most turns of gait and weights; None: ROUNDS.
        executor: Solves starts and trials side by side.
        on_answer: Told when they are solved.

    Raises:
        SolverError: If no gait is found for some weights.
    """
    rounds = ROUNDS if rounds is None else rounds
    starts = starting_weights(spec.stack.reference_weights)
    tasks = [(spec, walk, w, [near.gait], rounds) for w in starts]
    tasks += [(spec, t, starts[0], [near.gait], rounds) for t in trials]
    found = run_tasks(alternate, tasks, executor)
    on_answer(f"{len(starts)} starts and {len(trials)} trials")
    chains, single = found[: len(starts)], found[len(starts) :]
    chosen = min(chains, key=lambda c: c[-1].gap)
    others = tuple(c[-1] for c in chains if c is not chosen)
    last = chosen[-1]
    by_start = _farthest(last.w, [r.w for r in others])
    from_reference = chains[0][-1].w
    by_trial = _farthest(from_reference, [c[-1].w for c in single])
    allowed = last.allowed()
    half = np.sqrt(allowed**2 + by_start**2 + by_trial**2)
    return Explanation(
        w=last.w,
        half=np.maximum(half, NARROWEST),
        allowed=allowed,
        starts=by_start,
        trials=by_trial,
        rounds=chosen,
        others=others,
        apart=degrees_apart(spec.walker, last.best, walk.shown),
    )


def _farthest(w: Array, others: Sequence[Array]) -> Array:
    """Largest difference of each weight, shape (K,)."""
    return np.asarray(np.abs(np.array([w, *others]) - w).max(axis=0))


def alternate(
    spec: WalkerSpec, walk: Walk, w: Array, near: Sequence[Gait], rounds: int
) -> tuple[Round, ...]:
    """Turns of gait and weights from weights ``w`` until the gap rests; for a process pool.

    Args:
        spec: Which body, and its costs.
        walk: The recorded walk.
        w: Starting weights, shape (K,).
        near: Gaits from which the first nearest gait is sought.
        rounds: Most turns.
    """
    y = feasible_gait(spec, walk.shown, w, missing=walk.missing, near=near)
    forward = Remembered(y.gait, spec)
    turns = [_turn(spec, y, forward)]
    while len(turns) < rounds:
        last = turns[-1]
        at = [last.near.gait, last.best]
        y = feasible_gait(spec, walk.shown, last.w, missing=walk.missing, near=at)
        turn = _turn(spec, y, forward)
        if not turn.gap < last.gap:
            break
        turns.append(turn)
        if turn.gap > (1 - RESTS) * last.gap:
            break
    return tuple(turns)


def _turn(spec: WalkerSpec, near: Feasible, forward: Remembered) -> Round:
    """Weights of the least regret of a gait."""
    before, mu = forward.solves, -near.total_costs
    steps = cpirl(
        forward,
        Expert(mu, np.zeros(len(mu)), demonstration=near.gait),
        mode="minimise",
        bracket=BRACKET,
        max_solves=MAX_SOLVES,
        min_weight=MIN_WEIGHT,
        rng=np.random.default_rng(0),
    )
    history = list(steps)
    w = history[-1].estimate
    answer = forward(w)
    regret = max(float((forward.policies() @ w).max() - w @ mu), 0.0)
    lower = -float(game_lp(forward.policies() - mu, MIN_WEIGHT).value)
    cost, pull = float(-w @ mu), near.pull
    return Round(
        near=near,
        w=w,
        bracket=(min(max(lower, 0.0), regret) / cost, regret / cost),
        best=answer.policy,
        costs=-answer.mu,
        spread=_spread(forward.sensitivity(w)),
        gap=cost + pull - float(-w @ answer.mu),
        solves=forward.solves - before,
    )


def _spread(sensitivity: Array) -> Array:
    """Inverse Hessian of the regret in the plane of the weights, shape (K, K)."""
    U = plane_basis(len(sensitivity))
    return np.asarray(U @ np.linalg.solve(reduced(sensitivity), U.T))
