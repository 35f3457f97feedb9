"""One step of a walk, and where the simulation keeps what it is made of."""

from __future__ import annotations

from typing import NamedTuple

import mujoco

from walking_irl.arrays import Array


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
