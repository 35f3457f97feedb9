"""Feet on the ground must not skid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.costs.base import H, SharedCost, Term, read_sensors

SOLE_POINTS = tuple(f"{p}_{s}" for s in "rl" for p in ("heel", "ball", "toe"))
MOST = 50.0
"""Where the exponential is cut off, against overflow; contact is then 2e-22."""


@dataclass(frozen=True)
class Skid(SharedCost):
    """Squared forward speed of the points of the soles that are down.

    Attributes:
        speed: Unit of speed [m/s].
        height: A point below this height counts as down [m].
        width: Of the change [m].
    """

    name: str = "skid"
    unit: str = "(0.5 m/s)^2"
    coefficient: float = 0.2
    meaning: str = "Feet on the ground do not skid."
    formula: str = "|contact dx/dt / 0.5|^2"
    speed: float = 0.5
    height: float = 0.005
    width: float = 0.004

    def terms(self, walker: Walker) -> Sequence[Term]:
        """One residual a point of the soles."""
        x, z = ([(point, axis) for point in SOLE_POINTS] for axis in (0, 2))

        def residual(x: Any, x_next: Any, z: Any, h: Any) -> Any:
            return (x_next - x) / h * self.contact(z) / self.speed

        reads = (
            read_sensors(walker, "s", x),
            read_sensors(walker, "s_next", x),
            read_sensors(walker, "s", z),
            H,
        )
        return [Term(reads, residual, first=self.first, second=self.second)]

    def first(self, x: Any, x_next: Any, z: Any, h: Any) -> tuple[Any, Any, Any, Any]:
        """First partial derivatives of the residual."""
        down = self.contact(z)
        rate = down / (h * self.speed)
        moved = (x_next - x) * rate
        return -rate, rate, -moved * (1 - down) / self.width, -moved / h

    def second(self, x: Any, x_next: Any, z: Any, h: Any) -> dict[tuple[int, int], Any]:
        """Second partial derivatives of the residual."""
        down = self.contact(z)
        slope = -down * (1 - down) / self.width
        bend = -slope * (1 - 2 * down) / self.width
        moved, unit = x_next - x, 1 / (h * self.speed)
        return {
            (0, 2): -unit * slope,
            (1, 2): unit * slope,
            (0, 3): unit * down / h,
            (1, 3): -unit * down / h,
            (2, 2): unit * moved * bend,
            (2, 3): -unit * moved * slope / h,
            (3, 3): 2 * unit * moved * down / (h * h),
        }

    def contact(self, z: Any) -> Any:
        """How far a point at height ``z`` [m] counts as down: 1 on the ground, 0 in the air."""
        return 1 / (1 + np.exp(np.minimum((z - self.height) / self.width, MOST)))
