"""The walker for dm_control, loaded in the manner of its suite: a body and a task.

Y. Tassa et al. (2020), dm_control: Software and tasks for continuous control. A task is named after
the shipped gait whose weights it rewards and at whose first knot an episode starts.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.body.load import SHIPPED, load_walker
from walking_irl.domains.humanoid.closed_loop.disturbance import Disturbance
from walking_irl.domains.humanoid.closed_loop.environment import environment, start_of
from walking_irl.domains.humanoid.closed_loop.progress import best_known
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.weights import checked_weights
from walking_irl.errors import InvalidInputError

BODIES = tuple(SHIPPED)
"""Bodies by name; a model file of your own is one, too."""
TIME_LIMIT = 10.0
"""Duration of an episode [s]."""
NOISE = 0.02
"""Standard deviation of the joints' velocities at the start of an episode [rad/s]."""


class Assignment(NamedTuple):
    """What is to be walked: weights, shape (6,), and the gait that an episode starts from."""

    walker: Walker
    w: Array
    gait: Gait


def tasks(body: str = "humanoid") -> tuple[str, ...]:
    """Names of a body's tasks, the reference first.

    >>> tasks()[:2]
    ('reference', 'effort x3')
    """
    return tuple(load_library(body))


def assignment(body: str, weights: str | Array) -> Assignment:
    """Weights of the simplex and their gait, from a task's name or six weights.

    Raises:
        InvalidInputError: If there is no such task, or these are no weights.
    """
    if not isinstance(weights, str):
        weights = np.asarray(weights, dtype=float)
        total = float(weights.sum()) or 1.0
        w = checked_weights(weights / total, 6)
        return Assignment(load_walker(body), w, best_known(w, body).gait)
    library = load_library(body)
    if weights not in library:
        raise InvalidInputError(f"unknown task {weights!r}; choose from {', '.join(library)}")
    return Assignment(load_walker(body), library[weights].w, library[weights].gait)


def load(
    body: str = "humanoid",
    task: str | Array = "reference",
    *,
    rng: np.random.Generator | None = None,
    time_limit: float = TIME_LIMIT,
    disturbance: Disturbance | None = None,
    price: float | None = None,
    steps_per_control: int = 1,
) -> Any:
    """A ``dm_control.rl.control.Environment`` in which a body walks.

    Args:
        body: "humanoid", "humanoid-planar", or the path of a model file of your own.
        task: A name of :func:`tasks`, or six weights of your own.
        rng: Source of the disturbances; without one, every run is the same.
        time_limit: End of an episode [s].
        disturbance: By default NOISE at the start of an episode.
        price: Of a metre in the reward, see :func:`.environment`; 0 makes the reward w.phi.
        steps_per_control: Simulation steps for which an action is held.

    Raises:
        InvalidInputError: If there is no such body or task; the message lists those that exist.

    >>> load("humanoid-planar", "reference").action_spec().shape
    (11,)
    """
    walker, w, gait = assignment(body, task)
    return environment(
        walker,
        start_of(walker, gait),
        rng=rng or np.random.default_rng(0),
        weights=w,
        price=price,
        steps_per_control=steps_per_control,
        time_limit=time_limit,
        disturbance=disturbance or Disturbance(velocity_noise=NOISE),
    )
