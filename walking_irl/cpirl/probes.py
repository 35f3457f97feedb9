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
from walking_irl.cpirl.certainty import Level, level_of
from walking_irl.cpirl.endings import told_true
from walking_irl.cpirl.outlook import Decision, Outlook, Query
from walking_irl.cpirl.record import record
from walking_irl.cpirl.regret_model import extremes
from walking_irl.errors import EmptyPolyhedronError
from walking_irl.types import Forward, Iteration, Rule, Status

_MOST_PROBES, _REACHED = 15, 1.02
"""Probes of one bound in "set" mode, and the share of the level at which it counts as reached."""
_MUCH_BEYOND, _MOST_ROUNDS = 2.0, 3
"""Cut-based over promised half width that is probed again, and how often."""

Queries = Generator[Query, Bundle, None]
"""Yields queries; is sent the bundle with the answer to each."""


@dataclass(frozen=True)
class Probing:
    """How intervals are probed at the end of a run.

    Attributes:
        level: Sub-optimality of the expert that the intervals allow for, relative to |w.mu_E|; None
            for what is measured (:mod:`~walking_irl.cpirl.certainty`).
        executor: Solves probes side by side where they do not depend on each other.
    """

    level: float | None = None
    executor: Executor | None = None


class Probes:
    """The probes of a run that has ended: none, unless it found weights to be sure of.

    Args:
        outlook: What is known at the end.
        decision: How the run ended, or its next query.
        probing: What is wanted of them, or None for no probes.
        tol: Regret that counts as none, relative.
    """

    def __init__(
        self, outlook: Outlook, decision: Decision, probing: Probing | None, tol: float
    ) -> None:
        self.outlook, self.decision, self.probing, self.tol = outlook, decision, probing, tol
        self._queries: Queries = _none()
        self._solver: Callable[[Forward], Forward] = lambda forward: forward
        self._n = 0
        level = self.level
        if probing is not None and level is not None and decision.status.has_weights:
            if outlook.levels.is_set:
                self._queries = _until_reached(outlook, decision.estimate, level.total)
            else:
                W = _one_for_each_bound(outlook, decision.estimate, level.total)
                self._queries = _at(W, outlook, decision.estimate, level.total)
                self._solver = lambda forward: _ahead(forward, W, probing.executor)
        self._query = next(self._queries, None)

    @property
    def level(self) -> Level | None:
        """Of the intervals, as far as the answers tell; None before the end, and where it is open.

        Without probes, cuts are far from any level: an exact expert's intervals stay theirs.
        """
        status = self.decision.status
        if self.decision.query is not None or not (status.has_weights or status.is_refuted):
            return None
        if self.probing is None and self.outlook.bundle.is_exact:
            return None
        asked = None if self.probing is None else self.probing.level
        return level_of(self.outlook, self.decision.estimate, self.tol, asked)

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
        solve = self._solver(forward)
        while (query := self._query) is not None:
            bundle = self.outlook.bundle.add(query.w, solve(query.w))
            self.outlook = replace(self.outlook, bundle=bundle)
            self._n += 1
            self._query = None
            with suppress(StopIteration):
                self._query = self._queries.send(bundle)
            decision = self.decision._replace(status=Status.PROBE)
            if self.is_over:  # what the probes found may refute it
                self.decision = decision = told_true(self.decision, self.outlook, self.tol)
            yield record(k, query, self.outlook, decision, self.level, self._n)
            k += 1


def _none() -> Queries:
    """No queries."""
    yield from ()


def _one_for_each_bound(outlook: Outlook, w: Array, level: float) -> Array:
    """Extremes of {f <= level}, by the model or by the cuts; shape (2K, K)."""
    bundle = outlook.bundle
    if outlook.model is not None:
        return extremes(w, outlook.model.B, level, bundle.min_weight)
    P = bundle.polyhedron(outlook.levels.probed(bundle, level, w))
    return np.array([P.support(s * e)[1] for e in np.eye(bundle.K) for s in (1.0, -1.0)])


def _at(W: Array, outlook: Outlook, estimate: Array, level: float) -> Queries:
    """These weights; then, for an exact expert, where the cuts leave much more than the model.

    There the regret is no quadratic: contact jumps make one gait optimal for a set of weights.
    """
    bundle = outlook.bundle
    for w in W:
        P = bundle.polyhedron(outlook.levels.probed(bundle, level, estimate))
        bundle = yield Query(w, Rule.PROBE, P)
    if outlook.model is None or not bundle.is_exact:
        return
    reach = np.abs(W - estimate)[np.arange(len(W)), np.arange(len(W)) // 2]
    for _ in range(_MOST_ROUNDS):
        for i in range(len(W)):
            P = bundle.polyhedron(outlook.levels.probed(bundle, level, estimate))
            end = P.support((1.0 if i % 2 == 0 else -1.0) * np.eye(bundle.K)[i // 2])[1]
            beyond = abs(end[i // 2] - estimate[i // 2]) / max(reach[i], 1e-300)
            if beyond > _MUCH_BEYOND:
                w = estimate + (end - estimate) * min(1.0, 2.0 / beyond)
                bundle = yield Query(w, Rule.PROBE, P)


def _until_reached(outlook: Outlook, estimate: Array, level: float) -> Queries:
    """Each end of each interval until the weights there are as good as the level says."""
    bundle = outlook.bundle
    own = outlook.levels.probed(bundle, level, estimate)
    for direction in np.vstack([np.eye(bundle.K), -np.eye(bundle.K)]):
        for _ in range(_MOST_PROBES):
            P = bundle.polyhedron(own)
            try:
                w = P.support(direction)[1]
            except EmptyPolyhedronError:  # no weights explain the expert after all
                return
            if bundle.is_asked(w):
                break
            bundle = yield Query(w, Rule.PROBE, P)
            f = float(bundle.robust_regrets(w[None])[0]) - bundle.expert.suboptimality
            if f <= _REACHED * float(w @ own):
                break


def _ahead(forward: Forward, W: Array, executor: Executor | None) -> Forward:
    """The forward solver, to be asked for the rows of ``W`` first: those are solved in parallel."""
    if executor is None:
        return forward
    responses = executor.map(forward, list(W))
    return lambda w: next(responses, None) or forward(w)
