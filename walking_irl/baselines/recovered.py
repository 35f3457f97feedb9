"""What an IRL method gives back: a reward, weights, a policy, samples, and why it ended."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.rl.demonstrations import Demonstrations
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.rl.tabular import best_policy
from walking_irl.types import Status

Space = Literal["simplex", "box", "free"]
"""Where weights live: w >= 0 with sum 1, |w_j| <= a bound, or anywhere (their scale counts)."""


@dataclass(frozen=True)
class Recovered:
    """Answer of an IRL method.

    Attributes:
        reward: r(s), shape (S,), or None in worlds without finitely many states.
        w: Weights, shape (K,), or None where the reward is not linear in the features.
        space: Where ``w`` lives; weights of different spaces cannot be compared.
        policy: The policy that the method recommends: optimal for its reward, or its own (a
            stationary form of its mixture); shape (S,) or (S, A), opaque in other worlds.
        mu: Feature expectations of that policy, shape (K,).
        samples: Weights drawn from a posterior, shape (m, K).
        objective: The method's objective after each iteration, shape (n,).
        iterates: The weights that each of these entries is of, shape (n, K), where it is of some;
            they may be in another scale than ``w``.
        status: Why it ended.
        info: Figures of the method (forward solves, effective sample size, intervals, ...).
        notes: Sentences that a reader of the answer should know.
    """

    reward: Array | None = None
    w: Array | None = None
    space: Space | None = None
    policy: Any = None
    mu: Array | None = None
    samples: Array | None = None
    objective: Array = field(default_factory=lambda: np.empty(0))
    iterates: Array | None = None
    status: Status = Status.CONVERGED
    info: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if (self.w is None) != (self.space is None) or self.space not in (None, *get_args(Space)):
            raise InvalidInputError(
                f"weights come with their space, one of {', '.join(get_args(Space))}; got "
                f"{'no ' if self.w is None else ''}weights and {self.space!r}"
            )
        if self.iterates is not None and len(self.iterates) != len(self.objective):
            raise InvalidInputError(
                f"each entry of the log needs its weights, got {len(self.iterates)} for "
                f"{len(self.objective)}"
            )


def from_reward(mdp: FiniteMDP, reward: Array, **fields: Any) -> Recovered:
    """A recovered tabular reward with its optimal policy and that policy's features."""
    best = best_policy(mdp, reward)
    mu = mdp.Phi.T @ best.chain.solve_transposed(mdp.start)
    return Recovered(reward=reward, policy=best.pi, mu=mu, **fields)


def from_weights(mdp: FiniteMDP, w: Array, space: Space, **fields: Any) -> Recovered:
    """Recovered weights of a reward that is linear in the world's features."""
    return from_reward(mdp, mdp.reward(w), w=w, space=space, **fields)


def from_start(mdp: FiniteMDP, demonstrations: Demonstrations) -> FiniteMDP:
    """The same world, entered where the demonstrations begin.

    Methods that match feature expectations plan from the demonstrations' own first states: what
    the draw of first states does to both sides cancels.
    """
    demonstrations.check(mdp.n_states, mdp.n_actions)
    return replace(mdp, start=demonstrations.start(mdp.n_states))


def with_features(mdp: FiniteMDP, Phi: Array) -> FiniteMDP:
    """The same world with other features of its states, shape (S, K)."""
    return replace(mdp, Phi=Phi)


def positive(**values: float) -> None:
    """Complain unless every named setting is a positive, finite number.

    Raises:
        InvalidInputError: Naming the first that is not.
    """
    for name, value in values.items():
        if not 0 < value < np.inf:
            raise InvalidInputError(f"{name} must be positive and finite, got {value}")


def not_negative(**values: float) -> None:
    """Complain unless every named setting is a finite number >= 0.

    Raises:
        InvalidInputError: Naming the first that is not.
    """
    for name, value in values.items():
        if not 0 <= value < np.inf:
            raise InvalidInputError(f"{name} must be finite and not negative, got {value}")
