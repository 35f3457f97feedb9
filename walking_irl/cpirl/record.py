"""One iteration of CPIRL as an immutable record: what is known after a forward solve."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.outlook import Decision, Outlook, Query
from walking_irl.cpirl.regret_model import standard_errors
from walking_irl.types import Iteration, Status

_INTERVAL_FLOOR = 0.002
"""Added to the standard errors of estimated weights: what secants leave of the Hessian's error."""


def record(
    k: int, query: Query, outlook: Outlook, decision: Decision, level: float | None = None
) -> Iteration:
    """The record of the newest answer.

    Args:
        k: Index of the forward solve.
        query: What was asked.
        outlook: What is known; its bundle holds the answer already.
        decision: What is believed after it.
        level: Relative level of the intervals, or None for that of the cuts.
    """
    bundle = outlook.bundle
    f = bundle.regrets(bundle.W)
    return Iteration(
        k=k,
        polyhedron=query.polyhedron,
        w=query.w,
        rule=query.rule,
        response=bundle.responses[-1],
        regret=float(f[-1]),
        best_regret=float(f.min()),
        certificate=bundle.game.value,
        intervals=_intervals(outlook, decision, level),
        estimate=decision.estimate,
        status=decision.status,
    )


def _intervals(outlook: Outlook, decision: Decision, level: float | None) -> Array:
    """Cut-based bounds; for an estimated expert that converged t standard errors + a floor."""
    bundle, levels, w = outlook.bundle, outlook.levels, decision.estimate
    is_settled = decision.status.has_weights or decision.status is Status.PROBE
    if bundle.covariance is None or outlook.model is None or not is_settled:
        own = levels.explaining(bundle) if level is None else levels.probed(bundle, level)
        return bundle.intervals(own, w)
    half = bundle.quantile(1) * standard_errors(outlook.model.B, bundle.covariance)
    bounds = np.c_[w - half - _INTERVAL_FLOOR, w + half + _INTERVAL_FLOOR]
    clipped: Array = np.clip(bounds, bundle.min_weight, 1.0)
    return clipped
