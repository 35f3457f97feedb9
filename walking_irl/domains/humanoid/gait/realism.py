"""How human a gait is: measured figures against bands of healthy adults, and one score.

A metric scores 1 inside its band and falls linearly to 0 at its outer numbers; a group is the mean
of its metrics, the score the mean of the groups. Phases are in % of the gait cycle from initial
contact of the right foot, or in % of stance.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.body.physics import inverse_dynamics, passive_forces
from walking_irl.domains.humanoid.gait.curves import gait_curves, likeness
from walking_irl.domains.humanoid.gait.gait import Gait, cycle_motion
from walking_irl.domains.humanoid.gait.norms import GROUPS
from walking_irl.errors import InvalidInputError

ON_GROUND = 0.03  # vertical force of a foot that stands [body weights]
LOADED = 0.5  # vertical force of a foot that carries [body weights]
TOE_HEIGHT = 0.004  # of the toe's site above the heel's when the foot is flat [m]
GRAVITY = 9.81  # [m/s^2]


class Cycle(NamedTuple):
    """One gait cycle from initial contact of the right foot, sampled at n knots.

    Shapes: q, v (n, nv), tau (n, nu), sensors (n, ns), force (n, 2) of the right and left foot
    [body weights], root (n, n_root) [N, Nm]: what would have to hold the root, passive (n, nu)
    [Nm]: torques of the joints' springs and dampers.
    """

    walker: Walker
    gait: Gait
    q: Array
    v: Array
    tau: Array
    sensors: Array
    force: Array
    root: Array
    passive: Array

    def degrees(self, joint: str) -> Array:
        """A joint's angle [deg], shape (n,)."""
        return np.degrees(self.q[:, self.walker.joints.index(joint)])

    def torque(self, joint: str) -> Array:
        """A joint's torque [Nm], shape (n,)."""
        return self.tau[:, self.walker.joints.index(joint) - self.walker.n_root]

    def net_torque(self, joint: str) -> Array:
        """A joint's torque with its springs and dampers, as laboratories measure it [Nm], (n,)."""
        return self.net[:, self.walker.joints.index(joint) - self.walker.n_root]

    @property
    def net(self) -> Array:
        """Net torques of all joints [Nm], shape (n, nu)."""
        return self.tau + self.passive

    def sensor(self, name: str) -> Array:
        """A sensor's readings, shape (n, its size)."""
        return self.sensors[:, self.walker.sensor[name]]

    @property
    def power(self) -> Array:
        """Net power of each joint [W], shape (n, nu)."""
        return self.net * self.v[:, self.walker.n_root :]

    @property
    def motor_power(self) -> Array:
        """Power of each motor [W], shape (n, nu)."""
        return self.tau * self.v[:, self.walker.n_root :]

    @property
    def phase(self) -> Array:
        """Phase of each sample [% of the cycle], shape (n,)."""
        return np.arange(len(self.q)) / len(self.q) * 100

    @property
    def n_stance(self) -> int:
        """Samples during which the right foot stands."""
        return int(np.sum(self.force[:, 0] > ON_GROUND))


def gait_cycle(walker: Walker, gait: Gait) -> Cycle:
    """A gait's cycle, its forces and sensor readings by inverse dynamics.

    Raises:
        InvalidInputError: If the right foot never touches down: then there is no cycle to speak of.
    """
    q, v, a = cycle_motion(gait, walker.mirror)
    force, sensors = inverse_dynamics(walker, q, v, a)
    touch = np.hstack([sensors[:, walker.sensor[f"touch_{s}"]] for s in "rl"]) / walker.weight
    k0 = _touch_down(touch[:, 0])
    q[:k0, 0] += 2 * gait.step_length
    sensors[:k0] += 2 * gait.step_length * walker.sensor_advance
    q, v, force, sensors, touch = (np.roll(x, -k0, 0) for x in (q, v, force, sensors, touch))
    n = walker.n_root
    passive = passive_forces(walker, q, v)[:, n:]
    return Cycle(walker, gait, q, v, force[:, n:], sensors, touch, force[:, :n], passive)


def _touch_down(force: Array) -> int:
    """First sample of stance (a foot that touches for an instant only does not count)."""
    on = force > ON_GROUND
    starts = np.flatnonzero(on & ~np.roll(on, 1) & np.roll(on, -3))
    if len(starts) == 0:
        raise InvalidInputError("the gait has no stance phase: the right foot never touches down")
    return int(starts[0])


def metrics(cycle: Cycle) -> dict[str, float]:
    """All metrics of a cycle, in the units of :data:`~.norms.GROUPS`."""
    out = {
        **_temporal(cycle),
        **_vertical_force(cycle),
        **_centre_of_mass(cycle),
        **_joints(cycle),
        **_foot(cycle),
        **_upper_body(cycle),
        **_energy(cycle),
    }
    return {name: float(value) for name, value in out.items()}


def group_scores(measured: dict[str, float]) -> dict[str, float]:
    """Score of each group, from 0 to 1; over the metrics that were measured."""
    return {
        group: float(np.mean([b.score(measured[m]) for m, b in bands.items() if m in measured]))
        for group, bands in GROUPS.items()
    }


def score(measured: dict[str, float]) -> float:
    """Mean of the groups' scores."""
    return float(np.mean(list(group_scores(measured).values())))


def bands_met(measured: dict[str, float]) -> dict[str, bool]:
    """Whether each metric lies in its band."""
    bands = {name: band for group in GROUPS.values() for name, band in group.items()}
    return {m: bool(bands[m].low <= v <= bands[m].high) for m, v in measured.items()}


def leg_length(walker: Walker) -> float:
    """Height of the hips of the upright model [m]."""
    return float(walker.model.body("pelvis").pos[2])


def figures(walker: Walker, gait: Gait) -> dict[str, Any]:
    """What ``walking-irl gait --json`` tells of a gait.

    The cost of transport is mechanical: all motors' work, of either sign, per weight and distance.
    Moments and powers of the metrics and curves are net: motor and passive, as they are measured.
    """
    cycle = gait_cycle(walker, gait)
    measured = metrics(cycle)
    root = cycle.root / walker.weight
    hinges = walker.joints[walker.n_root :]
    return {
        "speed": gait.speed,
        "step_length": gait.step_length,
        "cadence": measured["cadence"],
        "stance_fraction": measured["stance"] / 100,
        "joint_ranges": {
            j: [float(cycle.degrees(j).min()), float(cycle.degrees(j).max())] for j in hinges
        },
        "cost_of_transport": float(
            np.abs(cycle.motor_power).sum(1).mean() / (walker.mass * GRAVITY * gait.speed)
        ),
        "peak_vertical_force": float(cycle.force.max()),
        "max_root_residual": float(np.abs(root).max()),
        "metrics": measured,
        "groups": group_scores(measured),
        "realism": score(measured),
        "bands": bands_met(measured),
        "norms": likeness(gait_curves(cycle), gait.speed, leg_length(walker)),
    }


def _temporal(c: Cycle) -> dict[str, float]:
    return {
        "cadence": 60 / c.gait.half_period,
        "step_length": c.gait.step_length,
        "stance": 100 * _share_above(c.force[:, :1]),
        "double_support": 100 * _share_above(c.force),
    }


def _share_above(force: Array) -> float:
    """Share of the cycle in which all forces exceed ON_GROUND, linear between the samples.

    Counting samples instead would make double support jump by 2.5 % of the cycle.
    """
    a, b = force - ON_GROUND, np.roll(force, -1, 0) - ON_GROUND
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = np.where((a > 0) != (b > 0), a / (a - b), 0.0)
    start = np.where(a > 0, 0.0, np.where(b > 0, crossing, 1.0)).max(1)
    end = np.where(b > 0, 1.0, np.where(a > 0, crossing, 0.0)).min(1)
    return float(np.maximum(end - start, 0).mean())


def _vertical_force(c: Cycle) -> dict[str, float]:
    """Peaks of both halves of stance, and the valley between them."""
    force = c.force[: c.n_stance, 0]
    at = np.arange(c.n_stance) / c.n_stance * 100
    half = int(np.searchsorted(at, 50))
    first, second = int(force[:half].argmax()), half + int(force[half:].argmax())
    between = (at >= np.clip(at[first], 20, 45)) & (at <= np.clip(at[second], 55, 80))
    return {
        "first_peak": force[first],
        "second_peak": force[second],
        "valley": force[between].min(),
        "first_peak_time": at[first],
        "second_peak_time": at[second],
    }


def _centre_of_mass(c: Cycle) -> dict[str, float]:
    com = c.sensor("com")
    out: dict[str, float] = {"com_vertical": np.ptp(com[:, 2])}
    if c.walker.is_lateral:
        right, left = (
            c.sensor(f"ankle_{s}")[c.force[:, i] > LOADED, 1] for i, s in enumerate("rl")
        )
        out["com_lateral"] = np.ptp(com[:, 1])
        out["step_width"] = float(abs(left.mean() - right.mean()))
    return out


def _joints(c: Cycle) -> dict[str, float]:
    hip, knee, ankle = (c.degrees(f"{j}_r") for j in ("hip_flexion", "knee", "ankle"))
    p = c.phase
    return {
        "hip_max": hip.max(),
        "hip_min": hip.min(),
        "knee_contact": knee[0],
        "knee_loading": knee[p < 28].max(),
        "knee_mid_stance": knee[(p > 25) & (p < 50)].min(),
        "knee_swing": knee.max(),
        "ankle_contact": ankle[0],
        "ankle_dorsiflexion": ankle[(p > 20) & (p < 60)].max(),
        "ankle_plantarflexion": ankle[(p > 50) & (p < 80)].min(),
    }


def _foot(c: Cycle) -> dict[str, float]:
    """Pitch at contact, and least height of the toe in the middle of swing."""
    sole = (c.sensor("toe_r") - c.sensor("heel_r"))[0]
    n, stance = len(c.q), c.n_stance
    swing = (np.arange(n) - stance) / (n - stance)
    middle = (swing > 0.3) & (swing < 0.75)
    return {
        "foot_pitch_contact": np.degrees(np.arctan2(sole[2] - TOE_HEIGHT, np.hypot(*sole[:2]))),
        "toe_clearance": c.sensor("toe_r")[middle, 2].min(),
    }


def _upper_body(c: Cycle) -> dict[str, float]:
    shoulder, trunk = c.degrees("shoulder_r"), np.degrees(np.arcsin(c.sensor("trunk_axis")))
    out: dict[str, float] = {
        "arm_range": np.ptp(shoulder),
        "arm_antiphase": np.corrcoef(shoulder, c.degrees("hip_flexion_l"))[0, 1],
        "trunk_pitch": np.ptp(trunk[:, 0]),
    }
    if c.walker.is_lateral:
        out["trunk_roll"] = np.ptp(trunk[:, 1])
        out["pelvis_yaw"] = np.ptp(c.degrees("root_yaw"))
        out["pelvis_list"] = np.ptp(c.degrees("root_roll"))
    return out


def _energy(c: Cycle) -> dict[str, float]:
    mass, ankle = c.walker.mass, c.walker.joints.index("ankle_r") - c.walker.n_root
    return {
        "ankle_power": c.power[:, ankle].max() / mass,
        "ankle_moment": -c.net[:, ankle].min() / mass,
        "positive_work": np.maximum(c.power, 0).sum(1).mean() / mass / c.gait.speed,
    }
