"""Legs must not pass through each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.costs.base import SharedCost, Term, read_sensors


@dataclass(frozen=True)
class LegGap(SharedCost):
    """Squared lack of lateral distance of the legs; a planar walker has none to keep.

    Attributes:
        gaps: Least lateral distance of the same points of both legs [m].
    """

    name: str = "gap"
    unit: str = "m^2"
    coefficient: float = 400.0
    meaning: str = "Legs keep a lateral distance."
    formula: str = "|min(0, y_l - y_r - gap)|^2"
    gaps: tuple[tuple[str, float], ...] = (
        ("ankle", 0.107),
        ("heel", 0.107),
        ("toe", 0.107),
        ("knee", 0.16),
    )

    def terms(self, walker: Walker) -> Sequence[Term]:
        """One residual a pair of points."""
        if not walker.is_lateral:
            return []
        left, right = (
            read_sensors(walker, "s", [(f"{p}_{side}", 1) for p, _ in self.gaps]) for side in "lr"
        )
        gap = np.array([g for _, g in self.gaps])

        def residual(y_left: Any, y_right: Any) -> Any:
            return np.minimum(0, y_left - y_right - gap)

        return [Term((left, right), residual, is_linear=True)]
