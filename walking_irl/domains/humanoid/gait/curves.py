"""A gait's curves over the cycle in the signs of the clinic, and how many lie within the norm.

Cycles start with initial contact of the right foot. The model's pelvis is neutral at zero while the
clinic's leans forwards in standing, so the norm's mean tilt is added to pelvis and hip.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.gait.norm_curves import PHASES, SETS, NormSet, norm_set

if TYPE_CHECKING:
    from walking_irl.domains.humanoid.gait.realism import Cycle

ANGLES: Mapping[str, tuple[str, int]] = {
    "pelvis_tilt": ("root_pitch", 1),
    "pelvis_obliquity": ("root_roll", -1),
    "pelvis_rotation": ("root_yaw", 1),
    "hip_flexion": ("hip_flexion_r", 1),
    "hip_adduction": ("hip_adduction_r", 1),
    "hip_rotation": ("hip_rotation_r", 1),
    "knee_flexion": ("knee_r", 1),
    "ankle_dorsiflexion": ("ankle_r", 1),
}
"""The clinic's name, and the model's joint with its sign."""
MOMENTS: Mapping[str, str] = {
    "hip_extension_moment": "hip_flexion_r",
    "knee_extension_moment": "knee_r",
    "ankle_plantarflexion_moment": "ankle_r",
}
TILTED = ("pelvis_tilt", "hip_flexion")


def angle_curves(walker: Walker, q: Array) -> dict[str, Array]:
    """Joint angles at PHASES [deg], shape (101,) each.

    Args:
        walker: Who walks.
        q: Joint positions over one cycle from initial contact of the right foot, shape (n, nv).
    """
    found = {}
    for name, (joint, sign) in ANGLES.items():
        if joint in walker.joints:
            found[name] = at_phases(sign * np.degrees(q[:, walker.joints.index(joint)]))
    return found


def gait_curves(cycle: Cycle) -> dict[str, Array]:
    """Angles [deg], net joint moments [Nm/kg] and vertical force [body weights] at PHASES."""
    out = angle_curves(cycle.walker, cycle.q)
    for name, joint in MOMENTS.items():
        out[name] = at_phases(-cycle.net_torque(joint) / cycle.walker.mass)
    out["vertical_force"] = at_phases(cycle.force[:, 0])
    return out


def at_phases(curve: Array) -> Array:
    """A periodic curve of n samples at PHASES, shape (101,)."""
    at = np.arange(len(curve) + 1) / len(curve) * 100
    return np.asarray(np.interp(PHASES, at, np.r_[curve, curve[0]]))


def beside(curves: Mapping[str, Array], norms: NormSet) -> dict[str, Array]:
    """Curves with the norm's zero of the pelvis."""
    if "pelvis_tilt" not in curves:
        return dict(curves)
    tilt = float(norms.curves["pelvis_tilt"].mean.mean() - curves["pelvis_tilt"].mean())
    return {name: c + tilt if name in TILTED else c for name, c in curves.items()}


def shares(curves: Mapping[str, Array], norms: NormSet) -> dict[str, float]:
    """Share of the cycle within one standard deviation, of every curve that the norm knows."""
    placed = beside(curves, norms)
    return {n: norms.curves[n].share(c) for n, c in placed.items() if n in norms.curves}


def likeness(curves: Mapping[str, Array], speed: float, leg: float) -> dict[str, Any]:
    """Shares of all norm sets, each at the gait's own speed where that is known, and their means.

    Args:
        curves: At PHASES.
        speed: Of the gait [m/s].
        leg: Length of the legs [m].
    """
    out: dict[str, Any] = {}
    for name in SETS:
        norms = norm_set(name, speed, leg)
        found = shares(curves, norms)
        out[name] = {
            "speed_range": None if norms.speed_range is None else list(norms.speed_range),
            "curves": found,
            "mean": float(np.mean(list(found.values()))),
        }
    return out
