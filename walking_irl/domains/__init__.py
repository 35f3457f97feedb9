"""Domains: worlds with objectives and a solver for the best policy under given weights."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from walking_irl.errors import InvalidInputError


class Entry(NamedTuple):
    """A domain by name: how to make it, and what a person should know of it."""

    make: Callable[..., Any]
    world: str
    solver: str


def _humanoid(planar: bool) -> Callable[[], Any]:
    def make() -> Any:
        from walking_irl.domains.humanoid.domain import Humanoid

        return Humanoid(planar)

    return make


def _lqr(**options: Any) -> Any:
    from walking_irl.domains.lqr import LQR

    return LQR(**options)


def _gridworld(**options: Any) -> Any:
    from walking_irl.domains.mdp.gridworld import Gridworld

    return Gridworld(**{"cells": 3, **options})


def _driving(**options: Any) -> Any:
    from walking_irl.domains.mdp.driving import Driving

    return Driving(**options)


def _objectworld(**options: Any) -> Any:
    from walking_irl.domains.mdp.objectworld import Objectworld

    return Objectworld(**options)


def _random_mdp(**options: Any) -> Any:
    from walking_irl.domains.mdp.random_mdp import RandomMDP

    return RandomMDP(**options)


def _walking_path(**options: Any) -> Any:
    from walking_irl.domains.path.walking_path import WalkingPath

    return WalkingPath(**options)


DOMAINS: dict[str, Entry] = {
    "humanoid": Entry(
        _humanoid(False), "3-D walker, 25 joints", "trajectory optimisation by inverse dynamics"
    ),
    "humanoid-planar": Entry(
        _humanoid(True), "planar walker, 14 joints", "trajectory optimisation by inverse dynamics"
    ),
    "gridworld": Entry(
        _gridworld, "16 x 16 cells, 9 patches", "policy iteration, exact linear solves"
    ),
    "objectworld": Entry(_objectworld, "16 x 16 cells, coloured objects", "policy iteration"),
    "random-mdp": Entry(_random_mdp, "50 states, random transitions", "policy iteration"),
    "driving": Entry(_driving, "three-lane road, 1531 states", "policy iteration"),
    "walking-path": Entry(
        _walking_path, "walking paths seen from above", "optimal control, exact sensitivities"
    ),
    "lqr": Entry(_lqr, "linear dynamics, quadratic costs", "Riccati equation in closed form"),
}


def load(name: str, **options: Any) -> Any:
    """Domain of that name.

    Raises:
        InvalidInputError: If there is none; the message lists those that exist.
    """
    if name not in DOMAINS:
        raise InvalidInputError(f"unknown domain {name!r}; choose from {', '.join(DOMAINS)}")
    return DOMAINS[name].make(**options)
