"""The walker as a dm_control environment: torques in, observations and w.phi out.

Y. Tassa et al. (2020), dm_control: Software and tasks for continuous control. A step of the
environment holds the torques; its cost is known one step later, when the ground force at its end
is, so the reward of a step belongs to the step before it.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np
from dm_control.rl import control
from dm_env import specs

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.body.physics import WalkerPhysics
from walking_irl.domains.humanoid.closed_loop.disturbance import (
    PUSH_DURATION,
    Disturbance,
    Push,
)
from walking_irl.domains.humanoid.closed_loop.progress import FALL_METRES, price_of_progress
from walking_irl.domains.humanoid.closed_loop.step import Start, Step, Views, runs
from walking_irl.domains.humanoid.costs.base import REFERENCE_SPEED, Channels
from walking_irl.domains.humanoid.costs.defaults import DEFAULT_COSTS, Costs
from walking_irl.domains.humanoid.costs.stack import cost_stack
from walking_irl.domains.humanoid.costs.time import Time
from walking_irl.domains.humanoid.gait.gait import Gait, cycle_motion
from walking_irl.errors import InvalidInputError

FALL_DROP = 0.3  # of the pelvis below upright standing [m]
FALL_PITCH = 1.0  # of the pelvis [rad]


class WalkTask(control.Task):  # type: ignore[misc]
    """Walk along a gait's phase without falling, for progress and low costs.

    Attributes:
        phi: Feature vector of the last complete step, shape (K,): its mean over a whole cycle at
            the gait's speed is mu.
        costs: Total costs of that step, shape (K,), if it is as long as the gait's.
        progress: Length of that step, in steps of the gait's mean length.
        price_of_fall: What a fall takes back.
        last: The last step, recorded.
        n_steps: Steps since the start of the episode.
    """

    def __init__(
        self,
        walker: Walker,
        start: Start,
        *,
        random: np.random.RandomState,
        weights: Array | None = None,
        price: float = 0.0,
        steps_per_control: int = 1,
        disturbance: Disturbance | None = None,
        costs: Costs = DEFAULT_COSTS,
    ) -> None:
        """Set up the task; without ``weights`` (K,) there is no reward, which saves its work."""
        self.stack = cost_stack(walker, costs)
        _check_weights(weights, len(self.stack.objectives))
        self.walker, self.start, self.random = walker, start, random
        self.weights, self.price = weights, price
        self.disturbance = disturbance or Disturbance()
        self.control_timestep = start.timestep * steps_per_control
        self.steps_per_cycle = round(start.period / self.control_timestep)
        self.price_of_fall = price * FALL_METRES / (start.speed * self.control_timestep)
        self._forget()
        self._steps_per_control = steps_per_control
        stage = np.repeat(walker.model.sensor_needstage, walker.model.sensor_dim)
        self._late = runs(np.flatnonzero(stage == mujoco.mjtStage.mjSTAGE_ACC))
        self._unit = np.ones(walker.model.nsensordata)  # of the sensors as they are observed
        touch = np.array([walker.sensor[f"touch_{side}"].start for side in "rl"])
        self._unit[touch] = walker.weight
        (self._touch,) = runs(touch)
        angle = 2 * math.pi / self.steps_per_cycle * np.arange(self.steps_per_cycle)
        self._phases = np.column_stack([np.cos(angle), np.sin(angle)])
        self._height = walker.joints.index("root_z")
        self._pitch = walker.joints.index("root_pitch")
        self._pelvis = walker.model.body("pelvis").id
        self._kick_at = -1
        self._views: Views

    def _forget(self) -> None:
        """Nothing has happened yet."""
        K = len(self.stack.objectives)
        self.last: Step | None = None
        self.phi, self.costs = np.zeros(K), np.zeros(K)
        self.progress, self.n_steps, self._pushing = 0.0, 0, False

    def initialize_episode(self, physics: WalkerPhysics) -> None:
        """Put the walker at the start of the gait."""
        data = physics.data
        data.qpos[:], data.qvel[:] = self.start.q, self.start.v
        if self.disturbance.velocity_noise > 0:
            self._kick(data, self.disturbance.velocity_noise)
        self._views = Views.of(data.ptr)
        self._forget()
        self._kick_at = self.random.randint(self.steps_per_cycle)

    def before_step(self, action: Array, physics: WalkerPhysics) -> None:
        """Set the torques and note the state; a push acts here."""
        views = self._views
        views.ctrl[:] = action
        if self.disturbance.push is not None:
            self._push(physics.data.ptr, self.disturbance.push)
        if self._steps_per_control > 1:  # else force sensors would be those of the last substep
            mujoco.mj_forward(physics.model.ptr, physics.data.ptr)
        self._state = views.q.copy(), views.v.copy(), views.sensors.copy()

    def after_step(self, physics: WalkerPhysics) -> Step:
        """Record the step, compute the features of the one before, and kick for the next."""
        if physics.has_diverged:
            step = self._lost(physics)
        else:
            step = self._taken()
        if self.weights is not None and self.last is not None:
            self._evaluate(self.last, step)
        self.last = step
        self.n_steps += 1
        if self.disturbance.kicks > 0 and not physics.has_diverged:
            if self.n_steps % self.steps_per_cycle == self._kick_at:
                self._kick(physics.data.ptr, self.disturbance.kicks)
                mujoco.mj_step1(physics.model.ptr, physics.data.ptr)
            if self.n_steps % self.steps_per_cycle == 0:
                self._kick_at = self.random.randint(self.steps_per_cycle)
        return step

    def _taken(self) -> Step:
        views, (q, v, sensors) = self._views, self._state
        if self._steps_per_control == 1:  # force and acceleration are known only now
            for late in self._late:
                sensors[late] = views.sensors[late]
        a = (views.v - v) / self.control_timestep
        return Step(q, v, a, views.torque.copy(), sensors)

    def _lost(self, physics: WalkerPhysics) -> Step:
        """End an episode whose state is lost where it was last valid, with the forces from then.

        That completes the step before; of the step itself nothing is known.
        """
        views, (q, v, sensors), data = self._views, self._state, physics.data.ptr
        if self.last is not None:  # in mid-step, forces may be those that nothing can withstand
            for late in self._late:
                sensors[late] = self.last.sensors[late]
        views.q[:], views.v[:], views.ctrl[:] = q, v, 0.0
        data.time = self.n_steps * self.control_timestep
        mujoco.mj_step1(physics.model.ptr, data)
        views.sensors[:] = sensors
        u = np.zeros(len(views.ctrl)) if self.last is None else self.last.u
        return Step(q, v, np.zeros_like(v), u, sensors)

    def get_reward(self, physics: WalkerPhysics) -> float:
        """Price x progress - w.costs of the last complete step; without a price, w.phi."""
        if self.weights is None:
            return 0.0
        if not self.price:
            return float(self.weights @ self.phi)
        reward = self.price * self.progress - float(self.weights @ self.costs)
        if self.has_fallen(physics):
            reward -= self.price_of_fall
        return reward

    def get_termination(self, physics: WalkerPhysics) -> float | None:
        """Ends the episode with discount 0 on a fall."""
        return 0.0 if self.has_fallen(physics) else None

    def has_fallen(self, physics: WalkerPhysics) -> bool:
        """Whether the pelvis is too low or too far tilted, or the simulation has lost the body."""
        q = self._views.q.tolist()
        upright = q[self._height] > -FALL_DROP and abs(q[self._pitch]) < FALL_PITCH
        return physics.has_diverged or not (upright and math.isfinite(sum(q)))

    def get_observation(self, physics: WalkerPhysics) -> dict[str, Array]:
        """What a controller may see; everything but the position on the ground."""
        data, sensor = physics.data.ptr, self.walker.sensor
        sensors = data.sensordata / self._unit
        q = data.qpos.copy()
        com = sensors[sensor["com"]]
        com[0] -= q[0]
        return {
            "joint_positions": q[1:],
            "joint_velocities": data.qvel.copy(),
            "phase": self._phases[self.n_steps % self.steps_per_cycle].copy(),
            "centre_of_mass": com,
            "contact_forces": sensors[self._touch],
            "trunk_axis": sensors[sensor["trunk_axis"]],
            "trunk_velocity": sensors[sensor["trunk_velocity"]],
            "angular_momentum": sensors[sensor["angular_momentum"]],
        }

    def action_spec(self, physics: WalkerPhysics) -> specs.BoundedArray:
        """Torques of the joints [Nm]."""
        lower, upper = self.walker.model.actuator_ctrlrange.T
        joints = self.walker.joints[self.walker.n_root :]
        return specs.BoundedArray((len(joints),), float, lower, upper, name="\t".join(joints))

    def _evaluate(self, step: Step, after: Step) -> None:
        channels = Channels(
            q=step.q[None],
            v=step.v[None],
            v_next=after.v[None],
            a=step.a[None],
            tau=step.u[None],
            tau_next=after.u[None],
            s=step.sensors[None],
            s_next=after.sensors[None],
            h=self.control_timestep,
            distance=self.start.speed * self.control_timestep,
        )
        self.costs = self.stack.total_costs(channels)
        self.progress = float(after.q[0] - step.q[0]) / channels.distance
        # Seconds per metre, linearised at the gait's speed: phi must feel a faster step.
        self.phi = -self.costs
        for k, c in enumerate(self.stack.per_metre):
            if isinstance(c, Time):
                pace = REFERENCE_SPEED / self.start.speed / c.scale
                self.phi[k] -= (1 - self.progress) * pace

    def _push(self, data: mujoco.MjData, push: Push) -> None:
        active = push.time <= data.time < push.time + PUSH_DURATION
        if active or self._pushing:
            data.xfrc_applied[self._pelvis, :3] = push.force if active else 0
        self._pushing = active

    def _kick(self, data: mujoco.MjData, deviation: float) -> None:
        n = self.walker.n_root
        data.qvel[n:] += deviation * self.random.normal(size=len(self.walker.joints) - n)


def _check_weights(weights: Array | None, K: int) -> None:
    if weights is not None and np.shape(weights) != (K,):
        raise InvalidInputError(f"weights must have shape ({K},), got {np.shape(weights)}")


def start_of(walker: Walker, gait: Gait, *, substeps: int = 1) -> Start:
    """The first knot of a gait; ``substeps`` simulation steps per knot."""
    if substeps < 1:
        raise InvalidInputError(f"substeps must be 1 or more, got {substeps}")
    q, v, _ = cycle_motion(gait, walker.mirror)
    return Start(q[0], v[0], gait.timestep / substeps, 2 * gait.half_period, gait.speed)


def environment(
    walker: Walker,
    start: Start,
    *,
    rng: np.random.Generator,
    weights: Array | None = None,
    price: float | None = None,
    steps_per_control: int = 1,
    time_limit: float = float("inf"),
    disturbance: Disturbance | None = None,
    costs: Costs = DEFAULT_COSTS,
) -> control.Environment:
    """A dm_control environment in which the walker walks.

    Args:
        walker: Who walks.
        start: Where the walk begins and how fine the simulation is; see :func:`start_of`.
        rng: Source of the disturbances.
        weights: Of the reward, shape (K,); without them the reward is zero.
        price: Of a metre of progress, in units of w.costs per metre; 0 makes the reward w.phi. By
            default, for the shipped costs, that of the body's known gaits, at which walking pays;
            0 for costs of your own.
        steps_per_control: Simulation steps for which an action is held.
        time_limit: End of an episode [s].
        disturbance: Noise, kicks and pushes.
        costs: What the reward is made of.
    """
    if steps_per_control < 1:
        raise InvalidInputError(f"steps_per_control must be 1 or more, got {steps_per_control}")
    _check_weights(weights, len(cost_stack(walker, costs).objectives))
    if price is None:
        is_known = weights is not None and tuple(costs) == tuple(DEFAULT_COSTS)
        price = price_of_progress(np.asarray(weights), walker.body) if is_known else 0.0
    task = WalkTask(
        walker,
        start,
        random=np.random.RandomState(rng.bit_generator),
        weights=weights,
        price=price,
        steps_per_control=steps_per_control,
        disturbance=disturbance,
        costs=costs,
    )
    physics = WalkerPhysics.of(walker, start.timestep)
    return control.Environment(physics, task, time_limit=time_limit, n_sub_steps=steps_per_control)
