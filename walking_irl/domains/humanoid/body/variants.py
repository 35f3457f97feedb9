"""The same body elsewhere: on a slope, or with a load on its back.

A variant has a name like any body, ``humanoid?slope=3&load=10``, so that worker processes can make
it, too. On a slope gravity leans instead of the ground, which keeps the walk periodic; "upright"
still means against gravity. What is measured in body weights stays so in the body's own weight.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from walking_irl.errors import InvalidInputError

STEEPEST = 15.0
"""Largest slope either way [deg]: the soles' friction and the search from level gaits end there."""
HEAVIEST = 40.0
"""Largest load [kg]."""
PACK = ((-0.18, 0.0, 0.22), (0.07, 0.14, 0.20))
"""Centre of the pack in the frame of the trunk and half its size [m]."""
UPRIGHT = "upright"
"""Site of the trunk whose z axis is the ground's normal where the trunk is upright."""


@dataclass(frozen=True)
class Surroundings:
    """What differs from a body's own model.

    Attributes:
        slope: Of the ground, uphill positive [deg].
        load: Mass of a pack on the back [kg].
    """

    slope: float = 0.0
    load: float = 0.0

    def __post_init__(self) -> None:
        if not -STEEPEST <= self.slope <= STEEPEST:
            raise InvalidInputError(
                f"a slope lies within {STEEPEST:g} degrees either way, got {self.slope}"
            )
        if not 0 <= self.load <= HEAVIEST:
            raise InvalidInputError(f"a load lies between 0 and {HEAVIEST:g} kg, got {self.load}")

    def share(self, part: float) -> Surroundings:
        """A part of the way there."""
        return Surroundings(self.slope * part, self.load * part)


def variant(body: str, around: Surroundings) -> str:
    """Name of a body in other surroundings.

    >>> variant("humanoid", Surroundings(slope=3.0, load=10.0)), variant("humanoid", Surroundings())
    ('humanoid?slope=3.0&load=10.0', 'humanoid')
    """
    if around == Surroundings():
        return body
    return f"{body}?slope={around.slope!r}&load={around.load!r}"


def parted(body: str) -> tuple[str, Surroundings]:
    """The body's own name, and its surroundings.

    Raises:
        InvalidInputError: If what follows the question mark cannot be read.
    """
    own, mark, text = body.partition("?")
    if not mark:
        return own, Surroundings()
    try:
        pairs = dict(part.split("=") for part in text.split("&"))
        return own, Surroundings(**{name: float(value) for name, value in pairs.items()})
    except (TypeError, ValueError) as error:
        raise InvalidInputError(
            f"expected a body like humanoid?slope=3&load=10, got {body!r}"
        ) from error


def model_of(path: Path, around: Surroundings) -> mujoco.MjModel:
    """The model of a file in its surroundings.

    Raises:
        ValueError: If MuJoCo cannot read it.
    """
    if around == Surroundings():
        return mujoco.MjModel.from_xml_path(str(path))
    spec = mujoco.MjSpec.from_file(str(path))
    trunk = spec.body("torso")
    if trunk is None:
        raise InvalidInputError(f"{path} has no body named torso to carry a load or stand upright")
    if around.load:
        centre, half = PACK
        trunk.add_geom(
            name="pack",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=centre,
            size=half,
            mass=around.load,
            contype=0,
            conaffinity=0,
            group=2,
            rgba=[0.35, 0.38, 0.30, 1.0],
        )
    if around.slope:
        _lean(spec, trunk, float(np.deg2rad(around.slope)))
    return spec.compile()


def _lean(spec: mujoco.MjSpec, trunk: mujoco.MjsBody, slope: float) -> None:
    """Gravity as it is in the frame of the slope [rad]; the trunk's tilt is told from it."""
    g = float(np.linalg.norm(spec.option.gravity))
    spec.option.gravity = [-g * np.sin(slope), 0.0, -g * np.cos(slope)]
    half = -slope / 2  # about y
    trunk.add_site(name=UPRIGHT, quat=[np.cos(half), 0.0, np.sin(half), 0.0])
    sensor = spec.sensor("trunk_axis")
    sensor.objtype, sensor.objname = mujoco.mjtObj.mjOBJ_SITE, UPRIGHT
