r"""How near a gait is to a recorded one, as a part of the cost and in degrees.

A recording is no gait of the model: frames, soft tissue and joints that the model has not got put
angles 2-5 degrees off between laboratories (J. L. McGinley et al. 2009, Gait Posture 29:360). So
the squared distance counts each joint in units of what it may be off, and its mean over joints and
knots is one where all are off by that much.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.recorded.naming import SIDED

PLACE = 0.02
"""What the root's position may be off [m]."""
SAGITTAL = ("hip_flexion", "knee", "ankle")
"""Joints, without their side, by which closeness is told in one number."""
WIDE = {"lumbar": 6.0, "shoulder": 6.0, "elbow": 6.0, "hip_rotation": 6.0, "subtalar": 10.0}
USUAL, UNSEEN = 3.0, 60.0
"""What a joint may be off [deg]: what WIDE does not name, and what was not recorded."""
PACE_SHARE = 0.05
"""Of a step length or half period that is off by what it may be, relative to all joints."""
STEP_LENGTH, HALF_PERIOD = 0.02 / np.sqrt(PACE_SHARE), 0.01 / np.sqrt(PACE_SHARE)
"""What the step length [m] and the half period [s] may be off, to cost as much as all joints."""
MIDDLE = {
    "pelvis_tilt": "root_pitch",
    "pelvis_list": "root_roll",
    "pelvis_obliquity": "root_roll",
    "pelvis_rotation": "root_yaw",
    "lumbar_extension": "lumbar_flexion",
    "lumbar_bending": "lumbar_bend",
    "lumbar_rotation": "lumbar_rotation",
    "thorax_tilt": "lumbar_flexion",
    "thorax_obliquity": "lumbar_bend",
    "thorax_rotation": "lumbar_rotation",
}
"""Columns of recordings without a side, and the model's joints that they tell of."""


@dataclass(frozen=True, eq=False)
class Walk:
    """A recorded walk, as the model's body would walk it, and how well it was measured.

    Attributes:
        shown: The gait as recorded.
        missing: Columns that the recording has not got, by their names there; their joints may be
            off by as much as they like.
        variance: Of the mean gait's vector [q row by row, L, T], from the spread of its cycles,
            shape (N nv + 2,); 0 where one cycle tells nothing of it.
        force: Vertical force under the right foot over the whole cycle from the first knot, shape
            (2 N,) [body weights], or None.
    """

    shown: Gait
    missing: tuple[str, ...] = ()
    variance: Array | float = 0.0
    force: Array | None = None


@dataclass(frozen=True, eq=False)
class Closeness:
    """The squared distance from a recorded gait.

    Attributes:
        target: The gait as recorded, shape (N nv + 2,).
        weight: Of the squared differences, shape (N nv + 2,).
    """

    target: Array
    weight: Array

    def squared(self, x: Array) -> float:
        """Squared distance of a gait vector: 1 where every joint is off by what it may be."""
        away = x - self.target
        return float(away @ (self.weight * away))


def closeness(walker: Walker, walk: Walk) -> Closeness:
    """The distance from a recorded gait.

    What a number may be off and how well its mean is known add up as variances do.

    Args:
        walker: The body whose joints they are.
        walk: The recorded walk.
    """
    shown = walk.shown
    scale = np.array([_scale(walker, i, walk.missing) for i in range(len(walker.joints))])
    share = np.r_[np.full(shown.q.size, 1.0 / shown.q.size), 1.0, 1.0]
    allowed = np.r_[np.tile(scale**2, shown.n_knots), STEP_LENGTH**2, HALF_PERIOD**2]
    # of step length and half period the share is within what they may be off
    measured = walk.variance * np.r_[np.ones(shown.q.size), 1 / PACE_SHARE, 1 / PACE_SHARE]
    return Closeness(shown.to_vector(), share / (allowed + measured))


def _scale(walker: Walker, i: int, missing: tuple[str, ...]) -> float:
    """What a joint may be off [m or rad]."""
    joint = walker.joints[i]
    if joint in ("root_x", "root_y", "root_z"):
        return PLACE
    if joint in map(joint_of, missing):
        return float(np.deg2rad(UNSEEN))
    wide = [degrees for stem, degrees in WIDE.items() if joint.startswith(stem)]
    return float(np.deg2rad(wide[0] if wide else USUAL))


def joint_of(column: str) -> str:
    """The model's joint that a column of a recording tells of.

    >>> joint_of("knee_angle_r"), joint_of("thorax_tilt"), joint_of("elbow_r")
    ('knee_r', 'lumbar_flexion', 'elbow_r')
    """
    stem, side = (column[:-2], column[-2:]) if column[-2:] in ("_r", "_l") else (column, "")
    return SIDED[stem] + side if side and stem in SIDED else MIDDLE.get(column, column)


def degrees_apart(walker: Walker, a: Gait, b: Gait) -> dict[str, float]:
    """Root mean square difference of each joint angle over the cycle [deg], both sides as one.

    >>> from walking_irl.domains.humanoid.body.load import load_walker
    >>> from walking_irl.domains.humanoid.gait.library import load_gaits
    >>> gait = load_gaits()["reference"]
    >>> degrees_apart(load_walker(), gait, gait)["knee"]
    0.0
    """
    squares: dict[str, list[Array]] = {}
    for i, joint in enumerate(walker.joints):
        if joint not in ("root_x", "root_y", "root_z"):
            stem = joint[:-2] if joint[-2:] in ("_r", "_l") else joint
            squares.setdefault(stem, []).append((a.q[:, i] - b.q[:, i]) ** 2)
    return {n: float(np.rad2deg(np.sqrt(np.mean(rows)))) for n, rows in squares.items()}


def sagittal_apart(apart: dict[str, float]) -> float:
    """Root mean square of hips, knees and ankles [deg], from :func:`degrees_apart`."""
    return float(np.sqrt(np.mean([apart[n] ** 2 for n in SAGITTAL])))
