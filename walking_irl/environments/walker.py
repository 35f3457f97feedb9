"""The walker as a Gymnasium environment, and its multi-objective twin for MO-Gymnasium.

M. Towers et al. (2024), Gymnasium: A Standard Interface for Reinforcement Learning Environments;
F. Felten et al. (2023), A Toolkit for Reliable Benchmarking and Research in Multi-Objective
Reinforcement Learning.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import Env
from gymnasium.spaces import Box
from gymnasium.utils import EzPickle

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.closed_loop.disturbance import Disturbance
from walking_irl.domains.humanoid.closed_loop.environment import environment, start_of
from walking_irl.domains.humanoid.gait.pictures import Image
from walking_irl.environments.camera import Camera, Window
from walking_irl.environments.observation import flatten, observation_names
from walking_irl.environments.suite import NOISE, TIME_LIMIT, assignment
from walking_irl.errors import InvalidInputError

RENDER_MODES = ("rgb_array", "human")


class WalkerEnv(Env[Any, Any], EzPickle):
    """Walk without falling, for the reward ``price x progress - w.costs``.

    Actions are joint torques [Nm]; agents that want [-1, 1] wrap it in Gymnasium's
    ``RescaleAction``. Observations are one vector, ``observation_names`` names its numbers. A fall
    terminates an episode, the time limit truncates it. The reward of a step, and what ``info`` says
    of it, come with the next one, when the ground force at its end is known. Every ``info`` holds

    - ``phi`` (6,): the features of the last complete step;
    - ``costs`` (6,): its total costs, if it were as long as the gait's;
    - ``progress``: its length, in steps of the gait's mean length;
    - ``x``: the way walked since the start [m]; ``fell``: whether the walker has fallen.

    Args:
        body: "humanoid", "humanoid-planar", or the path of a model file of your own.
        weights: Six objective weights, or the name of a task, see :func:`.suite.tasks`.
        price: Of a metre; by default 5 % above the least cost per metre known, so that walking
            pays (see :mod:`walking_irl.domains.humanoid.closed_loop.progress`). 0 makes the reward
            w.phi, under which falling at once is better than walking.
        time_limit: Duration of an episode [s].
        velocity_noise: Standard deviation of the joints' velocities at the start [rad/s].
        kicks: The same of velocity perturbations at a random step of every cycle [rad/s].
        steps_per_control: Simulation steps for which an action is held.
        render_mode: None, "rgb_array" or "human".
        width: Of a picture [pixels].
        height: Of a picture [pixels].

    Raises:
        InvalidInputError: If an argument is out of range.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 65}

    def __init__(
        self,
        *,
        body: str = "humanoid",
        weights: str | Array = "reference",
        price: float | None = None,
        time_limit: float = TIME_LIMIT,
        velocity_noise: float = NOISE,
        kicks: float = 0.0,
        steps_per_control: int = 1,
        render_mode: str | None = None,
        width: int = 480,
        height: int = 480,
    ) -> None:
        settings = {k: v for k, v in locals().items() if k not in ("self", "__class__")}
        EzPickle.__init__(self, **settings)
        if render_mode not in (None, *RENDER_MODES):
            raise InvalidInputError(
                f"unknown render mode {render_mode!r}; choose from {', '.join(RENDER_MODES)}"
            )
        self.walker, self.weights, self.gait = assignment(body, weights)
        self._env = environment(
            self.walker,
            start_of(self.walker, self.gait),
            rng=np.random.default_rng(0),
            weights=self.weights,
            price=price,
            steps_per_control=steps_per_control,
            time_limit=time_limit,
            disturbance=Disturbance(velocity_noise, kicks),
        )
        self.render_mode, self._size = render_mode, (height, width)
        self.metadata = {**self.metadata, "render_fps": round(1 / self._env.control_timestep())}
        self.observation_names = observation_names(self.walker)
        spec = self._env.action_spec()
        self.action_space = Box(spec.minimum.astype(np.float32), spec.maximum.astype(np.float32))
        self.observation_space = Box(-np.inf, np.inf, (len(self.observation_names),), np.float64)
        self._seen: Array = np.zeros(len(self.observation_names))
        self._camera: Camera | None = None
        self._window: Window | None = None

    @property
    def task(self) -> Any:
        """The task of dm_control behind it."""
        return self._env.task

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start an episode at the gait's first knot; ``seed`` draws its disturbances."""
        super().reset(seed=seed)
        self.task.random = np.random.RandomState(self.np_random.bit_generator)
        self._seen = flatten(self._env.reset().observation)
        self._show()
        return self._seen, self._info(fell=False)

    def step(self, action: Array) -> tuple[Array, Any, bool, bool, dict[str, Any]]:
        """Hold torques [Nm], shape (nu,), for a step."""
        torques = np.asarray(action, dtype=float)
        if torques.shape != self.action_space.shape:
            raise InvalidInputError(
                f"an action must have shape {self.action_space.shape}, got {torques.shape}"
            )
        step = self._env.step(torques)
        self._seen = flatten(step.observation)
        fell = bool(self.task.has_fallen(self._env.physics))
        self._show()
        ends = bool(step.last())
        return self._seen, self._reward(step.reward), fell, ends and not fell, self._info(fell)

    def render(self) -> Image | None:
        """A picture (height, width, 3) where the render mode is "rgb_array"."""
        if self.render_mode != "rgb_array":
            return None
        if self._camera is None:
            self._camera = Camera(self.walker, *self._size)
        return self._camera.picture(self._env.physics.data.ptr)

    def close(self) -> None:
        """Close window and camera."""
        for view in (self._camera, self._window):
            if view is not None:
                view.close()
        self._camera = self._window = None

    def _reward(self, reward: float) -> Any:
        return float(reward)

    def _info(self, fell: bool) -> dict[str, Any]:
        task = self.task
        x = float(self._env.physics.data.ptr.qpos[0] - task.start.q[0])
        phi, costs = task.phi.copy(), task.costs.copy()
        return {"phi": phi, "costs": costs, "progress": task.progress, "x": x, "fell": fell}

    def _show(self) -> None:
        if self.render_mode != "human":
            return
        if self._window is None:
            physics = self._env.physics
            timestep = self._env.control_timestep()
            self._window = Window(physics.model.ptr, physics.data.ptr, timestep)
        self._window.show()


class MOWalkerEnv(WalkerEnv):
    """The walker for MO-Gymnasium: its reward is the feature vector ``phi``, shape (6,).

    All objectives are costs with a minus sign, so an agent that weighs them alone does best to fall
    at once. Weights sum to one, so what is paid in every objective is paid whatever they are:
    with ``price`` > 0 the reward is ``phi + price (progress - fall)``, and ``WalkerEnv``'s where it
    is weighed by its weights (but for the term by which phi feels a faster step).

    Args:
        price: Of a metre, paid in every objective; 0 by default.
        **settings: Of :class:`WalkerEnv`.
    """

    def __init__(self, *, price: float = 0.0, **settings: Any) -> None:
        super().__init__(price=price, **settings)
        self.objectives = tuple(o.name for o in self.task.stack.objectives)
        self.reward_dim = len(self.objectives)
        self.reward_space = Box(-np.inf, np.inf, (self.reward_dim,), np.float64)

    def _reward(self, reward: float) -> Array:
        task = self.task
        gained = task.price * task.progress
        if task.has_fallen(self._env.physics):
            gained -= task.price_of_fall
        return np.asarray(task.phi + gained)
