"""Which way is up, where the walk goes, and whether the floor moves: a recording in model's axes.

OpenSim: x forward, y up, z to the right; its pelvis turns about its own z (tilt), x (list), y
(rotation). The model: x forward, y to the left, z up; its root turns about z (yaw), x (roll), y
(pitch). Laboratories put the walk anywhere, in any direction, with any axis up.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.recorded.naming import SIDED, Channels
from walking_irl.errors import InvalidInputError

Mask = NDArray[np.bool_]
TO_MODEL = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], dtype=float)
"""OpenSim's vectors in the model's axes."""
HIPS_IN_PELVIS = np.array([-0.0635, -0.0723, 0.0])
"""Midpoint of the hips in OpenSim's pelvis, mean of gait2392 and Rajagopal [m]."""
Z_TO_Y = Rotation.from_euler("X", -np.pi / 2)
"""Turns a laboratory whose z is up into OpenSim's."""
HEIGHTS = (0.4, 1.6)  # of a pelvis above the floor [m]
MOST_ANGLE, MOST_WAY = 100.0, 1e5  # [rad], [m]; more is a gap of the tracking
BOBS = 0.3  # most that it does so [m]
TURNING = np.deg2rad(12.0)  # [rad/s]
STEADY = 0.85  # of the 90th percentile of the speed
WALKS = 0.3  # slower than this, a pelvis stays where it is [m/s]
BACKWARDS = 60.0  # between the pelvis's direction and the way's [deg]
SMOOTHED = 1.1  # window of direction and speed [s]


@dataclass(frozen=True)
class Motion:
    """A recording in the model's joints.

    Attributes:
        time: Shape (n,) [s], increasing.
        q: Joint positions, shape (n, nv) [m, rad]; the root's are the hips' midpoint.
        has_height: Whether the height of the hips above the floor is known.
        has_path: Whether the file says where the pelvis goes.
        is_whole: Rows without a gap, shape (n,).
        heading: Direction of the walk in the laboratory [deg].
        notes: What was decided, a sentence each.
    """

    time: Array
    q: Array
    has_height: bool
    has_path: bool
    is_whole: Mask
    heading: float = 0.0
    notes: tuple[str, ...] = field(default=())


def motion_of(c: Channels, walker: Walker, hips_height: float, size: float = 1.0) -> Motion:
    """Channels as the model's joints.

    Args:
        c: What the file says.
        walker: Whose joints.
        hips_height: Of the model standing upright [m]; its own files count from there.
        size: Of the person relative to OpenSim's models.
    """
    notes = list(c.notes)
    q = np.zeros((len(c.time), len(walker.joints)))
    at = {j: i for i, j in enumerate(walker.joints)}
    if c.convention == "own":
        for name, column in c.angles.items():
            q[:, at[name]] = column
        q[:, at["root_z"]] += hips_height
        return Motion(c.time, q, True, True, np.isfinite(q).all(1) & np.isfinite(c.time))
    zero = np.zeros(len(c.time))
    for angle, joint in SIDED.items():
        for side in "rl":
            q[:, at[f"{joint}_{side}"]] = c.angles.get(f"{angle}_{side}", zero)
    pelvis = _pelvis(c)
    path = np.column_stack([c.path.get(f"pelvis_t{a}", zero) for a in "xyz"])
    is_near = np.abs(np.nan_to_num(path, nan=np.inf)) < MOST_WAY
    path = np.where(is_near, path, np.nan)
    pelvis, path, has_height = _upright(pelvis, path, "pelvis_ty" in c.path, notes)
    root = pelvis.as_matrix()
    angles = Rotation.from_matrix(TO_MODEL @ root @ TO_MODEL.T).as_euler("ZXY")
    is_whole = np.isfinite(q).all(1) & is_near.all(1) & np.isfinite(c.time)
    path = np.nan_to_num(path)  # gaps do not count
    q[:, 3:6] = np.column_stack([np.unwrap(angles[:, 0]), angles[:, 1:]])
    q[:, :3] = (path + size * pelvis.apply(HIPS_IN_PELVIS)) @ TO_MODEL.T
    q[:, [at[f"lumbar_{n}"] for n in ("flexion", "bend", "rotation")]] = _trunk(c, zero)
    for column in c.angles.values():
        is_whole &= np.abs(np.nan_to_num(column, nan=np.inf)) < MOST_ANGLE
    has_path = "pelvis_tx" in c.path or "pelvis_tz" in c.path
    return Motion(c.time, q, has_height, has_path, is_whole, notes=tuple(notes))


def _pelvis(c: Channels) -> Rotation:
    """Orientation of the pelvis in OpenSim's axes; gaps stand upright (and do not count)."""

    def get(name: str) -> Array:
        return np.nan_to_num(c.angles.get(name, np.zeros(len(c.time))))

    if c.convention == "clinical":
        tilt, side, turn = -get("pelvis_tilt"), -get("pelvis_obliquity"), get("pelvis_rotation")
        model = Rotation.from_euler("ZXY", np.column_stack([turn, side, -tilt])).as_matrix()
        return Rotation.from_matrix(TO_MODEL.T @ model @ TO_MODEL)
    names = ("pelvis_tilt", "pelvis_list", "pelvis_rotation")
    return Rotation.from_euler("ZXY", np.column_stack([get(n) for n in names]))


def _trunk(c: Channels, zero: Array) -> Array:
    """Flexion, bend and rotation of the lumbar joint, shape (n, 3)."""

    def get(name: str) -> Array:
        return c.angles.get(name, zero)

    if c.convention == "clinical":
        if "thorax_tilt" not in c.angles and "thorax_rotation" not in c.angles:
            return np.zeros((len(zero), 3))
        names, signs = ("tilt", "obliquity", "rotation"), (1, -1, 1)
        return np.column_stack(
            [
                sign * (get(f"thorax_{n}") - get(f"pelvis_{n}"))
                for n, sign in zip(names, signs, strict=True)
            ]
        )
    return np.column_stack(
        [-get("lumbar_extension"), get("lumbar_bending"), get("lumbar_rotation")]
    )


def _upright(
    pelvis: Rotation, path: Array, has_height: bool, notes: list[str]
) -> tuple[Rotation, Array, bool]:
    """The laboratory turned so that y is up, by where the pelvis's own up points."""
    up = pelvis.as_matrix()[:, :, 1].mean(0)
    if up[2] > 0.7:
        notes.append("z is up in the file: turned so that y is")
        return Z_TO_Y * pelvis, Z_TO_Y.apply(path), has_height
    if up[1] < 0.5:
        raise InvalidInputError(
            "the pelvis is not upright: its own vertical points to "
            f"({', '.join(f'{x:.2f}' for x in up)}) in the file's axes, expected y or z"
        )
    if not has_height:
        return pelvis, path, False
    if not _is_height(path[:, 1]) and _is_height(path[:, 2]):
        notes.append("pelvis_tz looks like the height: z of the path taken as up")
        return pelvis, Z_TO_Y.apply(path), True
    return pelvis, path, _is_height(path[:, 1])


def _is_height(column: Array) -> bool:
    """Whether a coordinate of the pelvis stays where a height would."""
    low, high = HEIGHTS
    if not np.isfinite(column).any():
        return False
    spread = np.nanpercentile(column, 95) - np.nanpercentile(column, 5)
    return bool(low < np.nanmedian(column) < high and spread < BOBS)


def straight_stretch(m: Motion) -> Motion:
    """The longest stretch of straight walking at a steady speed, of samples at equal steps."""
    hz = 1 / float(np.median(np.diff(m.time)))
    n = int(SMOOTHED * hz)
    if len(m.time) < 3 * n:
        return m
    box = np.ones(n) / n
    yaw, x, y = (np.convolve(m.q[:, j], box, "valid") for j in (3, 0, 1))
    speed = np.hypot(np.gradient(x, 1 / hz), np.gradient(y, 1 / hz))
    is_steady = np.abs(np.gradient(yaw, 1 / hz)) < TURNING
    usual = float(np.percentile(speed, 90))
    if usual > WALKS:
        is_steady &= speed > STEADY * usual
    edges = np.flatnonzero(np.diff(np.r_[0, is_steady.astype(int), 0])).reshape(-1, 2)
    if len(edges) == 0:
        return m
    first, last = max(edges, key=lambda e: e[1] - e[0])
    part = slice(int(first), int(last + n - 1))
    if part.stop - part.start >= len(m.time):
        return m
    seconds = f"{m.time[part.start] - m.time[0]:.2f} to {m.time[part.stop - 1] - m.time[0]:.2f} s"
    note = (
        f"straight and steady from {seconds} of {m.time[-1] - m.time[0]:.2f} s: this part is used"
    )
    return cut(m, part, note)


def cut(m: Motion, part: slice, note: str) -> Motion:
    """A part of the samples."""
    return replace(
        m, time=m.time[part], q=m.q[part], is_whole=m.is_whole[part], notes=(*m.notes, note)
    )


def face_forward(m: Motion) -> Motion:
    """The walk along x, from its direction in the laboratory.

    Raises:
        InvalidInputError: If the walker goes backwards or sideways.
    """
    yaw = float(np.arctan2(np.sin(m.q[:, 3]).mean(), np.cos(m.q[:, 3]).mean()))
    dx, dy = _way(m)
    seconds = m.time[-1] - m.time[0]
    heading = float(np.arctan2(dy, dx)) if np.hypot(dx, dy) > WALKS * seconds else yaw
    off = float(np.rad2deg(_wrapped(yaw - heading)))
    if abs(off) > BACKWARDS:
        word = "backwards" if abs(off) > 120 else "sideways"
        raise InvalidInputError(
            f"the walk goes {word}: the pelvis faces {abs(off):.0f} degrees away from where it goes"
        )
    return turned(m, heading)


def turned(m: Motion, angle: float) -> Motion:
    """The walk seen from a laboratory that is turned by an angle about the vertical [rad]."""
    q = m.q.copy()
    cos, sin = np.cos(angle), np.sin(angle)
    q[:, :2] = q[:, :2] @ np.array([[cos, -sin], [sin, cos]])
    q[:, 3] = _wrapped(q[:, 3] - angle)
    return replace(m, q=q, heading=float(np.rad2deg(_wrapped(np.deg2rad(m.heading) + angle))))


def _way(m: Motion) -> tuple[float, float]:
    """Displacement along the line through the path, (x, y) [m]."""
    t = m.time - m.time.mean()
    slope = t @ m.q[:, :2] / (t @ t)
    x, y = slope * (m.time[-1] - m.time[0])
    return float(x), float(y)


def _wrapped(angle: Array | float) -> Array:
    return np.asarray((angle + np.pi) % (2 * np.pi) - np.pi)
