"""A ready agent: the linear-quadratic regulator that walks the gait of an environment."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.closed_loop.policy import TrackingPolicy, tracking_policy
from walking_irl.environments.observation import observation_names


class TrackingAgent:
    """Torques from observations alone: the tracking policy, blind to where on the ground it walks.

    Its :meth:`predict` is that of Stable-Baselines3's agents, so that what evaluates those
    evaluates this one, too.

    Args:
        walker: Who walks.
        policy: Whose gains to use; it needs a step per knot.
    """

    def __init__(self, walker: Walker, policy: TrackingPolicy) -> None:
        groups = [name.split("/")[0] for name in observation_names(walker)]
        state = [i for i, g in enumerate(groups) if g in ("joint_positions", "joint_velocities")]
        self._state, self._phase = slice(0, len(state)), groups.index("phase")
        self._gain = policy.gain[:, :, 1:]
        reference = np.hstack([policy.reference.q, policy.reference.v])[:, 1:]
        self._bias = policy.reference.u + np.einsum("kux,kx->ku", self._gain, reference)
        self._lower, self._upper = policy.lower, policy.upper

    @classmethod
    def of(cls, env: Any) -> TrackingAgent:
        """The agent of an environment of :mod:`.walker`, wrapped or not."""
        inner = env.unwrapped
        return cls(inner.walker, tracking_policy(inner.walker, inner.gait))

    def torque(self, observation: Array) -> Array:
        """Torques [Nm], shape (nu,), for an observation."""
        cos, sin = observation[self._phase : self._phase + 2]
        K = len(self._bias)
        k = round(math.atan2(sin, cos) / (2 * math.pi) * K) % K
        u = self._bias[k] - self._gain[k] @ observation[self._state]
        return np.asarray(np.clip(u, self._lower, self._upper))

    def predict(
        self,
        observation: Array,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Array, Any]:
        """Torques for one observation (d,) or for each of several (n, d); the state is passed on.

        Returns:
            Torques (nu,) or (n, nu) as float32, and ``state``.
        """
        seen = np.asarray(observation, dtype=float)
        u = self.torque(seen) if seen.ndim == 1 else np.array([self.torque(o) for o in seen])
        return u.astype(np.float32), state
