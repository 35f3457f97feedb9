"""Which view shows which domain's policies, by the name that the domain gives (``Domain.view``)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.contract import Demonstration
from walking_irl.recording.panels import panels
from walking_irl.recording.views.view import WorldView


class World(NamedTuple):
    """A view, and what it is shown."""

    view: WorldView[Any]
    motion: Callable[..., Any]
    """Maps a policy, the weights that it is the best for (or None), and the reward of each state
    (where it is not that of the weights) to what the view shows of it."""


def world_of(domain: Any, shown: Demonstration | None = None) -> World | None:
    """The world of a domain, or None where no view is registered for it.

    Args:
        domain: The domain.
        shown: The expert, whose policy stands beside the learner's; None leaves it out.
    """
    make = VIEWS.get(domain.view)
    return None if make is None else make(domain, shown)


def _walker(domain: Any, shown: Demonstration | None) -> World:
    from walking_irl.recording.views.gait import WalkerView
    from walking_irl.recording.views.motion import periodic_rollout

    def motion(policy: Any, w: Array | None = None, reward: Array | None = None) -> Any:
        return periodic_rollout(*domain.picture(policy))

    ghost = None if shown is None else motion(shown.policy)
    return World(WalkerView(domain.walker.model, ghost), motion)


def _gridworld(domain: Any, shown: Demonstration | None) -> World:
    from walking_irl.recording.views.gridworld import Landmarks

    cells = [np.argwhere(domain.regions == j)[:, ::-1] for j in range(len(domain.objectives))]
    regions = np.array([[at.min(axis=0), at.max(axis=0) + 1] for at in cells], float)
    return _grid("Gridworld", domain, shown, Landmarks(regions=regions))


def _objectworld(domain: Any, shown: Demonstration | None) -> World:
    from walking_irl.recording.views.gridworld import Landmarks

    found = domain.objects
    rows, columns = np.divmod(found.cells, domain.size)
    at = np.c_[columns, rows] + 0.5
    return _grid("Objectworld", domain, shown, Landmarks(np.empty((0, 2, 2)), at, *found[1:]))


def _grid(title: str, domain: Any, shown: Demonstration | None, landmarks: Any) -> World:
    from walking_irl.recording.views.gridworld import GridMotion, GridworldView

    def motion(policy: Any, w: Array | None = None, reward: Array | None = None) -> GridMotion:
        if reward is None and w is not None:
            reward = domain.mdp.reward(w)
        picture, shape = domain.picture(policy), (domain.size, domain.size)
        seen = None if reward is None else np.reshape(reward, shape)
        return GridMotion(picture.arrows, picture.visits, seen)

    expert = None
    if shown is not None and shown.truth is not None:
        expert = motion(shown.policy, shown.truth.w)
    is_square = bool(panels([o.name for o in domain.objectives]))  # these stand beside it
    return World(GridworldView(title, domain.size, landmarks, expert, is_square=is_square), motion)


def _lqr(domain: Any, shown: Demonstration | None) -> World:
    from walking_irl.domains.lqr import PICTURE_STEPS
    from walking_irl.recording.views.lqr import LQRView

    names = [o.name for o in domain.objectives]
    return World(LQRView(names, PICTURE_STEPS, _picture(domain, shown)), _motion(domain))


def _walking_path(domain: Any, shown: Demonstration | None) -> World:
    from walking_irl.recording.views.path import PathView

    return World(PathView(domain.goals, _picture(domain, shown)), _motion(domain))


def _driving(domain: Any, shown: Demonstration | None) -> World:
    from walking_irl.recording.views.driving import DrivingView

    road = domain.picture(np.zeros(domain.mdp.n_states, dtype=np.intp))
    return World(DrivingView(road, _picture(domain, shown)), _motion(domain))


def _picture(domain: Any, shown: Demonstration | None) -> Any:
    return None if shown is None else domain.picture(shown.policy)


def _motion(domain: Any) -> Callable[..., Any]:
    return lambda policy, w=None, reward=None: domain.picture(policy)


VIEWS: dict[str | None, Callable[[Any, Demonstration | None], World]] = {
    "walker": _walker,
    "gridworld": _gridworld,
    "objectworld": _objectworld,
    "lqr": _lqr,
    "walking-path": _walking_path,
    "driving": _driving,
}
"""What makes each view; a domain of your own may add its own, or name one of these."""
