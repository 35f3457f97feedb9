"""From any agent's episodes to an expert whose weights can be recovered.

Episodes come from a Gymnasium environment and whoever acts in it (:func:`collect`), or from arrays
of other packages (:func:`from_arrays`); their features are summed (:func:`discounted`) or divided
by the way walked (:func:`per_metre`), and :func:`expert_from_episodes` says how well they are
known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.expert import expert_from_returns
from walking_irl.types import Expert

Features = Callable[[Any, Any, Any], Array]
"""Features (K,) of a step, from observation, action and next observation."""


class Episode(NamedTuple):
    """What happened from a reset to the end.

    ``observations`` has T + 1 rows, ``actions`` T. ``phi`` (T, K) are the features of the steps and
    ``progress`` (T,) their lengths, one each where the environment says nothing of it.
    ``terminated`` tells an end of the world's own from one by the clock.
    """

    observations: Array
    actions: Array
    phi: Array
    progress: Array
    terminated: bool


def collect(
    env: Any,
    agent: Any,
    *,
    episodes: int,
    seed: int = 0,
    key: str = "phi",
) -> list[Episode]:
    """Let an agent act.

    Args:
        env: A Gymnasium environment whose ``info[key]`` holds the features of a step, or whose
            reward is a vector (MO-Gymnasium).
        agent: Has ``predict(observation) -> (action, state)`` as in Stable-Baselines3, or is a
            function from observation to action.
        episodes: How many.
        seed: Of the first reset.
        key: Where in ``info`` the features are.

    Raises:
        InvalidInputError: If the environment has no features, or no episode is asked for.
    """
    if episodes < 1:
        raise InvalidInputError(f"collect at least 1 episode, got {episodes}")
    act = agent if callable(agent) else lambda seen: agent.predict(seen, deterministic=True)[0]
    return [_episode(env, act, seed if i == 0 else None, key) for i in range(episodes)]


def _episode(env: Any, act: Callable[[Any], Any], seed: int | None, key: str) -> Episode:
    seen, _ = env.reset(seed=seed)
    observations, actions, phi, progress = [seen], [], [], []
    while True:
        action = act(seen)
        seen, reward, terminated, truncated, info = env.step(action)
        features = info.get(key, reward)
        if np.ndim(features) != 1:
            raise InvalidInputError(
                f"the environment has no info[{key!r}] and its reward is no vector; give features "
                "of your own to from_arrays"
            )
        observations.append(seen)
        actions.append(action)
        phi.append(features)
        progress.append(info.get("progress", 1.0))
        if terminated or truncated:
            seen_all, acted, way = map(np.asarray, (observations, actions, progress))
            return Episode(seen_all, acted, np.asarray(phi, float), way, bool(terminated))


def from_arrays(trajectories: Iterable[Any], features: Features) -> list[Episode]:
    """Episodes of other packages.

    Args:
        trajectories: Each has ``obs`` (T + 1, ...) and ``acts`` (T, ...), as in ``imitation``, or
            ``observations`` and ``actions``, as in Minari; as attributes or as keys. Whether it
            ended by itself is read from ``terminal`` or ``terminations``; unsaid, it did not.
        features: Of a step.

    Raises:
        InvalidInputError: If a trajectory has neither, or not one observation more than actions.
    """
    return [_from_array(trajectory, features) for trajectory in trajectories]


def _from_array(trajectory: Any, features: Features) -> Episode:
    seen = np.asarray(_field(trajectory, ("obs", "observations")))
    actions = np.asarray(_field(trajectory, ("acts", "actions")))
    if len(seen) != len(actions) + 1 or not len(actions):
        raise InvalidInputError(
            f"a trajectory needs one observation more than actions, got {len(seen)} observations "
            f"and {len(actions)} actions"
        )
    rows = zip(seen[:-1], actions, seen[1:], strict=True)
    phi = np.array([features(*row) for row in rows], dtype=float)
    if phi.ndim != 2:
        raise InvalidInputError(f"features of a step must have shape (K,), got {phi.shape[1:]}")
    terminal = _field(trajectory, ("terminal", "terminations"), False)
    return Episode(seen, actions, phi, np.ones(len(phi)), bool(np.ravel(terminal)[-1]))


def _field(trajectory: Any, names: tuple[str, str], default: Any = None) -> Any:
    for name in names:
        if hasattr(trajectory, name):
            return getattr(trajectory, name)
        if isinstance(trajectory, dict) and name in trajectory:
            return trajectory[name]
    if default is None:
        raise InvalidInputError(f"a trajectory needs {names[0]!r} or {names[1]!r}")
    return default


def discounted(episodes: Iterable[Episode], discount: float) -> Array:
    """Discounted sums of the features of each episode, shape (m, K).

    An episode that the clock has cut lacks its tail; its sum over T steps is divided by
    1 - discount^T, as if it went on as it was.

    Raises:
        InvalidInputError: If the discount is not in [0, 1), or 1 for episodes that end themselves.
    """
    episodes = list(episodes)
    if not 0.0 <= discount <= 1.0 or (discount == 1.0 and not all(e.terminated for e in episodes)):
        raise InvalidInputError(
            f"discount must lie in [0, 1), or be 1 where every episode terminates; got {discount}"
        )
    sums = []
    for e in episodes:
        share = 1.0 if e.terminated else 1.0 - discount ** len(e.phi)
        sums.append(discount ** np.arange(len(e.phi)) @ e.phi / share)
    return np.array(sums)


def per_metre(episodes: Iterable[Episode], *, skip: int = 0) -> Array:
    """Minus the costs per metre of each episode, shape (m, K): what the humanoid's mu are.

    Args:
        episodes: Collected from the walker with ``key="costs"``; take whole gait cycles.
        skip: Steps that are left out at the start, until the walk has settled.

    Raises:
        InvalidInputError: If an episode makes no progress after them.
    """
    rows = []
    for e in episodes:
        way = float(e.progress[skip:].sum())
        if not way > 0.0:
            raise InvalidInputError(
                f"an episode of {len(e.phi)} steps makes no progress after the first {skip}"
            )
        rows.append(-e.phi[skip:].sum(axis=0) / way)
    return np.array(rows)


def expert_from_episodes(
    episodes: Iterable[Episode], discount: float, *, suboptimality: float = 0.0
) -> Expert:
    """Expert known by independent episodes of a discounted problem.

    Args:
        episodes: At least 2.
        discount: Of the problem, in [0, 1).
        suboptimality: How much better than the agent a policy may be under its own weights.
    """
    return expert_from_returns(discounted(episodes, discount), suboptimality=suboptimality)
