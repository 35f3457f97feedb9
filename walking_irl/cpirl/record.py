"""One iteration of CPIRL as an immutable record: what is known after a forward solve."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.guide import Decision, Guide
from walking_irl.cpirl.newton import standard_errors
from walking_irl.geometry.game import game_lp
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.types import Iteration, Rule, Status

SETTLED = (Status.CONVERGED, Status.MATCHED, Status.GAP_CLOSED, Status.PROBE)
"""Endings at which the quadratic model of a noisy expert's regret can be trusted."""
INTERVAL_FLOOR = 0.002
"""Added to the standard errors of estimated weights: what secants leave of the Hessian's error."""


def snapshot(
    guide: Guide,
    k: int,
    P: WeightPolyhedron,
    w: Array,
    rule: Rule,
    decision: Decision,
    probe: float | None,
) -> Iteration:
    """The record of the newest answer.

    Args:
        guide: Holds the archive, which knows the answer already.
        k: Index of the forward solve.
        P: Polyhedron in which ``w`` was chosen, before the answer's cut.
        w: Query, shape (K,).
        rule: How it was chosen.
        decision: What is believed after it.
        probe: Relative level of the intervals, or None for that of the cuts.
    """
    archive = guide.archive
    f = archive.regrets(archive.W)
    return Iteration(
        k=k,
        polyhedron=P,
        w=w,
        rule=rule,
        response=archive.responses[-1],
        regret=float(f[-1]),
        best_regret=float(f.min()),
        certificate=game_lp(archive.differences()).value,
        intervals=_intervals(guide, decision, probe),
        estimate=decision.estimate,
        status=decision.status,
    )


def _intervals(guide: Guide, decision: Decision, probe: float | None) -> Array:
    """Cut-based bounds; for an estimated expert that converged t standard errors + a floor."""
    archive = guide.archive
    if guide.is_exact or guide.model is None or decision.status not in SETTLED:
        lift = guide.lift() if probe is None else guide.probe_lift(probe)
        return archive.intervals(lift, decision.estimate)
    assert archive.covariance is not None
    half = archive.quantile(1) * standard_errors(guide.model.B, archive.covariance)
    w = decision.estimate
    bounds = np.c_[w - half - INTERVAL_FLOOR, w + half + INTERVAL_FLOOR]
    clipped: Array = np.clip(bounds, archive.min_weight, 1.0)
    return clipped
