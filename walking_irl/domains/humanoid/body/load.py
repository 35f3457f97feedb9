"""Bodies by name, or from a model file of your own.

Your own MJCF must keep the names of joints, motors and sensors of a shipped body (all of the 3-D
or all of the planar one); masses, lengths, strengths, springs and contacts are yours. Without gaits
of its own it starts from the shipped ones (:mod:`~.gait.library`).
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import mujoco
import numpy as np

from walking_irl.domains.humanoid.body.anatomy import (
    POSITION_SENSORS,
    Walker,
    other_side,
    walker_of,
)
from walking_irl.domains.humanoid.body.variants import model_of, parted, variant
from walking_irl.errors import InvalidInputError, reason
from walking_irl.files import model_path

SHIPPED = {"humanoid": "humanoid.xml", "humanoid-planar": "humanoid_planar.xml"}
"""Model files of the shipped bodies."""
SENSORS = (
    *(f"{p}_{s}" for p in (*POSITION_SENSORS[:-1], "touch") for s in "rl"),
    *("com", "head_acceleration", "trunk_velocity", "trunk_axis", "angular_momentum"),
)
"""What every body must measure."""
ROOT = ("root_x", "root_z", "root_pitch")
"""Unactuated joints that every body has, the first one first."""


def load_walker(body: str | Path = "humanoid") -> Walker:
    """A shipped body by name, or the body of a model file; one object per process.

    Args:
        body: "humanoid", "humanoid-planar", or the path of an MJCF file; any of them in other
            surroundings (:mod:`~.variants`).

    Raises:
        InvalidInputError: If there is no such body, or its model is not one that can walk here.

    >>> load_walker().joints[6]
    'lumbar_flexion'
    """
    return _load(body_of(body))


def body_of(body: str | Path) -> str:
    """A body as text that names it in every process: a shipped name, or an absolute path.

    Raises:
        InvalidInputError: If there is no such body.
    """
    body, around = parted(str(body))
    if body in SHIPPED:
        return variant(body, around)
    if not Path(body).is_file():
        raise InvalidInputError(
            f"there is no body {body!r}; choose from {', '.join(SHIPPED)} or give the path of "
            "an MJCF file"
        )
    return variant(str(Path(body).resolve()), around)


@lru_cache
def _load(body: str) -> Walker:
    own, around = parted(body)
    path = model_path(SHIPPED[own]) if own in SHIPPED else Path(own)
    try:
        model = model_of(path, around)
    except ValueError as error:
        raise InvalidInputError(f"{path} is not a readable MJCF file: {reason(error)}") from error
    _check(model, path)
    walker = walker_of(model, body, path.stem)
    if own == body:
        return walker
    return replace(walker, mass=_load(own).mass, weight=_load(own).weight)


def _check(model: mujoco.MjModel, path: Path) -> None:
    """Refuse a model that the gait's mathematics would misread."""
    joints = [model.joint(i).name for i in range(model.njnt)]
    sensors = [model.sensor(i).name for i in range(model.nsensor)]
    n_root = model.nv - model.nu
    kinds = (mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE)
    if not np.isin(model.jnt_type, kinds).all():
        raise InvalidInputError(f"{path}: all joints must be slides or hinges")
    missing = [f"joint {j}" for j in ROOT if j not in joints]
    missing += [f"joint {other_side(j)}" for j in joints if other_side(j) not in joints]
    missing += [f"sensor {s}" for s in SENSORS if s not in sensors]
    if missing:
        raise InvalidInputError(f"{path} needs the names of a shipped body; it has no {missing[0]}")
    if joints[0] != ROOT[0] or not set(ROOT) <= set(joints[:n_root]):
        raise InvalidInputError(f"{path}: the first joints must be the root's, {ROOT[0]} first")
    driven = np.array_equal(model.actuator_trnid[:, 0], np.arange(n_root, model.nv))
    if not driven or not (model.actuator_gear[:, 0] == 1).all():
        raise InvalidInputError(
            f"{path}: every joint but the root's needs one motor of gear 1, in the joints' order"
        )
    if not (model.actuator_ctrlrange * [-1, 1] > 0).all():
        raise InvalidInputError(f"{path}: every motor needs a ctrlrange from below 0 to above 0")
