r"""What the walker may walk for: six costs per metre, and a fixed part that everybody shares.

A cost is a sum of squares over the steps of a gait,
:math:`F_j = (v_0 T / L) \, \langle |r_j|^2 \rangle`, so per metre walked in units of the time that
a metre takes at :math:`v_0`. The fixed part :math:`C` (feet must not skid, legs must not pass
through each other, joints stay in range) has a known weight and is folded into *every* objective,
:math:`G_j = F_j / \text{scale}_j + C`: since the weights sum to one, the walker minimises
:math:`w \cdot G` exactly and every cut of CPIRL stays homogeneous.

The same residuals serve the optimiser, where the motion is a :class:`~.gait.Gait`, and a
simulation, where it is a :class:`~walking_irl.types.Rollout`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.types import Objective, Rollout

OBJECTIVES = (
    Objective(
        "effort",
        "1",
        0.35,
        "Squared joint torque relative to the strength of its direction.",
        "|tau / strength|^2",
    ),
    Objective("work", "100 W", 0.38, "Mechanical power, either sign.", "|tau v| / 100 W"),
    Objective("smooth", "(50 rad/s^2)^2", 5.0, "Squared joint accelerations.", "|a / 50|^2"),
    Objective(
        "stability",
        "1",
        1.0,
        "Shaking of the head and trunk, and angular momentum about the centre of mass.",
        "|head|^2 / .08 + |balance|^2 / .12",
    ),
    Objective(
        "impact",
        "(10 BW/s)^2",
        0.5,
        "Squared rate of the ground force under each foot.",
        "|dF/dt|^2",
    ),
    Objective("time", "0.8 s", 1.0, "Time that a metre takes.", "1"),
)

REFERENCE_RAW = np.array([1.0, 1.5, 0.02, 0.18, 0.2, 1.25])
"""Coefficients of the unscaled costs that give the most human gait known."""
UNIT = float(REFERENCE_RAW @ [o.scale for o in OBJECTIVES])
"""Sum of the raw coefficients in scaled units; the fixed part is stated in raw units."""
REFERENCE_WEIGHTS = REFERENCE_RAW * [o.scale for o in OBJECTIVES] / UNIT
"""Reference weights on the simplex, shape (6,)."""

REFERENCE_SPEED = 1.25  # v0 [m/s]
STRENGTH_SWITCH = 10.0  # width of the change between the strengths of both directions [Nm]
POWER_UNIT = 100.0  # [W]
POWER_SMOOTHING = 20.0  # |p| is smooth within this [W]
ACCELERATION_UNIT = 50.0  # [rad/s^2]
HEAD_UNITS = np.array([8.0, 2.0, 0.5, 0.5, 0.5, 0.1, 0.1])
"""Head acceleration fore-aft and lateral [m/s^2], trunk angular velocity [rad/s], tilt [rad]."""
MOMENTUM_UNITS = np.array([3.0, 4.0, 1.0])  # roll, pitch, yaw [kg m^2/s]
HEAD_SHARE, MOMENTUM_SHARE = 0.5 / 0.04, 0.5 / 0.06
IMPACT_UNIT = 10.0  # [body weights / s]

SKID_WEIGHT = 0.2 / UNIT
SKID_SPEED = 0.5  # [m/s]
SKID_HEIGHT, SKID_WIDTH = 0.005, 0.004  # a sole point below this height counts as down [m]
LEG_WEIGHT = 400.0 / UNIT  # of the squared lateral overlap [1/m^2]
LEG_GAP = {"ankle": 0.11, "heel": 0.11, "toe": 0.11, "knee": 0.12}  # [m]
LIMIT_WEIGHT = 900.0 / UNIT  # of the squared excess over a joint's range [1/rad^2]
SOLE_POINTS = tuple(f"{p}_{s}" for s in "rl" for p in ("heel", "ball", "toe"))


class Motion(NamedTuple):
    """Consecutive steps of a walk; index i is the step from sample i to sample i + 1.

    Shapes: q, v, v_next, a (N, nv); tau (N, nu); s, s_next (N, ns). ``h`` is the timestep [s] and
    ``distance`` the way walked in all N steps [m].
    """

    q: Array
    v: Array
    v_next: Array
    a: Array
    tau: Array
    s: Array
    s_next: Array
    h: float
    distance: float

    @property
    def pace(self) -> float:
        """Time per distance relative to the reference speed, v0 T / L [1]."""
        return REFERENCE_SPEED * self.h * len(self.q) / self.distance


class Layout(NamedTuple):
    """Where the residuals find their quantities among joints and sensors; ``gap`` [m]."""

    joints: Indices
    head: Indices
    momentum: Indices
    touch: Indices
    sole_x: Indices
    sole_z: Indices
    left_y: Indices
    right_y: Indices
    gap: Array


def layout(walker: Walker) -> Layout:
    """Index arrays of a walker; a planar walker has no lateral gap to keep."""
    sensor = walker.sensor
    first = {name: s.start for name, s in sensor.items()}
    head = [first["head_acceleration"], first["head_acceleration"] + 1]
    head += list(range(first["trunk_velocity"], first["trunk_velocity"] + 3))
    head += [first["trunk_axis"], first["trunk_axis"] + 1]
    gaps = {} if walker.n_root == 3 else LEG_GAP
    sole = np.array([first[p] for p in SOLE_POINTS])
    return Layout(
        joints=np.arange(walker.n_root, len(walker.joints)),
        head=np.array(head),
        momentum=np.arange(first["angular_momentum"], first["angular_momentum"] + 3),
        touch=np.array([first["touch_r"], first["touch_l"]]),
        sole_x=sole,
        sole_z=sole + 2,
        left_y=np.array([first[f"{p}_l"] + 1 for p in gaps], dtype=int),
        right_y=np.array([first[f"{p}_r"] + 1 for p in gaps], dtype=int),
        gap=np.array(list(gaps.values())),
    )


class Residuals(NamedTuple):
    """Residuals of all costs, each of shape (N, m); squares are averaged over the N steps."""

    effort: Array
    work: Array
    """Power with the torque held and the velocity at the start of the step, square-rooted."""
    work_end: Array
    """The same with the velocity at its end: else torques that alternate from step to step are
    free."""
    smooth: Array
    stability: Array
    impact: Array
    skid: Array
    limits: Array
    gap: Array


def effort_slope(walker: Walker) -> tuple[Array, Array]:
    """Mean and half difference of 1/strength of both directions, each of shape (nu,)."""
    plus, minus = 1 / walker.strength_plus, 1 / walker.strength_minus
    return (plus + minus) / 2, (plus - minus) / 2


def root_power(p: Array) -> Array:
    """Signed residual whose square is about abs(p) / (2 POWER_UNIT), smooth through zero."""
    return np.asarray(np.sqrt(0.5 / POWER_UNIT) * p / (p * p + POWER_SMOOTHING**2) ** 0.25)


def residuals(walker: Walker, at: Layout, m: Motion) -> Residuals:
    """Residuals of a motion."""
    mean, half = effort_slope(walker)
    joint = at.joints
    excess = np.minimum(0, m.q - walker.lower) + np.maximum(0, m.q - walker.upper)
    sole_speed = (m.s_next[:, at.sole_x] - m.s[:, at.sole_x]) / m.h
    overlap = np.minimum(0, m.s[:, at.left_y] - m.s[:, at.right_y] - at.gap)
    force_rate = (m.s_next[:, at.touch] - m.s[:, at.touch]) / m.h
    return Residuals(
        effort=m.tau * (mean + half * np.tanh(m.tau / STRENGTH_SWITCH)),
        work=root_power(m.tau * m.v[:, joint]),
        work_end=root_power(m.tau * m.v_next[:, joint]),
        smooth=m.a[:, joint] / ACCELERATION_UNIT,
        stability=np.hstack([m.s[:, at.head] * HEAD_SCALE, m.s[:, at.momentum] * MOMENTUM_SCALE]),
        impact=force_rate / (walker.weight * IMPACT_UNIT),
        skid=sole_speed * ground_contact(m.s[:, at.sole_z]) / SKID_SPEED,
        limits=excess[:, joint],
        gap=overlap,
    )


HEAD_SCALE = np.sqrt(HEAD_SHARE) / HEAD_UNITS
MOMENTUM_SCALE = np.sqrt(MOMENTUM_SHARE) / MOMENTUM_UNITS


def ground_contact(z: Array) -> Array:
    """How far a sole point at height ``z`` [m] counts as down: 1 on the ground, 0 in the air."""
    return 1 / (1 + np.exp(np.clip((z - SKID_HEIGHT) / SKID_WIDTH, -50, 50)))


def mean_square(r: Array) -> float:
    """Sum of squares, averaged over steps."""
    return float(np.sum(r * r) / len(r))


def costs(r: Residuals, pace: float) -> Array:
    """Scaled costs per metre F_j / scale_j, shape (6,)."""
    work = mean_square(r.work) + mean_square(r.work_end)
    raw = [
        mean_square(r.effort),
        work,
        mean_square(r.smooth),
        mean_square(r.stability),
        mean_square(r.impact),
        1.0,
    ]
    return np.array(raw) * pace / [o.scale for o in OBJECTIVES]


def fixed_cost(r: Residuals) -> float:
    """The fixed part C of a motion whose root is unactuated."""
    return (
        SKID_WEIGHT * mean_square(r.skid)
        + LEG_WEIGHT * mean_square(r.gap)
        + LIMIT_WEIGHT * mean_square(r.limits)
    )


def folded_costs(walker: Walker, rollout: Rollout, timestep: float) -> Array:
    """Folded costs G of a recorded walk over whole gait cycles.

    Args:
        walker: Whose walk.
        rollout: n + 1 samples that span whole cycles; the last one only closes the last step.
        timestep: Time between samples [s].

    Returns:
        G, shape (6,); feature expectations are -G.
    """
    motion = Motion(
        q=rollout.q[:-1],
        v=rollout.v[:-1],
        v_next=rollout.v[1:],
        a=rollout.a[:-1],
        tau=rollout.u[:-1],
        s=rollout.sensors[:-1],
        s_next=rollout.sensors[1:],
        h=timestep,
        distance=float(rollout.q[-1, 0] - rollout.q[0, 0]),
    )
    r = residuals(walker, layout(walker), motion)
    return costs(r, motion.pace) + fixed_cost(r)
