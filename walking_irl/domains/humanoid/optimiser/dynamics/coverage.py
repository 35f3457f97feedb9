"""Which models the closed-form derivatives cover, and their parameters of contacts and sensors."""

from __future__ import annotations

import copy
from typing import Any, NamedTuple

import mujoco
import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.optimiser.dynamics.cone import Softness
from walking_irl.domains.humanoid.optimiser.dynamics.contact import Soles
from walking_irl.domains.humanoid.optimiser.dynamics.sensors import Part, Plan
from walking_irl.domains.humanoid.optimiser.dynamics.tree import Tree

_OBJECTS = mujoco.mjtObj
_SENSORS = mujoco.mjtSensor
_FRAME_AXES = (_SENSORS.mjSENS_FRAMEXAXIS, _SENSORS.mjSENS_FRAMEYAXIS, _SENSORS.mjSENS_FRAMEZAXIS)
_SMALLEST, _LARGEST = 1e-4, 1 - 1e-4  # MuJoCo's bounds of the impedance


class UncoveredError(Exception):
    """A model that the closed-form derivatives do not cover; the message says why."""


def check_tree(model: mujoco.MjModel) -> None:
    """Raise :class:`UncoveredError` unless joints and passive forces are those of the formulas."""
    slides = np.isin(
        model.jnt_type, [int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)]
    )
    limits_off = model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    faults = [
        (not slides.all(), "a ball or free joint"),
        (bool((model.body_rootid[1:] != 1).any()), "bodies beside the walker's tree"),
        (bool(model.jnt_limited.any()) and not limits_off, "simulated joint limits"),
        (model.neq + model.ntendon + model.nflex > 0, "equality constraints, tendons or flexes"),
        (bool(model.dof_frictionloss.any()), "friction loss in joints"),
        (bool(model.body_gravcomp.any()), "gravity compensation"),
        (model.opt.density > 0 or model.opt.viscosity > 0, "a fluid"),
        (bool(model.opt.disableflags & ~_HARMLESS), "disabled parts of the physics"),
        (bool(model.opt.enableflags & ~_HARMLESS_EXTRAS), "enabled parts of the physics"),
    ]
    for is_fault, what in faults:
        if is_fault:
            raise UncoveredError(f"the model has {what}")


_HARMLESS = int(
    mujoco.mjtDisableBit.mjDSBL_LIMIT
    | mujoco.mjtDisableBit.mjDSBL_REFSAFE
    | mujoco.mjtDisableBit.mjDSBL_EULERDAMP
    | mujoco.mjtDisableBit.mjDSBL_ACTUATION
    | mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL
    | mujoco.mjtDisableBit.mjDSBL_WARMSTART
    | mujoco.mjtDisableBit.mjDSBL_FILTERPARENT
    | mujoco.mjtDisableBit.mjDSBL_AUTORESET
    | mujoco.mjtDisableBit.mjDSBL_NATIVECCD
    | mujoco.mjtDisableBit.mjDSBL_ISLAND
)
_HARMLESS_EXTRAS = int(mujoco.mjtEnableBit.mjENBL_ENERGY | mujoco.mjtEnableBit.mjENBL_FWDINV)


def soles_of(model: mujoco.MjModel, tree: Tree) -> Soles:
    """The spheres that can touch the ground, with the parameters that MuJoCo gives their contacts.

    Raises:
        UncoveredError: If anything but spheres on a horizontal plane can touch, or softly in
            another way than the formulas say.
    """
    spheres, ground = _pairs(model)
    contacts = _lifted_contacts(model, ground) if spheres else []
    if sorted(g for c in contacts for g in c.geom if g != ground) != sorted(spheres):
        raise UncoveredError("the model has contacts that MuJoCo filters")
    by_geom = {g: c for c in contacts for g in c.geom if g in spheres}
    soft = _softness(model, [by_geom[g] for g in spheres], spheres)
    geoms = np.array(spheres, dtype=int)
    height = float(_plane_height(model, ground)) if spheres else 0.0
    return Soles(
        tree, geoms, model.geom_bodyid[geoms].astype(int), model.geom_size[geoms, 0], height, soft
    )


def _pairs(model: mujoco.MjModel) -> tuple[list[int], int]:
    """Spheres that can touch the plane, and the plane."""
    if model.npair:
        raise UncoveredError("the model has explicit contact pairs")
    kind, body = model.geom_type, model.geom_bodyid
    can, may = model.geom_contype.astype(int), model.geom_conaffinity.astype(int)
    meets = (can[:, None] & may[None]) | (can[None] & may[:, None])
    spheres, planes = set(), set()
    for i, j in zip(*np.nonzero(np.triu(meets, 1)), strict=True):
        if body[i] == body[j]:
            continue
        kinds = {int(kind[i]): int(i), int(kind[j]): int(j)}
        plane = kinds.get(int(mujoco.mjtGeom.mjGEOM_PLANE))
        sphere = kinds.get(int(mujoco.mjtGeom.mjGEOM_SPHERE))
        if plane is None or sphere is None or body[plane] != 0:
            names = " and ".join(repr(model.geom(g).name or int(g)) for g in (i, j))
            raise UncoveredError(f"geoms {names} can touch, only spheres and the ground may")
        spheres.add(sphere)
        planes.add(plane)
    if len(planes) > 1:
        raise UncoveredError("the model has several grounds")
    if planes and not np.allclose(model.geom_quat[min(planes), 1:3], 0):
        raise UncoveredError("the ground is not horizontal")
    return sorted(spheres), min(planes, default=-1)


def _plane_height(model: mujoco.MjModel, plane: int) -> float:
    return float(model.geom_pos[plane, 2])


class _Contact(NamedTuple):
    """What is needed of an ``mjContact``, which dies with its ``MjData``."""

    geom: tuple[int, int]
    dim: int
    includemargin: float
    solref: Array
    solimp: Array
    friction: Array
    solreffriction: Array


def _lifted_contacts(model: mujoco.MjModel, ground: int) -> list[_Contact]:
    """Contacts with the ground lifted above everything: all that can be, once each."""
    lifted = copy.copy(model)
    lifted.geom_pos[ground, 2] += 100.0
    data = mujoco.MjData(lifted)
    mujoco.mj_kinematics(lifted, data)
    mujoco.mj_comPos(lifted, data)
    mujoco.mj_collision(lifted, data)
    return [
        _Contact(
            (int(c.geom1), int(c.geom2)),
            int(c.dim),
            float(c.includemargin),
            *(np.array(x) for x in (c.solref, c.solimp, c.friction, c.solreffriction)),
        )
        for c in data.contact[: data.ncon]
    ]


def _softness(model: mujoco.MjModel, contacts: list[_Contact], spheres: list[int]) -> Softness:
    option = model.opt
    shape = np.array([c.solimp[3:] for c in contacts]).reshape(-1, 2)
    ref = np.array([c.solref for c in contacts]).reshape(-1, 2)
    imp = np.array([c.solimp[:3] for c in contacts]).reshape(-1, 3)
    friction = np.array([c.friction[:2] for c in contacts]).reshape(-1, 2)
    faults = [
        (any(c.dim != 3 for c in contacts), "contacts of another condim than 3"),
        (option.cone != int(mujoco.mjtCone.mjCONE_ELLIPTIC), "pyramidal friction cones"),
        (option.impratio != 1, "an impratio other than 1"),
        (not np.allclose(friction[:, 0], friction[:, 1]), "anisotropic friction"),
        (not np.allclose(shape, [0.5, 2.0]), "a solimp of other midpoint or power than 0.5 and 2"),
        (bool((imp[:, 2] <= 0).any()), "a solimp without width"),
        (bool(np.ptp(ref, axis=0).any()) if len(ref) else False, "contacts of different solref"),
        (any(c.solreffriction.any() for c in contacts), "a solreffriction"),
    ]
    for is_fault, what in faults:
        if is_fault and contacts:
            raise UncoveredError(f"the model has {what}")
    low, high = np.clip(imp[:, :2], _SMALLEST, _LARGEST).T
    if len(set(high)) > 1:
        raise UncoveredError("the model has contacts of different largest impedance")
    stiffness, damping = _reference(model, ref, high)
    body = model.geom_bodyid[spheres] if spheres else np.zeros(0, int)
    margin = np.array([c.includemargin for c in contacts])
    weight = np.array(model.body_invweight0[body, 0])
    return Softness(margin, low, high, imp[:, 2], stiffness, damping, friction[:, 0], weight)


def _reference(model: mujoco.MjModel, ref: Any, high: Any) -> tuple[Any, float]:
    """Stiffness of each contact's reference acceleration, and the common damping."""
    if not len(ref):
        return np.zeros(0), 0.0
    first, second = ref[0]
    if first <= 0:  # MuJoCo's direct format: -stiffness, -damping
        return -first / high**2, float(-second / high[0])
    if not model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_REFSAFE):
        first = max(first, 2 * model.opt.timestep)
    return 1 / (high * first * second) ** 2, float(2 / (high[0] * first))


def plan_of(model: mujoco.MjModel, soles: Soles) -> Plan:
    """What the model's sensors read.

    Raises:
        UncoveredError: If one is of another kind than the formulas know.
    """
    found: dict[str, list[Any]] = {name: [] for name in Plan._fields[1:]}
    for i in range(model.nsensor):
        kind, start = int(model.sensor_type[i]), int(model.sensor_adr[i])
        on, index = int(model.sensor_objtype[i]), int(model.sensor_objid[i])
        bad = UncoveredError(f"the sensor {model.sensor(i).name!r} is of a kind without formulas")
        if model.sensor_reftype[i] != int(_OBJECTS.mjOBJ_UNKNOWN) or model.sensor_cutoff[i] > 0:
            raise bad
        if kind == int(_SENSORS.mjSENS_TOUCH):
            if model.site_bodyid[index] in soles.bodies:  # else it always reads 0
                found["touch"].append((start, _touched(model, soles, index)))
        elif kind in (int(_SENSORS.mjSENS_SUBTREECOM), int(_SENSORS.mjSENS_SUBTREEANGMOM)):
            if index != 1:
                raise bad
            is_centre = kind == int(_SENSORS.mjSENS_SUBTREECOM)
            found["centres" if is_centre else "momenta"].append(start)
        elif kind == int(_SENSORS.mjSENS_FRAMEPOS):
            found["points"].append(_part(model, start, on, index, bad))
        elif kind == int(_SENSORS.mjSENS_FRAMELINACC):
            found["accelerations"].append(_part(model, start, on, index, bad))
        elif kind == int(_SENSORS.mjSENS_FRAMEANGVEL):
            found["spins"].append(_part(model, start, on, index, bad))
        elif kind in map(int, _FRAME_AXES):
            axis = list(map(int, _FRAME_AXES)).index(kind)
            found["axes"].append(_part(model, start, on, index, bad, axis))
        else:
            raise bad
    return Plan(model.nsensordata, **{name: tuple(parts) for name, parts in found.items()})


def _part(
    model: mujoco.MjModel, start: int, on: int, index: int, bad: Exception, axis: int = -1
) -> Part:
    kinds = {
        int(_OBJECTS.mjOBJ_SITE): ("sites", "site_frames", model.site_bodyid),
        int(_OBJECTS.mjOBJ_XBODY): ("bodies", "body_frames", np.arange(model.nbody)),
        int(_OBJECTS.mjOBJ_BODY): ("inertial", "inertial_frames", np.arange(model.nbody)),
    }
    if on not in kinds:
        raise bad
    place, frame, body = kinds[on]
    return Part(start, int(body[index]), frame if axis >= 0 else place, index, max(axis, 0))


def _touched(model: mujoco.MjModel, soles: Soles, site: int) -> int:
    """Index of the foot whose spheres a touch sensor's site holds altogether.

    MuJoCo counts contacts whose normal meets the site, so spheres must lie well inside.
    """
    body = int(model.site_bodyid[site])
    feet = soles.bodies.tolist()
    name = model.site(site).name
    mine = soles.foot == feet.index(body)
    frame = np.zeros(9)
    mujoco.mju_quat2Mat(frame, model.site_quat[site])
    local = (model.geom_pos[soles.geoms[mine]] - model.site_pos[site]) @ frame.reshape(3, 3)
    room = model.site_size[site] - np.abs(local)
    is_box = model.site_type[site] == int(mujoco.mjtGeom.mjGEOM_BOX)
    if not is_box or (room.min(1) < soles.radius[mine]).any():
        raise UncoveredError(f"the touch sensor at {name!r} does not hold its foot's spheres")
    return int(feet.index(body))
