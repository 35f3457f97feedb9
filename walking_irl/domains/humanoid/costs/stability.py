"""Stability: a calm head and trunk, and little angular momentum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.costs.base import Cost, Term, read_sensors

HEAD = (
    ("head_acceleration", 0),
    ("head_acceleration", 1),
    ("trunk_velocity", 0),
    ("trunk_velocity", 1),
    ("trunk_velocity", 2),
    ("trunk_axis", 0),
    ("trunk_axis", 1),
)
HEAD_UNITS = (8.5, 1.1, 0.3, 1.0, 0.5, 0.14, 0.092)
"""Head acceleration fore-aft and lateral [m/s^2], trunk angular velocity [rad/s], tilt [rad]."""
MOMENTUM = (("angular_momentum", 0), ("angular_momentum", 1), ("angular_momentum", 2))
MOMENTUM_UNITS = (1.6, 6.4, 1.0)
"""Roll, pitch and yaw about the centre of mass [kg m^2/s]."""
HEAD_SHARE, MOMENTUM_SHARE = 0.5 / 0.04, 0.5 / 0.06


@dataclass(frozen=True)
class Stability(Cost):
    """Shaking of the head and trunk, and angular momentum about the centre of mass."""

    name: str = "stability"
    unit: str = "1"
    scale: float = 3.0
    meaning: str = "Shaking of the head and trunk, and angular momentum about the centre of mass."
    formula: str = "|head|^2 / .08 + |balance|^2 / .12"
    reference: float | None = 0.2144
    planar_reference: float | None = 0.08204

    def terms(self, walker: Walker) -> Sequence[Term]:
        """One residual a component that shakes."""
        head = np.sqrt(HEAD_SHARE) / np.array(HEAD_UNITS)
        momentum = np.sqrt(MOMENTUM_SHARE) / np.array(MOMENTUM_UNITS)
        scale = np.concatenate([head, momentum])

        def residual(s: Any) -> Any:
            return s * scale

        reads = (read_sensors(walker, "s", HEAD + MOMENTUM),)
        return [Term(reads, residual, is_linear=True, first=lambda s: (scale,))]
