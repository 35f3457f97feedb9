"""Time that a metre takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.costs.base import Cost, Term


@dataclass(frozen=True)
class Time(Cost):
    """Time that a metre takes: the factor that every cost per metre has, alone."""

    name: str = "time"
    unit: str = "0.8 s"
    scale: float = 0.74
    meaning: str = "Time that a metre takes."
    formula: str = "1"
    reference: float | None = 0.2615
    planar_reference: float | None = 1.158

    def terms(self, walker: Walker) -> Sequence[Term]:
        """One in every step."""
        return [Term((), lambda: 1.0)]
