"""Where a walk starts, one step of it, and where the simulation keeps what it is made of."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from walking_irl.arrays import Array, Indices


class Start(NamedTuple):
    """Where a walk begins, and the gait that it follows.

    ``q`` [m, rad] and ``v`` [m/s, rad/s] have shape (nv,); ``timestep`` [s] is the simulation's,
    ``period`` [s] the duration of a gait cycle, ``speed`` [m/s] the gait's.
    """

    q: Array
    v: Array
    timestep: float
    period: float
    speed: float


class Step(NamedTuple):
    """One step of a walk: state and sensors at its start, torque and acceleration during it."""

    q: Array
    v: Array
    a: Array
    u: Array
    sensors: Array


class Views(NamedTuple):
    """What a step reads of the simulation and writes to it: to look one up takes a microsecond."""

    q: Array
    v: Array
    sensors: Array
    torque: Array
    ctrl: Array

    @classmethod
    def of(cls, data: mujoco.MjData) -> Views:
        """Views that hold as long as the data live."""
        return cls(data.qpos, data.qvel, data.sensordata, data.actuator_force, data.ctrl)


def runs(indices: Indices) -> list[slice]:
    """Increasing indices as slices, which NumPy reads faster."""
    parts = np.split(indices, np.flatnonzero(np.diff(indices) != 1) + 1)
    return [slice(int(part[0]), int(part[-1]) + 1) for part in parts]
