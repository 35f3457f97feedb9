"""Rules that end a run of CPIRL early: they look at the iterations so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from walking_irl.cpirl.outlook import Decision
from walking_irl.types import Iteration, Status


class StopRule(Protocol):
    """Decides after an iteration whether the run is over, and why."""

    def __call__(self, history: Sequence[Iteration]) -> Status | None:
        """Status to end with, or None to go on; ``history`` ends with the newest iteration."""
        ...


def stopped(
    decision: Decision, rules: Sequence[StopRule], history: Sequence[Iteration]
) -> Decision:
    """The decision, or the end if a rule says so; a run that has ended is not asked."""
    if decision.query is None:
        return decision
    found = (rule(history) for rule in rules)
    status = next((s for s in found if s is not None), None)
    return decision if status is None else decision._replace(query=None, status=status)


@dataclass(frozen=True)
class BudgetSpent:
    """Stop once there were as many forward solves."""

    max_solves: int

    def __call__(self, history: Sequence[Iteration]) -> Status | None:
        """See :class:`StopRule`."""
        return Status.BUDGET if len(history) >= self.max_solves else None


@dataclass(frozen=True)
class CertificateBelow:
    """Stop once some mixture of the policies found provably loses at most ``value``."""

    value: float

    def __call__(self, history: Sequence[Iteration]) -> Status | None:
        """See :class:`StopRule`."""
        return Status.GAP_CLOSED if history[-1].certificate <= self.value else None


@dataclass(frozen=True)
class IntervalsNarrowerThan:
    """Stop once every weight is known to within ``width``."""

    width: float

    def __call__(self, history: Sequence[Iteration]) -> Status | None:
        """See :class:`StopRule`."""
        return Status.CONVERGED if history[-1].widest <= self.width else None


@dataclass(frozen=True)
class EstimateSettled:
    """Stop once the estimate has moved by at most ``step`` (L1) in each of ``n`` iterations."""

    step: float
    n: int = 2

    def __call__(self, history: Sequence[Iteration]) -> Status | None:
        """See :class:`StopRule`."""
        if len(history) <= self.n:
            return None
        w = np.array([i.estimate for i in history[-self.n - 1 :]])
        moves = np.abs(np.diff(w, axis=0)).sum(axis=1)
        return Status.CONVERGED if moves.max() <= self.step else None
