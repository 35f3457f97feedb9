"""A measured ground reaction force as data: how far a gait's vertical force is from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.costs.base import Cost, Term, read_sensors
from walking_irl.domains.humanoid.costs.impact import FEET

FORCE = 0.1
"""What the vertical force may be off, to count as much as all joints [body weights]: the nearest
gaits of this body are .1 to .17 off people over stance."""


@dataclass(frozen=True)
class ForceApart(Cost):
    """Squared difference of the vertical force under each foot from a measured one, mean of both.

    Its residuals know which knot is which, as no objective of a walker does: it is a part of the
    distance from a recording, and no weight of it is ever sought.

    Attributes:
        measured: Of the right and the left foot at each knot, N pairs [body weights].
    """

    name: str = "force"
    unit: str = "(0.1 BW)^2"
    scale: float = 1.0
    meaning: str = "Vertical force as measured."
    measured: tuple[tuple[float, float], ...] = ()

    def terms(self, walker: Walker) -> Sequence[Term]:
        """One residual a foot."""
        unit = FORCE * np.sqrt(len(FEET))
        target = np.array(self.measured) / unit

        def residual(force: Any) -> Any:
            return force / (walker.weight * unit) - target[: np.shape(force)[-2]]

        return [Term((read_sensors(walker, "s", FEET),), residual, is_linear=True)]


def force_apart_from(vertical: Array) -> ForceApart:
    """The cost of being apart from a force.

    Args:
        vertical: Under the right foot over the whole cycle from the gait's first knot, shape
            (2 N,) [body weights]; the left foot's is the same half a cycle later.
    """
    right, left = np.split(np.asarray(vertical, dtype=float), 2)
    return ForceApart(measured=tuple(zip(right.tolist(), left.tolist(), strict=True)))
