"""Finite domains (gridworld, driving, or a process of your own) as Gymnasium environments."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import Env
from gymnasium.spaces import Discrete

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.rl.finite_mdp import FiniteMDP


class FiniteEnv(Env[Any, Any]):
    """States and actions are numbers; the reward of a step is w.phi of the state that it leaves.

    So the discounted sum of ``info["phi"]`` estimates mu of
    :class:`~walking_irl.rl.finite_mdp.FiniteMDP`. The world has no end: episodes are truncated.

    Args:
        mdp: The world.
        w: Weights of the reward, any finite numbers, shape (K,).
        horizon: Steps of an episode.

    Raises:
        InvalidInputError: If there are not K weights, or no steps.
    """

    def __init__(self, mdp: FiniteMDP, w: Array, horizon: int = 100) -> None:
        if horizon < 1:
            raise InvalidInputError(f"an episode needs at least 1 step, got {horizon}")
        self.mdp, self.horizon = mdp, horizon
        self._reward = mdp.reward(w)
        self.observation_space = Discrete(mdp.n_states)
        self.action_space = Discrete(mdp.n_actions)
        self._T = mdp.T.tocsr()
        self._state = self._steps = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[int, dict[str, Any]]:
        """Draw a first state."""
        super().reset(seed=seed)
        self._steps = 0
        self._state = int(self.np_random.choice(self.mdp.n_states, p=self.mdp.start))
        return self._state, {"phi": np.zeros(self.mdp.n_objectives)}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        """Draw the next state."""
        if not self.action_space.contains(action):
            raise InvalidInputError(
                f"an action must be one of 0 ... {self.mdp.n_actions - 1}, got {action!r}"
            )
        s, row = self._state, int(action) * self.mdp.n_states + self._state
        ends = slice(self._T.indptr[row], self._T.indptr[row + 1])
        u = self.np_random.random() * self._T.data[ends].sum()
        at = int(np.searchsorted(np.cumsum(self._T.data[ends]), u, side="right"))
        self._state = int(self._T.indices[ends][min(at, ends.stop - ends.start - 1)])
        self._steps += 1
        info = {"phi": self.mdp.Phi[s].copy()}
        return self._state, float(self._reward[s]), False, self._steps >= self.horizon, info
