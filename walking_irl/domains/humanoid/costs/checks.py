"""Costs that the machinery would misread are refused when a stack is made."""

from __future__ import annotations

import numpy as np

from walking_irl.domains.humanoid.costs.base import CHANNELS, Cost, Squares, Term
from walking_irl.domains.humanoid.costs.defaults import Costs
from walking_irl.domains.humanoid.costs.partials import SIZES, first_partials
from walking_irl.errors import InvalidInputError


def check_costs(costs: Costs, per_metre: tuple[Cost, ...]) -> None:
    """Refuse costs among which weights would mean nothing.

    Raises:
        InvalidInputError: If names repeat, a scale is not positive, or no cost is per metre.
    """
    names = [c.name for c in costs]
    if not per_metre:
        raise InvalidInputError("a walker needs at least one cost per metre to walk for")
    if len(set(names)) < len(names):
        raise InvalidInputError(f"costs need different names, got {', '.join(names)}")
    for cost in per_metre:
        if not (np.isfinite(cost.scale) and cost.scale > 0):
            raise InvalidInputError(f"the scale of {cost.name} must be > 0, got {cost.scale}")


def check_term(cost: Squares, term: Term, width: int) -> None:
    """Refuse what complex steps would differentiate wrongly, and say so early.

    Raises:
        InvalidInputError: If a term's reads do not fit its residuals, or its derivatives by complex
            steps are not those by differences at a few random numbers.
    """
    for read in term.reads:
        if read.channel not in CHANNELS:
            raise InvalidInputError(
                f"{cost.name} reads {read.channel!r}; choose from {', '.join(CHANNELS)}"
            )
        if read.channel != "h" and len(read.columns) != width:
            raise InvalidInputError(
                f"{cost.name} reads {len(read.columns)} columns of {read.channel} "
                f"for {width} residuals; every read needs one column for each"
            )
    if not term.reads:
        return
    x = [
        np.abs(1 + np.random.default_rng(p).normal(size=(3, width))) * SIZES[r.channel]
        for p, r in enumerate(term.reads)
    ]
    exact = first_partials(term.residual, x, (3, width))
    for p, read in enumerate(term.reads):
        step = 1e-5 * SIZES[read.channel]
        ends = [
            np.asarray(term.residual(*(v + sign * step * (p == o) for o, v in enumerate(x))))
            for sign in (1, -1)
        ]
        difference = (ends[0] - ends[1]) / (2 * step)
        wrong = np.abs(difference - exact[p]) > 1e-4 * (np.abs(difference).max() + 1e-9)
        if np.median(wrong) > 0:
            raise InvalidInputError(
                f"the residual of {cost.name} must be an elementwise, analytic function that takes "
                f"complex numbers (no abs, no branch on a value): its derivative by complex steps "
                f"with respect to {read.channel} is not that by differences"
            )
