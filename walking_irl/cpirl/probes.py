"""Probes: forward solves at the extremes of what is left, to tighten each weight's interval.

Every answer is a cut. Probing until a bound is reached makes it that of the set {f <= level} itself
(the thesis's weight set), not only of planes around it.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from dataclasses import replace

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.guide import Decision, Guide
from walking_irl.cpirl.newton import extremes
from walking_irl.cpirl.record import snapshot
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.types import Forward, Iteration, Rule, Status

MOST_PROBES, REACHED = 15, 1.02
"""Probes of one bound in "set" mode, and the share of the level at which it counts as reached."""


def may_probe(status: Status) -> bool:
    """Whether a run that ended so has weights to be sure of."""
    return status in (Status.MATCHED, Status.CONVERGED, Status.GAP_CLOSED)


def probe(
    forward: Forward,
    guide: Guide,
    decision: Decision,
    last: Iteration,
    level: float,
    executor: Executor | None = None,
) -> Iterator[Iteration]:
    """Tighten the intervals of a run that has found weights.

    Args:
        forward: Forward solver.
        guide: The run's guide.
        decision: How the run ended.
        last: The run's last iteration, not yielded yet.
        level: Regret of the weights sought, relative to |w.mu_E|.
        executor: Solves probes side by side where they do not depend on each other.

    Yields:
        ``last``, then the probes; only the last of all carries the run's ending.
    """
    if guide.mode == "set":
        yield from _until_reached(forward, guide, decision, last, level)
    else:
        yield from _once(forward, guide, decision, last, level, executor)


def _once(
    forward: Forward,
    guide: Guide,
    decision: Decision,
    last: Iteration,
    level: float,
    executor: Executor | None,
) -> Iterator[Iteration]:
    """Solve at the extremes of {f <= level |w.mu_E|}, one for each bound, all at once."""
    yield replace(last, status=Status.CUT)
    archive, w = guide.archive, decision.estimate
    if guide.model is not None:
        drop = level * float(archive.scale(w))
        queries = extremes(w, guide.model.B, drop, archive.min_weight)
    else:
        eye = np.eye(archive.K)
        P = archive.polyhedron(guide.probe_lift(level))
        queries = np.array([P.support(s * e)[1] for e in eye for s in (1.0, -1.0)])
    responses = (map if executor is None else executor.map)(forward, list(queries))
    for i, (query, response) in enumerate(zip(queries, responses, strict=True), start=1):
        P = archive.polyhedron(guide.probe_lift(level))
        archive.add(query, response)
        now = decision if i == len(queries) else decision._replace(status=Status.PROBE)
        yield snapshot(guide, last.k + i, P, query, Rule.PROBE, now, level)


def _until_reached(
    forward: Forward, guide: Guide, decision: Decision, last: Iteration, level: float
) -> Iterator[Iteration]:
    """Cut at each end of each interval until the weights there are as good as the level says."""
    k, queries = last.k, _ends(guide, level)
    query = next(queries, None)
    yield replace(last, status=decision.status if query is None else Status.CUT)
    while query is not None:
        w, P = query
        response = forward(w)
        guide.archive.add(w, response)
        query, k = next(queries, None), k + 1
        now = decision if query is None else decision._replace(status=Status.PROBE)
        yield snapshot(guide, k, P, w, Rule.PROBE, now, level)


def _ends(guide: Guide, level: float) -> Iterator[tuple[Array, WeightPolyhedron]]:
    """Ends of the intervals that are not reached yet; each must be answered before the next."""
    archive, lift = guide.archive, guide.probe_lift(level)
    for direction in np.vstack([np.eye(archive.K), -np.eye(archive.K)]):
        for _ in range(MOST_PROBES):
            P = archive.polyhedron(lift)
            w = P.support(direction)[1]
            if np.abs(archive.W - w).max(axis=1).min() <= 1e-9:
                break
            yield w, P
            f = float(archive.robust_regrets(w[None])[0]) - archive.expert.suboptimality
            if f <= REACHED * float(w @ lift):
                break
