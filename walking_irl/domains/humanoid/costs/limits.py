"""Joints stay in their range."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.costs.base import SharedCost, Term, read_joints


@dataclass(frozen=True)
class JointLimits(SharedCost):
    """Squared excess over a joint's range."""

    name: str = "limits"
    unit: str = "rad^2"
    coefficient: float = 900.0
    meaning: str = "Joints stay in their range."
    formula: str = "|excess|^2"

    def terms(self, walker: Walker) -> Sequence[Term]:
        """One residual an actuated joint."""
        read = read_joints(walker, "q")
        lower, upper = walker.lower[read.columns], walker.upper[read.columns]

        def residual(q: Any) -> Any:
            return np.minimum(0, q - lower) + np.maximum(0, q - upper)

        return [Term((read,), residual, is_linear=True)]
