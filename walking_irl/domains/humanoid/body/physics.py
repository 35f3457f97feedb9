"""The simulation of a walker, for dm_control."""

from __future__ import annotations

import warnings

from walking_irl.domains.humanoid.body.anatomy import Walker

with warnings.catch_warnings():  # on import it looks for a screen, and warns where there is none
    warnings.simplefilter("ignore")
    from dm_control import mujoco
    from dm_control.mujoco import wrapper


class WalkerPhysics(mujoco.Physics):  # type: ignore[misc]
    """MuJoCo's simulation of a walker."""

    @classmethod
    def of(cls, walker: Walker, timestep: float) -> WalkerPhysics:
        """Simulation of a walker with this timestep [s]."""
        physics: WalkerPhysics = cls.from_model(wrapper.MjModel(walker.model_at(timestep)))
        return physics
