"""The methods of the tables, one forward solve a state: CPIRL in all its forms, the baselines."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines import BASELINES, lpal
from walking_irl.baselines.loop import Baseline, Setting
from walking_irl.cpirl.algorithm3 import Step, algorithm3
from walking_irl.cpirl.loop import cpirl
from walking_irl.errors import InvalidInputError
from walking_irl.experiments.cutting import cutting_planes
from walking_irl.geometry.centres.gravity import gravity
from walking_irl.geometry.game import game_lp
from walking_irl.types import Expert, Forward

if TYPE_CHECKING:
    from walking_irl.experiments.tasks import Task


class Contest(NamedTuple):
    """What a method is given."""

    forward: Forward
    """The learner's solver."""
    oracle: Forward
    """The same for baselines, whose queries are moved off the faces where that is needed."""
    expert: Expert
    setting: Setting
    min_weight: float
    """CPIRL's lower bound of every weight."""
    rng: np.random.Generator


class State(NamedTuple):
    """What a method holds after a forward solve."""

    mu: Array
    """Of the policy or mixture that is scored."""
    M: Array
    """Of all policies found."""
    w: Array | None
    """Estimate of the weights, where the method has one."""
    width: float | None
    """Largest weight interval, where the method has intervals."""


def states(task: Task, contest: Contest) -> Iterator[State]:
    """The states of a task's method, one per forward solve.

    Raises:
        InvalidInputError: If there is no such method.
    """
    if task.method in METHODS:
        return METHODS[task.method](task, contest)
    if task.method in BASELINES:
        return _baseline(task, contest, BASELINES[task.method])
    choices = ", ".join([*METHODS, *BASELINES])
    raise InvalidInputError(f"unknown method {task.method!r}; choose from {choices}")


def _cpirl(task: Task, contest: Contest) -> Iterator[State]:
    M: list[Array] = []
    run = cpirl(
        contest.forward,
        contest.expert,
        centre=task.arguments["centre"],
        mode="optimal" if task.criterion == "return" else "minimise",
        max_solves=task.max_solves,
        min_weight=contest.min_weight,
        rng=contest.rng,
    )
    for it in run:
        M.append(it.response.mu)
        mu = it.response.mu
        if task.scored == "mixture":
            mu = _best_mixture(np.array(M), contest.expert.mu)
        yield State(mu, np.array(M), it.estimate, it.widest)


def _best_mixture(M: Array, mu_E: Array) -> Array:
    """mu of the mixture with the smallest worst-case loss."""  # noqa: D403
    mixture = np.maximum(game_lp(M - mu_E).mixture, 0.0)
    mu: Array = mixture @ M / mixture.sum()
    return mu


def _algorithm3(task: Task, contest: Contest) -> Iterator[State]:
    centre, n = task.arguments["centre"], task.max_solves
    run = algorithm3(contest.forward, contest.expert, centre=centre, rng=contest.rng, max_solves=n)
    return _queried(run)


def _samples(task: Task, contest: Contest) -> Iterator[State]:
    centre, n = partial(gravity, n_samples=task.arguments["n_samples"]), task.max_solves
    run = cutting_planes(contest.forward, contest.expert, centre, rng=contest.rng, max_solves=n)
    return _queried(run)


def _queried(run: Iterator[Step]) -> Iterator[State]:
    M: list[Array] = []
    for step in run:
        M.append(step.response.mu)
        yield State(step.response.mu, np.array(M), step.w, None)


def _baseline(task: Task, contest: Contest, method: Baseline) -> Iterator[State]:
    run = method(
        contest.oracle,
        contest.expert,
        rng=contest.rng,
        setting=contest.setting,
        max_solves=task.max_solves,
    )
    for found in run:
        mu = found.mu if task.scored == "mixture" else found.last.mu
        w = found.W[-1]
        is_estimate = method is not lpal and w.min() >= 0  # signed weights are none
        yield State(mu, found.M, w if is_estimate else None, None)


METHODS: dict[str, Callable[[Task, Contest], Iterator[State]]] = {
    "cpirl": _cpirl,
    "utopia": _algorithm3,
    "samples": _samples,
}
"""CPIRL's own by name; the others are the baselines."""
