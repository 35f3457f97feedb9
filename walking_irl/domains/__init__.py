"""Domains: worlds with objectives and a solver for the best policy under given weights.

The registry is the only place that knows them by name; only the walkers load a physics engine, and
only once one is made. Your own is registered by one call::

    register("mine", Entry(MyDomain, "what it is", "what solves it"))
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from walking_irl.domains.contract import Domain, Option
from walking_irl.domains.humanoid.options import OPTIONS as HUMANOID_OPTIONS
from walking_irl.domains.lqr import LQR
from walking_irl.domains.mdp.driving import Driving
from walking_irl.domains.mdp.gridworld import Gridworld
from walking_irl.domains.mdp.objectworld import Objectworld
from walking_irl.domains.mdp.random_mdp import RandomMDP
from walking_irl.domains.path.walking_path import WalkingPath
from walking_irl.errors import InvalidInputError

if TYPE_CHECKING:
    from walking_irl.domains.humanoid.domain import Humanoid


class Entry(NamedTuple):
    """A domain by name: how to make it, and what a person should know of it."""

    make: Callable[..., Domain]
    """Its class, or what makes it from keyword arguments."""
    world: str
    solver: str
    options: Mapping[str, Option] = {}
    """The domain's own, for ``--help``."""


def _humanoid(body: str) -> Callable[..., Domain]:
    def make(**options: Any) -> Domain:
        from walking_irl.domains.humanoid.domain import Humanoid

        return Humanoid(**{"body": body, **options})

    return make


DOMAINS: dict[str, Entry] = {
    "humanoid": Entry(
        _humanoid("humanoid"),
        "3-D walker, 25 joints",
        "trajectory optimisation by inverse dynamics",
        HUMANOID_OPTIONS,
    ),
    "humanoid-planar": Entry(
        _humanoid("humanoid-planar"),
        "planar walker, 14 joints",
        "trajectory optimisation by inverse dynamics",
        HUMANOID_OPTIONS,
    ),
    "gridworld": Entry(
        partial(Gridworld, cells=3),
        "16 x 16 cells, 9 patches",
        "policy iteration, exact linear solves",
        Gridworld.options,
    ),
    "objectworld": Entry(Objectworld, "16 x 16 cells, coloured objects", "policy iteration"),
    "random-mdp": Entry(RandomMDP, "50 states, random transitions", "policy iteration"),
    "driving": Entry(Driving, "three-lane road, 1531 states", "policy iteration"),
    "walking-path": Entry(
        WalkingPath,
        "walking paths seen from above",
        "optimal control, exact sensitivities",
        WalkingPath.options,
    ),
    "lqr": Entry(LQR, "linear dynamics, quadratic costs", "Riccati equation in closed form"),
}
WALKERS = ("humanoid", "humanoid-planar")
"""Those whose policies are gaits of a body."""


def register(name: str, entry: Entry) -> None:
    """Add a domain of your own: ``recover``, recordings and checkpoints then know its name.

    Raises:
        InvalidInputError: If the name is taken.
    """
    if name in DOMAINS:
        raise InvalidInputError(f"there is a domain {name!r} already; register another name")
    DOMAINS[name] = entry


def load(name: str, **options: Any) -> Domain:
    """Domain of that name.

    Args:
        name: Its name in the registry.
        **options: Arguments of the domain itself, such as the size of a grid.

    Raises:
        InvalidInputError: If there is none; the message lists those that exist.
    """
    if name not in DOMAINS:
        raise InvalidInputError(f"unknown domain {name!r}; choose from {', '.join(DOMAINS)}")
    return DOMAINS[name].make(**options)


def load_walker_domain(name: str) -> Humanoid:
    """Domain of that name, which must be a walking humanoid.

    Raises:
        InvalidInputError: If it is another one.
    """
    from walking_irl.domains.humanoid.domain import Humanoid

    domain = load(name)
    if not isinstance(domain, Humanoid):
        raise InvalidInputError(f"only {' and '.join(WALKERS)} have gaits, got {name!r}")
    return domain
