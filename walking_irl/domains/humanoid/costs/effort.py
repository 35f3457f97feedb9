"""Effort: squared joint torque relative to the strength of its direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.costs.base import Cost, Term, read_joints


@dataclass(frozen=True)
class Effort(Cost):
    """Squared joint torque relative to the strength of its direction.

    Attributes:
        switch: Width of the change between the strengths of both directions [Nm].
    """

    name: str = "effort"
    unit: str = "1"
    scale: float = 0.35
    meaning: str = "Squared joint torque relative to the strength of its direction."
    formula: str = "|tau / strength|^2"
    reference: float | None = 1.0
    switch: float = 10.0

    def terms(self, walker: Walker) -> Sequence[Term]:
        """One residual a motor."""
        plus, minus = 1 / walker.strength_plus, 1 / walker.strength_minus
        mean, half = (plus + minus) / 2, (plus - minus) / 2

        def residual(tau: Any) -> Any:
            return tau * (mean + half * np.tanh(tau / self.switch))

        def second(tau: Any) -> dict[tuple[int, int], Any]:
            th = np.tanh(tau / self.switch)
            slope = (1 - th * th) / self.switch
            return {(0, 0): 2 * half * slope * (1 - tau * th / self.switch)}

        return [Term((read_joints(walker, "tau"),), residual, second=second)]
