"""The visible geoms of a MuJoCo model as static Rerun archetypes, one batch per body and kind."""

from __future__ import annotations

from collections import defaultdict

import mujoco
import numpy as np
import rerun as rr

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.recording.style import with_alpha

VISIBLE_GROUP = 2
"""Geoms of this group are the body that people see; all others are physics."""


def wxyz_to_xyzw(quaternion: Array) -> Array:
    """MuJoCo's order of a quaternion's numbers to Rerun's.

    >>> wxyz_to_xyzw(np.array([1.0, 0.0, 0.0, 0.0]))
    array([0., 0., 0., 1.])
    """
    return quaternion[..., [1, 2, 3, 0]]


def body_names(model: mujoco.MjModel) -> dict[int, str]:
    """Names of the moving bodies by their index."""
    return {b: model.body(b).name or f"body_{b}" for b in range(1, model.nbody)}


def visible_geoms(model: mujoco.MjModel) -> list[int]:
    """Geoms to draw: those of moving bodies in group 2, or all of them where that is empty."""
    moving = [g for g in range(model.ngeom) if model.geom_bodyid[g] > 0]
    return [g for g in moving if model.geom_group[g] == VISIBLE_GROUP] or moving


def log_body(
    stream: rr.RecordingStream,
    model: mujoco.MjModel,
    root: str,
    tint: tuple[int, int, int, int] | None = None,
) -> None:
    """Log the geometry of every body under ``root/<body>/<kind>``, once and for all.

    Args:
        stream: Where to.
        model: Whose geoms.
        root: Entity path above the bodies.
        tint: One colour with opacity for the whole body, instead of its own colours.

    Raises:
        InvalidInputError: If a visible geom is of a kind that cannot be drawn.
    """
    names = body_names(model)
    batches: dict[tuple[int, str], list[int]] = defaultdict(list)
    for g in visible_geoms(model):
        batches[int(model.geom_bodyid[g]), _kind(model, g)].append(g)
    for (body, kind), geoms in batches.items():
        shape = _archetype(model, kind, geoms, tint)
        stream.log(f"{root}/{names[body]}/{kind}", shape, static=True)


def _kind(model: mujoco.MjModel, g: int) -> str:
    kinds = {
        mujoco.mjtGeom.mjGEOM_CAPSULE: "capsules",
        mujoco.mjtGeom.mjGEOM_SPHERE: "ellipsoids",
        mujoco.mjtGeom.mjGEOM_ELLIPSOID: "ellipsoids",
        mujoco.mjtGeom.mjGEOM_BOX: "boxes",
        mujoco.mjtGeom.mjGEOM_CYLINDER: "cylinders",
    }
    kind = mujoco.mjtGeom(int(model.geom_type[g]))
    if kind not in kinds:
        raise InvalidInputError(
            f"cannot draw geom {model.geom(g).name!r} of kind {kind.name}; "
            f"expected {', '.join(sorted(set(kinds.values())))}"
        )
    return kinds[kind]


def _archetype(
    model: mujoco.MjModel, kind: str, geoms: list[int], tint: tuple[int, int, int, int] | None
) -> rr.Capsules3D | rr.Ellipsoids3D | rr.Boxes3D | rr.Cylinders3D:
    size, position = model.geom_size[geoms], model.geom_pos[geoms]
    style = {
        "quaternions": wxyz_to_xyzw(model.geom_quat[geoms]),
        "colors": [tint or _colour(model, g) for g in geoms],
        "fill_mode": "solid",
    }
    if kind == "capsules":  # Rerun's start at the local origin and run along +z
        start = np.array([_end_of_capsule(model, g) for g in geoms])
        return rr.Capsules3D(lengths=2 * size[:, 1], radii=size[:, 0], translations=start, **style)
    if kind == "cylinders":
        return rr.Cylinders3D(lengths=2 * size[:, 1], radii=size[:, 0], centers=position, **style)
    if kind == "boxes":
        return rr.Boxes3D(half_sizes=size, centers=position, **style)
    is_sphere = model.geom_type[geoms] == mujoco.mjtGeom.mjGEOM_SPHERE
    return rr.Ellipsoids3D(
        half_sizes=np.where(is_sphere[:, None], size[:, :1], size), centers=position, **style
    )


def _end_of_capsule(model: mujoco.MjModel, g: int) -> Array:
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.geom_quat[g])
    end: Array = model.geom_pos[g] - rotation.reshape(3, 3)[:, 2] * model.geom_size[g, 1]
    return end


def _colour(model: mujoco.MjModel, g: int) -> tuple[int, int, int, int]:
    """A geom's own colour, or its material's where only that has one (as MuJoCo draws it)."""
    material = int(model.geom_matid[g])
    default = np.array([0.5, 0.5, 0.5, 1.0], dtype=np.float32)
    rgba = model.geom_rgba[g]
    if material >= 0 and np.array_equal(rgba, default):
        rgba = model.mat_rgba[material]
    r, g_, b = (round(255 * float(c)) for c in np.clip(rgba[:3], 0, 1))
    return with_alpha((r, g_, b), float(rgba[3]))
