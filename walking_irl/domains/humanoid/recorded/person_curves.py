"""A recorded person's curves over the gait cycle, to be held against norms and models."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.gait.curves import angle_curves, at_phases
from walking_irl.domains.humanoid.gait.gait import whole_cycle
from walking_irl.domains.humanoid.recorded.feet import feet_of
from walking_irl.domains.humanoid.recorded.person import Person

ON_GROUND = 0.03  # [body weights]
NEEDS = {"pelvis_tilt": "pelvis_tilt", "pelvis_rotation": "pelvis_rotation"}
SIDES = {"hip_adduction": "hip_adduction_r", "hip_rotation": "hip_rotation_r"}


def person_curves(person: Person, walker: Walker) -> dict[str, Array]:
    """Angles [deg] and, where it was measured, vertical force [body weights] at PHASES, (101,).

    The cycle starts with the right foot's initial contact: where its force begins, or else where
    its heel is farthest before the hips (J. A. Zeni et al. 2008). Joints that the file has not got
    are left out.
    """
    q = whole_cycle(person.gait, walker.mirror)
    if person.force is None:
        first = int(feet_of(walker, q).heel[:, 0, 0].argmax())
    else:
        on = person.force[:, 2] > ON_GROUND
        starts = np.flatnonzero(on & ~np.roll(on, 1) & np.roll(on, -4))
        first = int(starts[0]) if len(starts) else 0
    curves = angle_curves(walker, np.roll(q, -first, axis=0))
    for name, column in {**NEEDS, **SIDES}.items():
        if column in person.missing:
            curves.pop(name)
    if {"pelvis_list", "pelvis_obliquity", "root_roll"} & set(person.missing):
        curves.pop("pelvis_obliquity")
    if person.force is not None:
        curves["vertical_force"] = at_phases(np.roll(person.force[:, 2], -first))
    return curves
