"""Where the model's feet are in a recording: size, belt speed, stance, and whether it is a run."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker

SOLE_PARTS = ("heel", "ball", "toe")
FLOOR = 20  # percentile of the lowest sole point's height that counts as the floor
FLIGHT = 0.04  # of the lowest sole point above the floor [m]


class Feet(NamedTuple):
    """Points of the feet relative to the hips' midpoint, x forward, for n rows.

    ``heel``, ``toe``, ``ankle`` have shape (n, 2, 3), right foot first; ``soles`` (n, m, 3) are
    the lowest points of all m contact spheres [m].
    """

    heel: Array
    toe: Array
    ankle: Array
    soles: Array

    @property
    def below(self) -> Array:
        """Height of the hips above the lowest sole point, shape (n,) [m]."""
        return np.asarray(-self.soles[:, :, 2].min(1))


def feet_of(walker: Walker, q: Array) -> Feet:
    """The model's feet for joint positions, shape (n, nv)."""
    model, data = walker.model, mujoco.MjData(walker.model)
    names = ("heel", "toe", "ankle")
    sites = [[model.site(f"{part}_{s}").id for s in "rl"] for part in names]
    spheres = [
        i
        for i in range(model.ngeom)
        if model.geom(i).name.split("_")[0] in SOLE_PARTS
        and model.geom_type[i] == mujoco.mjtGeom.mjGEOM_SPHERE
    ]
    radius = model.geom_size[spheres, 0]
    points = np.empty((3, len(q), 2, 3))
    soles = np.empty((len(q), len(spheres), 3))
    for k, row in enumerate(q):
        data.qpos[:] = row
        data.qpos[:3] = 0.0
        mujoco.mj_kinematics(model, data)
        hips = data.xpos[model.body("pelvis").id]
        points[:, k] = data.site_xpos[sites] - hips
        soles[k] = data.geom_xpos[spheres] - hips
        soles[k, :, 2] -= radius
    return Feet(points[0], points[1], points[2], soles)


def hips_height(walker: Walker) -> float:
    """Height of the hips of the upright model [m]; its root's z counts from there."""
    return float(walker.model.body("pelvis").pos[2])


def belt_speed(time: Array, hips: Array, feet: Feet) -> float:
    """Velocity of the floor along the walk [m/s]: of the sole point that carries, the lowest one.

    Args:
        time: At equal steps, shape (n,) [s].
        hips: How far the hips have gone, in the model's size, shape (n,) [m].
        feet: Their points.
    """
    low = feet.soles[:, :, 2].argmin(1)
    speed = np.gradient(feet.soles[:, :, 0], time, axis=0)[np.arange(len(time)), low]
    return float(np.median(np.gradient(hips, time) + speed))


def duty(feet: Feet) -> float:
    """Share of a whole cycle during which a foot goes backwards under the body.

    Args:
        feet: Over one whole cycle at equal steps.
    """
    shares = []
    for side in range(2):
        first, last = int(feet.heel[:, side, 0].argmax()), int(feet.toe[:, side, 0].argmin())
        shares.append(((last - first) % len(feet.heel)) / len(feet.heel))
    return float(np.mean(shares))


def flight(heights: Array, feet: Feet) -> float:
    """Share of rows during which no sole point is near the floor.

    Args:
        heights: Of the hips in the model's size, shape (n,) [m].
        feet: Their points.
    """
    lowest = heights - feet.below
    return float(np.mean(lowest > np.percentile(lowest, FLOOR) + FLIGHT))
