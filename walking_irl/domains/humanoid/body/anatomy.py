"""A walker's body and the linear map that swaps its sides.

Mirroring at the sagittal plane turns a walk into a walk: joint positions map by ``mirror``, sensor
readings by ``sensor_mirror``. Everything is read from the model by names of joints and sensors; the
numbers of the shipped body live in ``models/humanoid.xml`` only.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray

from walking_irl.arrays import Array

TORQUE_MARGIN = 1.5
"""Torques are clipped at this multiple of the strengths: the actuators' control range, less what it
takes to let go of a tendon that is stretched to LET_GO."""
LET_GO = np.deg2rad(5.0)
"""Angle up to which a motor overcomes its joint's tendon, with all its strength to spare [rad]."""

FLIPPED_JOINTS = (
    "root_y",
    "root_yaw",
    "root_roll",
    "lumbar_bend",
    "lumbar_rotation",
)
"""Joints of the middle of the body that change sign in the mirror."""
AXIAL_SENSORS = ("trunk_velocity", "angular_momentum")
"""Sensors that read an axial vector, whose x and z change sign in the mirror."""
POSITION_SENSORS = ("heel", "ball", "toe", "ankle", "knee", "com")
"""Sensors that read a point of the body in the world, so that move on with every step."""


@dataclass(frozen=True, eq=False)
class Walker:
    """A walking body: the model and what the gait's mathematics needs to know of it.

    Attributes:
        body: What :func:`~.body.load.load_walker` loads it by: a shipped name, or a path.
        name: Name of its model file, without ending.
        model: Shared MuJoCo model; copy it before you change its options.
        joints: Names of all joints, in the order of qpos and qvel.
        n_root: How many of the joints, the first ones, are unactuated (6, planar 3).
        mirror: S, swaps the sides of joint positions and velocities, shape (nv, nv); S S = 1.
        strength_plus: Strength of each motor in the positive direction [Nm], shape (nu,).
        strength_minus: The same in the negative direction, as positive numbers.
        lower: Lower joint limits [rad], -inf where there is none, shape (nv,).
        upper: Upper joint limits [rad], +inf where there is none, shape (nv,).
        mass: Whole body [kg].
        weight: Whole body [N].
        sensor: Where each sensor's numbers are among ``sensordata``.
        sensor_mirror: Swaps the sides of sensor readings, shape (ns, ns).
        sensor_advance: 1 where a sensor reads an x position, which moves on with the steps; (ns,).
    """

    body: str
    name: str
    model: mujoco.MjModel
    joints: tuple[str, ...]
    n_root: int
    mirror: Array
    strength_plus: Array
    strength_minus: Array
    lower: Array
    upper: Array
    mass: float
    weight: float
    sensor: Mapping[str, slice]
    sensor_mirror: Array
    sensor_advance: Array

    @property
    def is_lateral(self) -> bool:
        """Whether it can leave the sagittal plane."""
        return "root_y" in self.joints

    @cached_property
    def reads_position(self) -> NDArray[np.bool_]:
        """Whether a sensor's number is a coordinate of a point in the world, shape (ns,)."""
        return np.repeat(
            [_stem(name) in POSITION_SENSORS for name in self.sensor],
            [rows.stop - rows.start for rows in self.sensor.values()],
        )

    @cached_property
    def tendon_stiffness(self) -> Array:
        """Cubic part k3 of each driven joint's stiffness [Nm/rad^3], shape (nu,)."""
        return _constant(np.array(self.model.jnt_stiffnesspoly[self.n_root :, 1]))

    @property
    def torque_mirror(self) -> Array:
        """Swaps the sides of joint torques, shape (nu, nu)."""
        return self.mirror[self.n_root :, self.n_root :]

    def model_at(self, timestep: float) -> mujoco.MjModel:
        """Copy of the model for a simulation with this timestep [s]."""
        model = copy.copy(self.model)
        model.opt.timestep = timestep
        return model


def walker_of(model: mujoco.MjModel, body: str, name: str) -> Walker:
    """The walker of a model; its joints and sensors must have the shipped bodies' names."""
    joints = tuple(model.joint(i).name for i in range(model.njnt))
    sensor = {
        model.sensor(i).name: slice(int(adr), int(adr + model.sensor_dim[i]))
        for i, adr in enumerate(model.sensor_adr)
    }
    limited = model.jnt_limited.astype(bool)
    mass = float(mujoco.mj_getTotalmass(model))
    tendon = _tendon_torque(model)
    upper = model.actuator_ctrlrange[:, 1] + np.minimum(tendon, 0)
    lower = model.actuator_ctrlrange[:, 0] + np.maximum(tendon, 0)
    return Walker(
        body=body,
        name=name,
        model=model,
        joints=joints,
        n_root=model.nv - model.nu,
        mirror=_constant(_joint_mirror(joints)),
        strength_plus=_constant(upper / TORQUE_MARGIN),
        strength_minus=_constant(-lower / TORQUE_MARGIN),
        lower=_constant(np.where(limited, model.jnt_range[:, 0], -np.inf)),
        upper=_constant(np.where(limited, model.jnt_range[:, 1], np.inf)),
        mass=mass,
        weight=mass * float(-model.opt.gravity[2]),
        sensor=sensor,
        sensor_mirror=_constant(_sensor_mirror(sensor)),
        sensor_advance=_constant(_sensor_advance(sensor)),
    )


def _tendon_torque(model: mujoco.MjModel) -> Array:
    """Torque of the tendons (cubic stiffness) at the angle LET_GO [Nm], shape (nu,)."""
    hinges = slice(model.nv - model.nu, None)
    stretch = LET_GO - model.qpos_spring[hinges]
    return np.asarray(-model.jnt_stiffnesspoly[hinges, 1] * stretch**3)


def lowest_points(walker: Walker, q: Array) -> Array:
    """Height of the lowest contact sphere in each posture (n, nv), shape (n,) [m]."""
    model, data = walker.model, mujoco.MjData(walker.model)
    spheres = np.nonzero(model.geom_conaffinity == 1)[0]
    out = np.empty(len(q))
    for k, row in enumerate(q):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        out[k] = np.min(data.geom_xpos[spheres, 2] - model.geom_size[spheres, 0])
    return out


def other_side(name: str) -> str:
    """Name of the same part of the other side of the body.

    >>> other_side("knee_r"), other_side("lumbar_bend")
    ('knee_l', 'lumbar_bend')
    """
    swap = {"_r": "_l", "_l": "_r"}
    return name[:-2] + swap[name[-2:]] if name[-2:] in swap else name


def _constant(x: Array) -> Array:
    x = np.ascontiguousarray(x)
    x.setflags(write=False)
    return x


def _joint_mirror(joints: tuple[str, ...]) -> Array:
    mirror = np.zeros((len(joints), len(joints)))
    for i, name in enumerate(joints):
        mirror[i, joints.index(other_side(name))] = -1 if name in FLIPPED_JOINTS else 1
    return mirror


def _sensor_mirror(sensor: Mapping[str, slice]) -> Array:
    mirror = np.zeros((_size(sensor), _size(sensor)))
    for name, rows in sensor.items():
        n = rows.stop - rows.start
        sign = [-1, 1, -1] if name in AXIAL_SENSORS else [1, -1, 1][:n]
        mirror[rows, sensor[other_side(name)]] = np.diag(sign)
    return mirror


def _sensor_advance(sensor: Mapping[str, slice]) -> Array:
    advance = np.zeros(_size(sensor))
    for name, rows in sensor.items():
        if _stem(name) in POSITION_SENSORS:
            advance[rows.start] = 1
    return advance


def _stem(name: str) -> str:
    """Name without its side."""
    return name.removesuffix("_r").removesuffix("_l")


def _size(sensor: Mapping[str, slice]) -> int:
    return int(max(rows.stop for rows in sensor.values()))
