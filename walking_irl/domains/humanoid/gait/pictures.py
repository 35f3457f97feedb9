"""Pictures of a gait: strips of frames over one cycle, without a screen."""

from __future__ import annotations

import contextlib
import importlib
import os
import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.gait.gait import Gait, whole_cycle
from walking_irl.errors import InvalidInputError, WalkingIRLError

Image = NDArray[np.uint8]

SIDE, FRONT, OBLIQUE = (90.0, -6.0), (180.0, -6.0), (140.0, -12.0)
"""Azimuth and elevation of the camera [deg]."""
LOOK_AT_HEIGHT, CAMERA_DISTANCE = 0.90, 2.55  # [m]
OVERSAMPLING = 2
LOOK_GROUP = 2
CONTEXT_MODULE = "mujoco.rendering.classic.gl_context"
LEG = ("thigh", "shank", "foot")


def strip(
    walker: Walker, gait: Gait, *, height: int = 520, width: int = 270, path: Path | None = None
) -> Image:
    """Eight frames of a gait cycle from the side; below, four from the front and four obliquely.

    Args:
        walker: Who walks.
        gait: What is walked.
        height: Of one frame [pixels].
        width: Of one frame [pixels].
        path: PNG file to write, if any.

    Returns:
        Picture, shape (2 height, 8 width, 3).

    Raises:
        InvalidInputError: If a frame has no pixels.
        WalkingIRLError: If pictures cannot be drawn on this machine; it names what to install.
    """
    if min(height, width) < 1:
        raise InvalidInputError(f"a frame needs height and width >= 1, got {height} x {width}")
    q = whole_cycle(gait, walker.mirror)
    eight = [q[i] for i in np.linspace(0, len(q), 8, endpoint=False).astype(int)]
    four = [q[i] for i in np.linspace(0, len(q), 4, endpoint=False).astype(int)]
    views = [(p, SIDE) for p in eight] + [(p, FRONT) for p in four] + [(p, OBLIQUE) for p in four]
    frames = photograph(walker, views, height=height, width=width)
    picture = np.vstack([np.hstack(frames[:8]), np.hstack(frames[8:])])
    if path is not None:
        write_png(picture, path)
    return picture


def photograph(
    walker: Walker,
    views: list[tuple[Array, tuple[float, float]]],
    *,
    height: int = 520,
    width: int = 270,
    distance: float = CAMERA_DISTANCE,
    look_at: float = LOOK_AT_HEIGHT,
) -> list[Image]:
    """Pictures of postures.

    Args:
        walker: Whom to draw.
        views: Posture (nv,) and the camera's azimuth and elevation [deg], for each picture.
        height: Of a picture [pixels].
        width: Of a picture [pixels].
        distance: Of the camera from the walker [m].
        look_at: Height at which the camera looks [m].
    """
    model, data = walker.model, mujoco.MjData(walker.model)
    side = walker.joints.index("root_y") if "root_y" in walker.joints else None
    option = mujoco.MjvOption()
    option.geomgroup[:] = [1, 1, 1, 0, 0, 0]
    option.sitegroup[:] = 0
    frames = []
    renderer = open_renderer(model, height * OVERSAMPLING, width * OVERSAMPLING)
    with renderer:
        for q, (azimuth, elevation) in views:
            data.qpos[:] = q
            mujoco.mj_kinematics(model, data)
            mujoco.mj_camlight(model, data)
            camera = mujoco.MjvCamera()
            camera.lookat[:] = [q[0], 0 if side is None else q[side], look_at]
            camera.distance, camera.azimuth, camera.elevation = distance, azimuth, elevation
            renderer.update_scene(data, camera, option)
            frames.append(shrink(renderer.render()))
    return frames


def write_png(picture: Image, path: Path) -> None:
    """Write a picture (height, width, 3)."""
    from PIL import Image as pillow

    pillow.fromarray(picture).save(path)


def drawn_leg_distance(walker: Walker, gait: Gait) -> float:
    """Smallest distance between the drawn right and left leg over a cycle [m]; negative: overlap.

    Feet, shanks and thighs are looked at, but not the hips, which one pair of shorts covers.
    """
    model, data = walker.model, mujoco.MjData(walker.model)
    right, left = (_leg_geoms(walker, s) for s in "rl")
    closest = np.inf
    for q in whole_cycle(gait, walker.mirror):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        for a in right:
            for b in left:
                centres = np.linalg.norm(data.geom_xpos[a] - data.geom_xpos[b])
                if centres - model.geom_rbound[a] - model.geom_rbound[b] < min(closest, 0.3):
                    gap = mujoco.mj_geomDistance(model, data, a, b, 0.3, None)
                    closest = min(closest, gap)
    return float(closest)


def sole_heights(walker: Walker, gait: Gait) -> Array:
    """Height of the lowest drawn point of either shoe above the floor, per knot [m]; (2 N,)."""
    model, data = walker.model, mujoco.MjData(walker.model)
    shoes = [i for s in "rl" for i in _leg_geoms(walker, s, ("foot",))]
    floor, heights = model.geom("floor").id, []
    for q in whole_cycle(gait, walker.mirror):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        heights.append(min(mujoco.mj_geomDistance(model, data, i, floor, 1.0, None) for i in shoes))
    return np.array(heights)


def _leg_geoms(walker: Walker, side: str, segments: tuple[str, ...] = LEG) -> list[int]:
    model = walker.model
    bodies = {model.body(f"{s}_{side}").id for s in segments}
    return [
        i
        for i in range(model.ngeom)
        if model.geom_group[i] == LOOK_GROUP and int(model.geom_bodyid[i]) in bodies
    ]


def open_renderer(model: mujoco.MjModel, height: int, width: int) -> Any:
    """MuJoCo's renderer without a screen, for frames of that many pixels.

    Raises:
        InvalidInputError: If a frame is larger than the model's buffer.
        WalkingIRLError: If pictures cannot be drawn on this machine; it names what to install.
    """
    glob = model.vis.global_
    if height > glob.offheight or width > glob.offwidth:
        raise InvalidInputError(
            f"a frame of {height // OVERSAMPLING} x {width // OVERSAMPLING} pixels is too large; "
            f"at most {glob.offheight // OVERSAMPLING} x {glob.offwidth // OVERSAMPLING}"
        )
    try:
        _choose_headless_opengl()
        return mujoco.Renderer(model, height, width)
    except Exception as e:  # each OpenGL binding fails in its own way
        raise WalkingIRLError(
            "cannot draw without OpenGL: install libegl1 (set MUJOCO_GL=egl) or libosmesa6 "
            f"(set MUJOCO_GL=osmesa); MUJOCO_GL is {os.environ.get('MUJOCO_GL') or 'unset'}, "
            f"and it says: {e}"
        ) from e


def _choose_headless_opengl() -> None:
    """Without a screen, and unless MUJOCO_GL says otherwise, draw with EGL, else with OSMesa.

    MuJoCo decides when it is imported, and then for a screen: too early to know that there is none.
    """
    variables = ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY")
    if not sys.platform.startswith("linux") or any(os.environ.get(v) for v in variables):
        return
    for name in ("egl", "osmesa"):
        with contextlib.suppress(ImportError, AttributeError, OSError, RuntimeError):
            binding = importlib.import_module(f"mujoco.{name}")
            importlib.import_module(CONTEXT_MODULE).GLContext = binding.GLContext  # type: ignore
            return


def shrink(picture: Image) -> Image:
    """Mean over blocks of pixels: smooth edges also where OpenGL has no multisampling."""
    h, w = (n // OVERSAMPLING for n in picture.shape[:2])
    blocks = picture.reshape(h, OVERSAMPLING, w, OVERSAMPLING, 3)
    return np.asarray(np.rint(blocks.mean((1, 3))), dtype=np.uint8)
