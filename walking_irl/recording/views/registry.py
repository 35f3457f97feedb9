"""Which view shows which of the small domains, and what of a policy it shows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.recording.views.view import WorldView


class World(NamedTuple):
    """A view, and what it is shown."""

    view: WorldView[Any]
    motion: Callable[[Any, Array], Any]
    """Maps a policy, and the weights that it is the best for, to what the view shows of it."""


def world_of(name: str, domain: Any, policy: Any = None, w_expert: Array | None = None) -> World:
    """The world of a small domain.

    Args:
        name: Its name in the registry of domains.
        domain: The domain.
        policy: The expert's policy, for pictures only; or None.
        w_expert: Hidden weights, for pictures only; or None.
    """
    return WORLDS[name](domain, policy, w_expert)


def _gridworld(domain: Any, policy: Any, w_expert: Array | None) -> World:
    from walking_irl.recording.views.gridworld import GridMotion, GridworldView

    def motion(policy: Any, w: Array) -> GridMotion:
        return GridMotion(domain.picture(policy), w)

    is_known = policy is not None and w_expert is not None
    expert = motion(policy, w_expert) if is_known and w_expert is not None else None
    return World(GridworldView(domain.size, expert), motion)


def _lqr(domain: Any, policy: Any, w_expert: Array | None) -> World:
    from walking_irl.recording.views.lqr import LQRView

    names = [o.name for o in domain.objectives]
    expert = None if policy is None else domain.picture(policy)
    return World(LQRView(names, expert), lambda policy, w: domain.picture(policy))


def _walking_path(domain: Any, policy: Any, w_expert: Array | None) -> World:
    from walking_irl.recording.views.path import PathView

    expert = None if policy is None else domain.picture(policy)
    return World(PathView(domain.goals, expert), lambda policy, w: domain.picture(policy))


def _driving(domain: Any, policy: Any, w_expert: Array | None) -> World:
    from walking_irl.recording.views.driving import DrivingView

    expert = None if policy is None else domain.picture(policy)
    road = domain.picture(np.zeros(domain.mdp.n_states, dtype=np.intp))
    return World(DrivingView(road, expert), lambda policy, w: domain.picture(policy))


WORLDS: dict[str, Callable[[Any, Any, Array | None], World]] = {
    "gridworld": _gridworld,
    "lqr": _lqr,
    "walking-path": _walking_path,
    "driving": _driving,
}
