"""Extra stop rules for CPIRL: small objects that look at the iterations so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from walking_irl.types import Iteration, Status


class StopRule(Protocol):
    """Decides after an iteration whether the run is over, and why."""

    def __call__(self, history: Sequence[Iteration]) -> Status | None:
        """Status to end with, or None to go on; ``history`` ends with the newest iteration."""
        ...


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
        widths = np.diff(history[-1].intervals, axis=1)
        return Status.CONVERGED if float(widths.max()) <= self.width else None


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
        return (
            Status.CONVERGED if np.abs(np.diff(w, axis=0)).sum(axis=1).max() <= self.step else None
        )
