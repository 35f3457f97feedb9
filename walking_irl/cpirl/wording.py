"""What a run of CPIRL knows, in sentences: for terminals, files and recordings alike."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from walking_irl.types import Certainty, Expert, Gap, Iteration, Rule, Status

_RECENT = 8
"""Solves over which progress is measured."""


def ending_in_words(iterations: Sequence[Iteration], expert: Expert, tol: float) -> str:
    """Why a run ended, with the figures that make it so.

    Args:
        iterations: All of the run, at least one.
        expert: The expert.
        tol: Regret that counts as none, relative to |w.mu_E|.
    """
    last = iterations[-1]
    why = str(last.status.value)
    if last.status in (Status.NOT_OPTIMAL, Status.CONTRADICTED):
        return f"{why} ({_span(last, expert)})"
    if last.status is Status.BUDGET:
        return f"{why}; {_still_to_learn(iterations, expert, tol)}"
    return why


def how_sure(last: Iteration, expert: Expert) -> str:
    """What the half widths of the weights are made of, the widest of each kind.

    >>> from walking_irl.types import Certainty
    >>> half = lambda size: np.full(2, size)
    >>> sure = Certainty(half(0.001), half(0.02), half(0.0), half(0.0005), 1e-4, Gap.MEASURED)
    >>> in_parts(sure, 1.0, "")
    "from noise 0.001, from the expert's possible 0.01 % sub-optimality (as measured) 0.02"
    """
    if last.certainty is None:
        return "what the cuts leave"
    return in_parts(last.certainty, _return(last, expert), expert.vouched_by)


def in_parts(certainty: Certainty, unit: float, vouched_by: str) -> str:
    """See :func:`how_sure`; ``unit`` is the expert's return."""
    who = {
        Gap.MEASURED: "as measured",
        Gap.GRANTED: f"vouched for by {vouched_by}" if vouched_by else "as granted; noise hides it",
        Gap.ASKED: "as asked for",
    }[certainty.source]
    gap = f"the expert's possible {percent(certainty.gap / unit)} sub-optimality ({who})"
    parts = [
        (certainty.from_noise, "noise"),
        (certainty.from_gap, gap),
        (certainty.from_solver, "the solver"),
    ]
    said = [f"from {name} {widest.max():.2g}" for widest, name in parts if widest.max() >= 5e-6]
    if vouched_by and certainty.gap == 0.0:
        said.append(f"nothing from the expert's sub-optimality, which {vouched_by} rules out")
    return ", ".join(said) or "next to nothing"


def percent(share: float) -> str:
    """A share of a return.

    >>> percent(1.234e-4), percent(0.0), percent(0.5)
    ('0.012 %', '0 %', '50 %')
    """
    return f"{100 * share:.2g} %"


def solves_left(iterations: Sequence[Iteration], target: float) -> int | None:
    """How many solves it would probably take until the best regret is ``target`` above its bound.

    At the rate of the last solves, which each left a share of what was to gain; None where they
    gained nothing.
    """
    asked = [it for it in iterations if it.rule is not Rule.PROBE][-_RECENT - 1 :]
    lower = max(asked[-1].bracket.lower, 0.0)
    gaps = [max(it.best_regret - lower, 1e-300) for it in asked]
    if len(gaps) < 2 or not 0.0 < target:
        return None
    rate = math.log(gaps[0] / gaps[-1]) / (len(gaps) - 1)
    if not rate > 1e-3:
        return None
    return max(1, math.ceil(math.log(max(gaps[-1] / target, 1.0)) / rate))


def _span(last: Iteration, expert: Expert) -> str:
    """The bracket of min f."""
    unit = _return(last, expert)
    low, high = max(last.bracket.lower, 0.0), max(last.bracket.upper, 0.0)
    return f"sub-optimal by {percent(low / unit)} to {percent(high / unit)} at its best weights"


def _still_to_learn(iterations: Sequence[Iteration], expert: Expert, tol: float) -> str:
    last = iterations[-1]
    unit = _return(last, expert)
    left = f"the best weights so far leave the expert {percent(last.best_regret / unit)} short of "
    left += f"optimal, {percent(tol)} counts as none"
    n = solves_left(iterations, tol * unit)
    if n is None:
        return f"{left}; the last solves gained nothing, more may not either"
    return f"{left}: about {n} more solve{'s' if n > 1 else ''} at the pace of the last"


def _return(last: Iteration, expert: Expert) -> float:
    """|w.mu_E| at the estimate."""
    return max(abs(float(last.estimate @ np.asarray(expert.mu))), 1e-300)
