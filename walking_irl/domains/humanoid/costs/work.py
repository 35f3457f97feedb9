"""Work: mechanical power of all joints, of either sign."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.costs.base import Cost, Term, read_joints


@dataclass(frozen=True)
class Work(Cost):
    """Mean absolute power, half of it with the torque held and the velocity at either end.

    With the velocity at one end only, torques that alternate from step to step would be free.

    Attributes:
        power: Unit of power [W].
        smoothing: The absolute value is smooth within this [W].
    """

    name: str = "work"
    unit: str = "100 W"
    scale: float = 0.38
    meaning: str = "Mechanical power, either sign."
    formula: str = "|tau v| / 100 W"
    reference: float | None = 1.5
    power: float = 100.0
    smoothing: float = 20.0

    def terms(self, walker: Walker) -> Sequence[Term]:
        """Two residuals a motor: at the start and at the end of a step."""
        tau = read_joints(walker, "tau")
        return [
            Term((tau, read_joints(walker, velocity)), self.residual, second=self.second)
            for velocity in ("v", "v_next")
        ]

    def residual(self, tau: Any, v: Any) -> Any:
        """Signed root of about half the absolute power in its unit, smooth through zero."""
        p = tau * v
        return np.sqrt(0.5 / self.power) * p / np.sqrt(np.sqrt(p * p + self.smoothing**2))

    def second(self, tau: Any, v: Any) -> dict[tuple[int, int], Any]:
        """Second partial derivatives of :meth:`residual`."""
        p = tau * v
        s = p * p + self.smoothing**2
        root = np.sqrt(0.5 / self.power) / np.sqrt(np.sqrt(s))
        slope = root * (1 - 0.5 * p * p / s)
        bend = root * p / s * (1.25 * p * p / s - 1.5)
        return {(0, 0): bend * v * v, (1, 1): bend * tau * tau, (0, 1): slope + bend * p}
