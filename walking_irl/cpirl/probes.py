"""Probes: forward solves at the extremes of what is left, to tighten each weight's interval.

Every answer is a cut. Probing until a bound is reached makes it that of the set {f <= level} itself
(the thesis's weight set), not only of planes around it.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.bundle import Bundle
from walking_irl.cpirl.outlook import Decision, Outlook, Query
from walking_irl.cpirl.record import record
from walking_irl.cpirl.regret_model import extremes
from walking_irl.types import Forward, Iteration, Rule, Status

_MOST_PROBES, _REACHED = 15, 1.02
"""Probes of one bound in "set" mode, and the share of the level at which it counts as reached."""

Queries = Generator[Query, Bundle, None]
"""Yields queries; is sent the bundle with the answer to each."""


@dataclass(frozen=True)
class Probing:
    """How intervals are probed at the end of a run.

    Attributes:
        level: Regret of the weights sought, relative to |w.mu_E|.
        executor: Solves probes side by side where they do not depend on each other.
    """

    level: float
    executor: Executor | None = None


class Probes:
    """The probes of a run that has ended: none, unless it found weights to be sure of.

    Args:
        outlook: What is known at the end.
        decision: How the run ended.
        probing: What is wanted of them, or None for no probes.
    """

    def __init__(self, outlook: Outlook, decision: Decision, probing: Probing | None) -> None:
        self.outlook, self.decision, self.probing = outlook, decision, probing
        self._queries: Queries = _none()
        self._solver: Callable[[Forward], Forward] = lambda forward: forward
        if probing is not None and decision.status.has_weights:
            if outlook.levels.is_set:
                self._queries = _until_reached(outlook, probing.level)
            else:
                W = _one_for_each_bound(outlook, decision.estimate, probing.level)
                self._queries = _at(W, outlook, probing.level)
                self._solver = lambda forward: _ahead(forward, W, probing.executor)
        self._query = next(self._queries, None)

    @property
    def is_over(self) -> bool:
        """Whether there is nothing (more) to ask."""
        return self._query is None

    def run(self, forward: Forward, k: int) -> Iterator[Iteration]:
        """Solve the probes.

        Args:
            forward: Forward solver.
            k: Index of the first probe.

        Yields:
            One iteration for each; the last carries the run's ending.
        """
        level = None if self.probing is None else self.probing.level
        solve = self._solver(forward)
        while (query := self._query) is not None:
            bundle = self.outlook.bundle.add(query.w, solve(query.w))
            self.outlook = replace(self.outlook, bundle=bundle)
            self._query = None
            with suppress(StopIteration):
                self._query = self._queries.send(bundle)
            status = self.decision.status if self.is_over else Status.PROBE
            yield record(k, query, self.outlook, self.decision._replace(status=status), level)
            k += 1


def _none() -> Queries:
    """No queries."""
    yield from ()


def _one_for_each_bound(outlook: Outlook, w: Array, level: float) -> Array:
    """Extremes of {f <= level |w.mu_E|}, by the model or by the cuts; shape (2K, K)."""
    bundle = outlook.bundle
    if outlook.model is not None:
        drop = level * float(bundle.scale(w))
        return extremes(w, outlook.model.B, drop, bundle.min_weight)
    P = bundle.polyhedron(outlook.levels.probed(bundle, level))
    return np.array([P.support(s * e)[1] for e in np.eye(bundle.K) for s in (1.0, -1.0)])


def _at(W: Array, outlook: Outlook, level: float) -> Queries:
    """These weights, whatever their answers."""
    bundle = outlook.bundle
    for w in W:
        P = bundle.polyhedron(outlook.levels.probed(bundle, level))
        bundle = yield Query(w, Rule.PROBE, P)


def _until_reached(outlook: Outlook, level: float) -> Queries:
    """Each end of each interval until the weights there are as good as the level says."""
    bundle = outlook.bundle
    own = outlook.levels.probed(bundle, level)
    for direction in np.vstack([np.eye(bundle.K), -np.eye(bundle.K)]):
        for _ in range(_MOST_PROBES):
            P = bundle.polyhedron(own)
            w = P.support(direction)[1]
            if bundle.is_asked(w):
                break
            bundle = yield Query(w, Rule.PROBE, P)
            f = float(bundle.robust_regrets(w[None])[0]) - bundle.expert.suboptimality
            if f <= _REACHED * float(w @ own):
                break


def _ahead(forward: Forward, W: Array, executor: Executor | None) -> Forward:
    """The forward solver, to be asked for the rows of ``W`` in turn: solved side by side."""
    if executor is None:
        return forward
    responses = executor.map(forward, list(W))
    return lambda w: next(responses)
