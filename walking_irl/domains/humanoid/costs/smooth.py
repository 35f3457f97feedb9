"""Smoothness: squared joint accelerations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.costs.base import Cost, Term, read_joints


@dataclass(frozen=True)
class Smoothness(Cost):
    """Squared joint accelerations.

    Attributes:
        acceleration: Unit of acceleration [rad/s^2].
    """

    name: str = "smooth"
    unit: str = "(50 rad/s^2)^2"
    scale: float = 5.0
    meaning: str = "Squared joint accelerations."
    formula: str = "|a / 50|^2"
    reference: float | None = 0.02
    acceleration: float = 50.0

    def terms(self, walker: Walker) -> Sequence[Term]:
        """One residual an actuated joint."""

        def residual(a: Any) -> Any:
            return a / self.acceleration

        return [Term((read_joints(walker, "a"),), residual, is_linear=True)]
