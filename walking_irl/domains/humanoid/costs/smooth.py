"""Smoothness: squared joint accelerations and squared rates of the joint torques."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.costs.base import Cost, H, Term, read_joints


@dataclass(frozen=True)
class Smoothness(Cost):
    """Half the squared joint accelerations, and the squared rates of the motors' torques.

    Muscles build up force within a tenth of a second; torques that jump look like a robot.

    Attributes:
        acceleration: Unit of acceleration [rad/s^2].
        rate: Unit of the torque's rate [mean strength of both directions / s].
    """

    name: str = "smooth"
    unit: str = "1"
    scale: float = 6.0
    meaning: str = "Squared joint accelerations, and squared rates of the joint torques."
    formula: str = ".5 |a / (36 rad/s^2)|^2 + |dtau/dt / (4 strengths/s)|^2"
    reference: float | None = 0.127
    planar_reference: float | None = 0.1038
    acceleration: float = 36.0
    rate: float = 4.0

    def terms(self, walker: Walker) -> Sequence[Term]:
        """Two residuals an actuated joint."""
        unit = self.rate * (walker.strength_plus + walker.strength_minus) / 2

        share = np.sqrt(0.5) / self.acceleration

        def acceleration(a: Any) -> Any:
            return share * a

        def rate(tau: Any, tau_next: Any, h: Any) -> Any:
            return (tau_next - tau) / h / unit

        def first(tau: Any, tau_next: Any, h: Any) -> tuple[Any, Any, Any]:
            slope = 1 / (h * unit)
            return -slope, slope, (tau - tau_next) * slope / h

        def second(tau: Any, tau_next: Any, h: Any) -> dict[tuple[int, int], Any]:
            slope = 1 / (h * h * unit)
            return {(0, 2): slope, (1, 2): -slope, (2, 2): 2 * (tau_next - tau) * slope / h}

        torques = (read_joints(walker, "tau"), read_joints(walker, "tau_next"), H)
        return [
            Term(
                (read_joints(walker, "a"),), acceleration, is_linear=True, first=lambda a: (share,)
            ),
            Term(torques, rate, first=first, second=second),
        ]
