"""Impact: how fast the ground reaction force changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.costs.base import Cost, H, Term, read_sensors

FEET = (("touch_r", 0), ("touch_l", 0))


@dataclass(frozen=True)
class Impact(Cost):
    """Squared rate of the normal ground reaction force under each foot.

    Attributes:
        rate: Unit of the rate [body weights / s].
    """

    name: str = "impact"
    unit: str = "(10 BW/s)^2"
    scale: float = 0.91
    meaning: str = "Squared rate of the ground reaction force under each foot."
    formula: str = "|dF/dt|^2"
    reference: float | None = 0.2024
    planar_reference: float | None = 0.4242
    rate: float = 10.0

    def terms(self, walker: Walker) -> Sequence[Term]:
        """One residual a foot."""
        unit = walker.weight * self.rate

        def residual(force: Any, force_next: Any, h: Any) -> Any:
            return (force_next - force) / h / unit

        def first(force: Any, force_next: Any, h: Any) -> tuple[Any, Any, Any]:
            slope = 1 / (h * unit)
            return -slope, slope, (force - force_next) * slope / h

        def second(force: Any, force_next: Any, h: Any) -> dict[tuple[int, int], Any]:
            slope = 1 / (h * h * unit)
            return {(0, 2): slope, (1, 2): -slope, (2, 2): 2 * (force_next - force) * slope / h}

        reads = (read_sensors(walker, "s", FEET), read_sensors(walker, "s_next", FEET), H)
        return [Term(reads, residual, first=first, second=second)]
