r"""Work: what the mechanical power of all joints costs a muscle, of either sign.

Muscles turn a quarter of their energy into positive work, and absorb 1.2 times the energy that
they spend on negative work (R. Margaria 1968, Int. Z. angew. Physiol. 25:339: efficiencies of
walking uphill and downhill), so a joule of either sign counts by its inverse efficiency, relative
to the mean of both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.costs.base import Cost, Term, read_joints


@dataclass(frozen=True)
class Work(Cost):
    r"""Mean power of the motors, positive and negative by their inverse efficiencies.

    Half of it has the torque held and the velocity at either end of the step: with the velocity at
    one end only, torques that alternate from step to step would be free. With
    :math:`s = \sqrt{p^2 + p_0^2}`, the squared residual is
    :math:`\tfrac12 (p^2 / s)(1 + d\, p / s) / P`, d from the two efficiencies.

    Attributes:
        power: Unit of power P [W].
        smoothing: The absolute value is smooth within this power p0 [W].
        efficiencies: Of positive and of negative work.
    """

    name: str = "work"
    unit: str = "100 W"
    scale: float = 1.1
    meaning: str = "Mechanical power, negative power a fifth as dear as positive."
    formula: str = "(1.66 max(0, tau v) + .34 max(0, -tau v)) / 100 W"
    reference: float | None = 0.2468
    planar_reference: float | None = 0.3762
    power: float = 100.0
    smoothing: float = 20.0
    efficiencies: tuple[float, float] = (0.25, 1.2)

    def terms(self, walker: Walker) -> Sequence[Term]:
        """Two residuals a motor: at the start and at the end of a step."""
        tau = read_joints(walker, "tau")
        return [
            Term(
                (tau, read_joints(walker, velocity)),
                self.residual,
                first=self.first,
                second=self.second,
            )
            for velocity in ("v", "v_next")
        ]

    @property
    def asymmetry(self) -> float:
        """How much dearer positive work is than the mean of both signs, d in 1 +- d [1]."""
        positive, negative = (1 / e for e in self.efficiencies)
        return (positive - negative) / (positive + negative)

    def residual(self, tau: Any, v: Any) -> Any:
        """Signed root of about half the power in its unit, smooth through zero."""
        p = tau * v
        s = np.sqrt(p * p + self.smoothing**2)
        return np.sqrt(0.5 / self.power) * p * np.sqrt((1 + self.asymmetry * p / s) / s)

    def first(self, tau: Any, v: Any) -> tuple[Any, Any]:
        """First partial derivatives of :meth:`residual`."""
        p, soft = tau * v, self.smoothing**2
        s = p * p + soft
        root_s = np.sqrt(s)
        dear = np.sqrt(1 + self.asymmetry * p / root_s)
        bend = 0.5 * self.asymmetry * soft * p / (s * root_s * dear)
        slope = np.sqrt(0.5 / self.power / root_s) * ((1 - 0.5 * p * p / s) * dear + bend)
        return slope * v, slope * tau

    def second(self, tau: Any, v: Any) -> dict[tuple[int, int], Any]:
        """Second partial derivatives of :meth:`residual`."""
        p, soft = tau * v, self.smoothing**2
        s = p * p + soft
        share, d = p / np.sqrt(s), self.asymmetry
        root = np.sqrt(0.5 / self.power) / np.sqrt(np.sqrt(s))  # residual: root p dear
        dear = np.sqrt(1 + d * share)
        dear1 = d * soft / (s * np.sqrt(s)) / (2 * dear)
        dear2 = -3 * p / s * dear1 - dear1 * dear1 / dear
        slope = root * (1 - 0.5 * p * p / s)
        bend = root * p / s * (1.25 * p * p / s - 1.5)
        first = slope * dear + root * p * dear1
        second = bend * dear + 2 * slope * dear1 + root * p * dear2
        return {(0, 0): second * v * v, (1, 1): second * tau * tau, (0, 1): first + second * p}
