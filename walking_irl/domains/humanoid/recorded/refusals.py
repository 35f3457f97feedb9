"""Which recordings are not walks of a kind that the model has: one sentence each."""

from __future__ import annotations

import numpy as np

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.recorded.axes import Motion
from walking_irl.domains.humanoid.recorded.cycle import Fit
from walking_irl.domains.humanoid.recorded.feet import duty, feet_of, flight
from walking_irl.domains.humanoid.recorded.samples import Samples
from walking_irl.errors import InvalidInputError

STANDS = 12.0  # range of hips and knees below which nobody walks [deg]
TORN = 200.0  # [deg]
LEAST_STEP = 0.05  # [m]
RUN_STEP, RUN_SPEED = 0.36, 1.9  # [s], [m/s]
RUN_DUTY, JOG_SPEED, RUN_FLIGHT = 0.5, 1.5, 0.15


def check_moves(m: Motion, walker: Walker) -> None:
    """Refuse who stands.

    Raises:
        InvalidInputError: If hips and knees hardly move, or more than joints can.
    """
    names = [f"{j}_{s}" for j in ("hip_flexion", "knee") for s in "rl"]
    columns = m.q[m.is_whole][:, [walker.joints.index(n) for n in names]]
    ranges = np.rad2deg(np.ptp(np.percentile(columns, (2, 98), axis=0), axis=0))
    if ranges.max() < STANDS:
        raise InvalidInputError(
            f"the person stands: hips and knees move by {ranges.max():.0f} degrees at most"
        )
    largest = float(np.rad2deg(np.abs(columns)).max())
    if largest > TORN:
        raise InvalidInputError(
            f"hips or knees reach {largest:.0f} degrees: these are not "
            "joint angles in the unit that the file states"
        )


def check_walks(fit: Fit, T: float, s: Samples, walker: Walker) -> None:
    """Refuse who goes backwards, marches on the spot or runs.

    Args:
        fit: The cycle that was fitted, in the model's size.
        T: Half period of the person [s].
        s: The samples.
        walker: Whose body.

    Raises:
        InvalidInputError: If so.
    """
    length = fit.step_length / s.scale
    if length < -LEAST_STEP:
        raise InvalidInputError(f"the walk goes backwards: {length:.2f} m a step")
    if length < LEAST_STEP:
        raise InvalidInputError(f"the person does not go forward: {length:.2f} m a step")
    speed = length / T
    cycle = feet_of(walker, fit.at(np.arange(100) / 100))
    flying = flight(s.motion.q[:, 2], s.feet) if s.motion.has_height else 0.0
    is_run = T < RUN_STEP and speed > RUN_SPEED
    is_run |= speed > JOG_SPEED and (duty(cycle) < RUN_DUTY or flying > RUN_FLIGHT)
    if is_run:
        raise InvalidInputError(
            f"looks like running: {speed:.2f} m/s at {60 / T:.0f} steps/min; the model only walks"
        )
