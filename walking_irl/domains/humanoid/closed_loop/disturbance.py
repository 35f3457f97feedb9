"""What disturbs a walk: noise at its start, velocity perturbations, pushes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

PUSH_DURATION = 0.1  # [s]


class Push(NamedTuple):
    """A force on the pelvis from ``time`` [s] on, for PUSH_DURATION; (x, y, z) [N]."""

    time: float
    force: tuple[float, float, float]


@dataclass(frozen=True)
class Disturbance:
    """What keeps a walk from repeating itself.

    Attributes:
        velocity_noise: Standard deviation of the joints' velocities at the start [rad/s].
        kicks: The same of changes of velocity at one random step of every gait cycle [rad/s].
        push: A push against the pelvis.
    """

    velocity_noise: float = 0.0
    kicks: float = 0.0
    push: Push | None = None
