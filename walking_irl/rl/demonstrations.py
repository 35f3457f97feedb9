"""Demonstrated states and actions: what a learner sees of an expert that it cannot ask."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.expert import expert_from_returns
from walking_irl.rl.finite_mdp import Actions, FiniteMDP
from walking_irl.rl.generative import next_states
from walking_irl.rl.tabular import checked_policy
from walking_irl.types import Expert


@dataclass(frozen=True)
class Demonstrations:
    """n trajectories of H steps.

    Attributes:
        states: Visited states: whole numbers of shape (n, H), or vectors of shape (n, H, d).
        actions: The action taken in each: whole numbers (n, H), or vectors (n, H, e).

    Raises:
        InvalidInputError: If there are no trajectories, their shapes differ, or a vector is not
            finite.
    """

    states: Any
    actions: Any

    def __post_init__(self) -> None:
        states, actions = np.asarray(self.states), np.asarray(self.actions)
        object.__setattr__(self, "states", states)
        object.__setattr__(self, "actions", actions)
        if states.ndim not in (2, 3) or actions.ndim not in (2, 3) or not states.size:
            raise InvalidInputError(
                "demonstrations need at least one trajectory of at least one step, states and "
                f"actions of shape (n, H) or (n, H, d), got {states.shape} and {actions.shape}"
            )
        if actions.shape[:2] != states.shape[:2] or actions.ndim != states.ndim:
            raise InvalidInputError(
                f"each of {states.shape[0]} x {states.shape[1]} states needs one action, got "
                f"actions of shape {actions.shape}"
            )
        if states.ndim == 2 and not (states.dtype.kind in "iu" and actions.dtype.kind in "iu"):
            raise InvalidInputError("states and actions of shape (n, H) must be whole numbers")
        if states.ndim == 3 and not (np.isfinite(states).all() and np.isfinite(actions).all()):
            raise InvalidInputError("demonstrated states and actions must be finite")

    @property
    def n_trajectories(self) -> int:
        """Number of trajectories, n."""
        return len(self.states)

    @property
    def horizon(self) -> int:
        """Steps of each trajectory, H."""
        return int(self.states.shape[1])

    def check(self, n_states: int, n_actions: int) -> None:
        """Complain unless all states and actions exist in a world of that size.

        Raises:
            InvalidInputError: If a state or an action is out of range, or they are vectors.
        """
        if self.states.ndim != 2:
            raise InvalidInputError("a finite world needs states and actions of shape (n, H)")
        for what, values, n in (
            ("states", self.states, n_states),
            ("actions", self.actions, n_actions),
        ):
            if values.min() < 0 or values.max() >= n:
                raise InvalidInputError(
                    f"demonstrated {what} must lie from 0 to {n - 1} in this world, got "
                    f"{values.min()} to {values.max()}"
                )

    def counts(self, n_states: int, n_actions: int) -> Array:
        """c[s, a]: how often action a was taken in state s, shape (S, A)."""
        self.check(n_states, n_actions)
        c = np.zeros((n_states, n_actions))
        np.add.at(c, (self.states.ravel(), self.actions.ravel()), 1.0)
        return c

    def start(self, n_states: int) -> Array:
        """Share of trajectories that begin in each state, shape (S,)."""
        return np.bincount(self.states[:, 0], minlength=n_states) / self.n_trajectories

    def features(self, Phi: Array, discount: float) -> Array:
        """Discounted features of each trajectory, sum_t gamma^t phi(s_t), shape (n, K)."""
        powers = discount ** np.arange(self.horizon)
        F: Array = np.einsum("t,ntk->nk", powers, Phi[self.states])
        return F

    def visits(self, n_states: int, discount: float) -> Array:
        """Discounted visits of each state, the cut-off tail renormalised, shape (S,)."""
        powers = discount ** np.arange(self.horizon)
        x = np.zeros(n_states)
        np.add.at(x, self.states, np.broadcast_to(powers, self.states.shape))
        visits: Array = x / self.n_trajectories / self._mass(discount)
        return visits

    def feature_expectations(self, Phi: Array, discount: float) -> Array:
        """Mean discounted features, the cut-off tail renormalised, shape (K,).

        Trajectories of H steps hold the share 1 - gamma^H of all discounted visits; dividing by
        it is exact only for a behaviour that is the same early and late.
        """
        mu: Array = self.features(Phi, discount).mean(axis=0) / self._mass(discount)
        return mu

    def expert(self, Phi: Array, discount: float) -> Expert:
        """The same with error bars, for methods that read feature expectations only.

        Raises:
            InvalidInputError: If there are fewer than 2 trajectories.
        """
        return expert_from_returns(
            self.features(Phi, discount) / self._mass(discount), demonstration=self
        )

    def _mass(self, discount: float) -> float:
        return float(1.0 - discount**self.horizon)


def demonstrate(
    mdp: FiniteMDP,
    policy: Array | Actions,
    n: int,
    horizon: int,
    *,
    rng: np.random.Generator,
    start: Array | None = None,
) -> Demonstrations:
    """Trajectories of a policy, drawn exactly from the rows of the sparse transition matrix.

    Args:
        mdp: The world.
        policy: Deterministic (S,) or stochastic (S, A).
        n: Number of trajectories.
        horizon: Steps of each, H.
        rng: Draws first states, actions and transitions.
        start: Distribution of first states, shape (S,); the world's own by default.

    Raises:
        InvalidInputError: If the policy does not fit the world, or there is nothing to draw.
    """
    if n < 1 or horizon < 1:
        raise InvalidInputError(f"need at least one trajectory of one step, got {n} of {horizon}")
    S, A = mdp.n_states, mdp.n_actions
    chances = np.cumsum(mdp.probabilities(checked_policy(mdp, policy)), axis=1)
    s = rng.choice(S, size=n, p=mdp.start if start is None else start)
    states, actions = np.empty((2, n, horizon), dtype=np.intp)
    for t in range(horizon):
        a = (chances[s] < rng.random(n)[:, None]).sum(axis=1).clip(max=A - 1)
        states[:, t], actions[:, t] = s, a
        s = next_states(mdp, s, a, rng)
    return Demonstrations(states, actions)
