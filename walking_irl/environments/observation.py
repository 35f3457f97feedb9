"""What an agent sees, as one vector whose numbers have names."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker

AXES = ("x", "y", "z")


def observation_names(walker: Walker) -> tuple[str, ...]:
    """Names of the observation's numbers, ``group/part``, in their order.

    Joint positions lack the first one: where on the ground it walks is not seen.
    """
    parts = {
        "joint_positions": walker.joints[1:],
        "joint_velocities": walker.joints,
        "phase": ("cos", "sin"),
        "centre_of_mass": AXES,
        "contact_forces": ("right", "left"),
        "trunk_axis": AXES,
        "trunk_velocity": AXES,
        "angular_momentum": AXES,
    }
    return tuple(f"{group}/{part}" for group, names in parts.items() for part in names)


def flatten(observation: Mapping[str, Array]) -> Array:
    """The groups of an observation one after the other, as :func:`observation_names` says."""
    return np.concatenate(list(observation.values()))
