"""One iteration of CPIRL as an immutable record: what is known after a forward solve."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.certainty import Level, bracket_of, half_widths
from walking_irl.cpirl.outlook import Decision, Outlook, Query
from walking_irl.types import Certainty, Iteration


def record(
    k: int,
    query: Query,
    outlook: Outlook,
    decision: Decision,
    level: Level | None = None,
    n_probes: int = 0,
) -> Iteration:
    """The record of the newest answer.

    Args:
        k: Index of the forward solve.
        query: What was asked.
        outlook: What is known; its bundle holds the answer already.
        decision: What is believed after it.
        level: Of the intervals at the end of a run, or None before it.
        n_probes: How many of the answers are probes.
    """
    bundle, w = outlook.bundle, decision.estimate
    f = bundle.regrets(bundle.W)
    certainty = None
    if level is not None and outlook.model is not None and not outlook.levels.is_set:
        certainty = half_widths(outlook, w, level, len(bundle.W) - n_probes)
    return Iteration(
        k=k,
        polyhedron=query.polyhedron,
        w=query.w,
        rule=query.rule,
        response=bundle.responses[-1],
        regret=float(f[-1]),
        best_regret=float(f.min()),
        certificate=bundle.game.value,
        intervals=_intervals(outlook, w, level, certainty),
        estimate=w,
        status=decision.status,
        bracket=bracket_of(bundle, w),
        certainty=certainty,
    )


def _intervals(
    outlook: Outlook, w: Array, level: Level | None, certainty: Certainty | None
) -> Array:
    """Per-weight bounds, shape (K, 2): those of the cuts, and the half widths about the estimate.

    Cuts of an expert that is known by a sample mean say less than its standard errors.
    """
    bundle = outlook.bundle
    bounds = np.c_[w, w]
    if certainty is not None:
        half = certainty.half_widths
        bounds = np.clip(np.c_[w - half, w + half], bundle.min_weight, 1.0)
    if certainty is None or bundle.is_exact:
        own = outlook.levels.explaining(bundle)
        if level is not None:
            own = outlook.levels.probed(bundle, level.total, w)
        cuts = bundle.intervals(own, w)
        bounds = np.c_[np.minimum(bounds[:, 0], cuts[:, 0]), np.maximum(bounds[:, 1], cuts[:, 1])]
    return np.asarray(bounds)
