"""A walker's dynamics: inverse for gaits, forward for dm_control."""

from __future__ import annotations

import warnings

import mujoco
import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker

with warnings.catch_warnings():  # on import it looks for a screen, and warns where there is none
    warnings.simplefilter("ignore")
    from dm_control import mujoco as dm_mujoco
    from dm_control.mujoco import wrapper


def inverse_dynamics(walker: Walker, q: Array, v: Array, a: Array) -> tuple[Array, Array]:
    """Generalised forces (n, nv) [N, Nm] and sensor readings (n, ns) of a motion.

    Args:
        walker: Who moves.
        q: Joint positions [m, rad], shape (n, nv).
        v: Joint velocities, shape (n, nv).
        a: Joint accelerations, shape (n, nv).
    """
    data = mujoco.MjData(walker.model)
    force, sensors = np.empty_like(q), np.empty((len(q), walker.model.nsensordata))
    for k in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], v[k], a[k]
        mujoco.mj_inverse(walker.model, data)
        force[k], sensors[k] = data.qfrc_inverse, data.sensordata
    return force, sensors


def passive_forces(walker: Walker, q: Array, v: Array) -> Array:
    """Forces of joints' springs and dampers (n, nv) [N, Nm] of a motion.

    Args:
        walker: Who moves.
        q: Joint positions [m, rad], shape (n, nv).
        v: Joint velocities, shape (n, nv).
    """
    data = mujoco.MjData(walker.model)
    force = np.empty_like(q)
    for k in range(len(q)):
        data.qpos[:], data.qvel[:] = q[k], v[k]
        mujoco.mj_fwdPosition(walker.model, data)
        mujoco.mj_fwdVelocity(walker.model, data)
        force[k] = data.qfrc_passive
    return force


class WalkerPhysics(dm_mujoco.Physics):  # type: ignore[misc]
    """MuJoCo's simulation of a walker, whose steps check for trouble in a fifth of the time.

    Attributes:
        has_diverged: Whether a step since the last reset had no valid end: torques within the
            control range can whirl a limb faster than a timestep resolves. MuJoCo then goes on from
            an upright body at rest, so nothing that follows means anything.
    """

    has_diverged = False

    @classmethod
    def of(cls, walker: Walker, timestep: float) -> WalkerPhysics:
        """Simulation of a walker with this timestep [s]."""
        physics: WalkerPhysics = cls.from_model(wrapper.MjModel(walker.model_at(timestep)))
        return physics

    def reset(self, keyframe_id: int | None = None) -> None:
        """Back to the model's own state, in which nothing has gone wrong yet."""
        self.has_diverged = False
        super().reset(keyframe_id)

    def step(self, nstep: int = 1) -> None:
        """Advance by ``nstep`` steps; trouble raises nothing, see :attr:`has_diverged`."""
        if not self.legacy_step:
            with self.suppress_physics_errors():
                super().step(nstep)
            self.has_diverged = any(self._warnings.tolist())
            return
        model, data = self.model.ptr, self.data.ptr
        mujoco.mj_step2(model, data)
        if nstep > 1:
            mujoco.mj_step(model, data, nstep - 1)
        mujoco.mj_step1(model, data)
        self.has_diverged = any(self._warnings.tolist())  # counted since the last reset
