"""The walking path domain: where a person walks, seen from above (Mombaur et al. 2010)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.domains.contract import INTERIOR, Compared, Defaults, Option
from walking_irl.domains.exact import ExactDomain
from walking_irl.domains.path.model import costs, integrate
from walking_irl.domains.path.solver import (
    Path,
    bent_start,
    nearby_paths,
    polished,
    reduced_gradient,
    slope,
    slsqp_path,
    straight_start,
)
from walking_irl.domains.weights import checked_weights
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.types import Expert, Objective, Response

GOALS = ((3.0, 2.0, 90.0), (4.0, 0.0, 0.0), (2.0, 3.0, 180.0), (1.5, -2.5, -90.0))
"""Default goals: x [m], y [m], heading [deg], seen from the start at the origin facing +x."""
PUBLISHED = np.array([1.0, 1.2, 1.7, 0.7, 5.2])
"""Weights of the raw costs found for people (Mombaur et al. 2010)."""
SCALES = np.array([5.012, 1.277, 0.420, 0.189, 0.646])
"""Mean raw costs over the default goals with equal raw weights: the unit of each feature."""
REACH = (0.5, 20.0)
"""Distances of goals [m] that count as a walk: psi is undefined nearer, T is bounded further."""
COARSE = 1e-6
"""Tolerance of SLSQP from which Newton's method takes over."""
N_NEARBY = 60
"""Other paths to each goal that a path is compared with."""
PERTURBATION = 0.25
"""Relative spread of a sub-optimal expert's weights from goal to goal (as for the LQR)."""
OPTIONS = {
    "population": Option("uniform", "how ground-truth weights are drawn", ("uniform", "interior"))
}

OBJECTIVES = tuple(
    Objective(name, unit, float(scale), meaning, formula)
    for (name, unit, meaning, formula), scale in zip(
        (
            ("time", "s", "Arrive soon.", "T"),
            ("forward", "m^2/s^3", "Change speed gently.", "int u_1^2 dt"),
            ("rotation", "rad^2/s^3", "Turn gently.", "int u_2^2 dt"),
            ("sideways", "m^2/s^3", "Avoid sideways accelerations.", "int u_3^2 dt"),
            ("heading", "rad^2 s", "Face the goal while walking.", "int psi^2 dt"),
        ),
        SCALES,
        strict=True,
    )
)


class PathPicture(NamedTuple):
    """Paths seen from above, one per goal; times and points along the walk."""

    points: tuple[Array, ...]
    """Positions [m], each of shape (T, 2)."""
    heading: tuple[Array, ...]
    """Heading [rad] at each point, shape (T,)."""
    time: tuple[Array, ...]
    """Time [s] of each point, shape (T,)."""
    goals: Array
    """x [m], y [m], heading [rad] of each goal, shape (n, 3)."""


class WalkingPath(ExactDomain):
    """A person walks from rest to goals at which it stands again; mu = -mean costs / scales.

    A policy is a tuple of paths, one for each goal. Every solve starts from standing still and
    from the path for uniform weights, and keeps the better end; the answer has the sensitivity
    d mu / d w unless an acceleration's bound makes it meaningless.

    Args:
        goals: x [m], y [m] and heading [deg] of each goal.
        n_intervals: Intervals of constant acceleration, N.
    """

    name = "walking-path"
    objectives: tuple[Objective, ...] = OBJECTIVES
    options = OPTIONS
    defaults = Defaults(interior=INTERIOR, needs_workers=True)
    view = "walking-path"

    def __init__(
        self, goals: Sequence[tuple[float, float, float]] = GOALS, n_intervals: int = 20
    ) -> None:
        self.goals = _checked_goals(goals)
        if not 5 <= n_intervals <= 200:
            raise InvalidInputError(f"n_intervals must lie in [5, 200], got {n_intervals}")
        self.n_intervals = n_intervals

    @cached_property
    def _library(self) -> tuple[Array, ...]:
        """Start for each goal: its path at uniform weights."""
        a = 1 / (SCALES * len(SCALES))
        starts = [straight_start(goal, self.n_intervals) for goal in self.goals]
        return tuple(
            polished(a, goal, slsqp_path(a, goal, z)).z
            for goal, z in zip(self.goals, starts, strict=True)
        )

    def path(self, a: Array, i: int) -> Path:
        """Best path to goal ``i`` for raw weights ``a``, shape (5,)."""
        goal = self.goals[i]
        starts = [straight_start(goal, self.n_intervals), self._library[i]]
        if goal[1] == goal[2] == 0.0:  # straight ahead both are symmetric, the best may not be
            starts.append(bent_start(goal, self.n_intervals))
        coarse = _best(a, goal, starts)
        path = polished(a, goal, coarse)
        if path.sensitivity is None:  # Newton's method does not apply: finish by SLSQP
            path = polished(a, goal, slsqp_path(a, goal, coarse.z))
        return path

    def forward(self, w: Array) -> Response:
        """Best paths for weights ``w`` of the scaled costs, shape (5,)."""
        a = checked_weights(w, len(SCALES)) / SCALES
        return self._response(tuple(self.path(a, i) for i in range(len(self.goals))))

    def _response(self, paths: tuple[Path, ...]) -> Response:
        mu = -np.mean([p.F for p in paths], axis=0) / SCALES
        parts = [p.sensitivity for p in paths if p.sensitivity is not None]
        sensitivity = None
        if len(parts) == len(paths):
            sensitivity = -np.mean(parts, axis=0) / np.outer(SCALES, SCALES)
        return Response(paths, mu, sensitivity, info={"iterations": sum(p.n_iter for p in paths)})

    def policy_gradient(self, policy: tuple[Path, ...]) -> Array:
        """Gradient of each objective in the controls that its goal leaves free, shape (p, 5)."""
        parts = [reduced_gradient(p.z, goal) for p, goal in zip(policy, self.goals, strict=True)]
        G: Array = -np.concatenate(parts) / (len(parts) * SCALES)
        return G

    def advantages(
        self, policy: tuple[Path, ...], *, size: float, rng: np.random.Generator
    ) -> tuple[Array, Indices]:
        """By how much each path beats others to its goal in each objective.

        Args:
            policy: A path for each goal.
            size: Relative change of controls and duration.
            rng: Draws the changes.

        Returns:
            Advantages (n, 5), and the goal that each belongs to (n,).
        """
        parts = [
            (nearby_paths(p.z, goal, size, N_NEARBY, rng) - p.F) / SCALES
            for p, goal in zip(policy, self.goals, strict=True)
        ]
        return np.concatenate(parts), np.repeat(np.arange(len(parts)), N_NEARBY)

    def nearest(self, policy: tuple[Path, ...]) -> Callable[[Array], Compared]:
        """Maps weights to their best paths beside the paths ``policy``, in controls and duration.

        Raises:
            InvalidInputError: If the paths have another number of controls than this domain's.
        """
        shown = self.pack(policy)
        if shown.shape[1] != 3 * self.n_intervals + 1:
            raise InvalidInputError(
                f"paths must have {self.n_intervals} intervals, got {shown.shape[1]} parameters"
            )

        def compared(w: Array) -> Compared:
            response = self.forward(w)
            paths, a = response.policy, checked_weights(w, len(SCALES)) / SCALES

            def slopes() -> Array:
                parts = [slope(p, goal, a) for p, goal in zip(paths, self.goals, strict=True)]
                return np.asarray(np.concatenate(parts) / SCALES)

            residual = (shown - self.pack(paths)).ravel()
            return Compared(residual, slopes, paths, response.mu)

        return compared

    def suboptimal_expert(self, w_E: Array, rng: np.random.Generator) -> Expert:
        """Expert whose weights differ from goal to goal: no single weights explain it."""
        w_E = checked_weights(w_E, len(SCALES))
        paths = []
        for i in range(len(self.goals)):
            noise = 1 + PERTURBATION * rng.uniform(-1, 1, len(SCALES))
            paths.append(self.path(w_E * noise / SCALES, i))
        response = self._response(tuple(paths))
        return Expert(response.mu, np.zeros(len(SCALES)), demonstration=response.policy)

    def pack(self, policy: tuple[Path, ...]) -> Array:
        """Controls and durations as one array, for files, shape (n goals, 3 N + 1)."""
        return np.array([p.z for p in policy])

    def unpack(self, packed: Array) -> tuple[Path, ...]:
        """Inverse of :meth:`pack`, but for figures of the solver."""
        return tuple(
            Path(z, costs(integrate(z[None]), goal)[0], None, 0)
            for z, goal in zip(packed, self.goals, strict=True)
        )

    def random_weights(self, population: str, rng: np.random.Generator) -> Array:
        """Ground-truth weights, shape (5,).

        Interior ones are half equal weights, half uniform on the simplex: without the equal half
        some accelerations would cost nothing and stick to their bounds.
        """
        if population != "interior":
            return super().random_weights(population, rng)
        return 0.5 * rng.dirichlet(np.ones(len(SCALES))) + 0.5 / len(SCALES)

    def picture(self, policy: tuple[Path, ...]) -> PathPicture:
        """Points, headings and times of each path."""
        walks = [integrate(p.z[None]) for p in policy]
        times = [walk.h[0] * np.arange(walk.theta.shape[1]) for walk in walks]
        points = tuple(walk.xy[0] for walk in walks)
        return PathPicture(points, tuple(walk.theta[0] for walk in walks), tuple(times), self.goals)


def _best(a: Array, goal: Array, starts: Sequence[Array]) -> Path:
    """Cheapest path from any start; a start that does not arrive is dropped if another does.

    Raises:
        SolverError: If none arrives.
    """
    found, failure = [], SolverError("no start")
    for z in starts:
        try:
            found.append(slsqp_path(a, goal, z, COARSE))
        except SolverError as error:
            failure = error
    if not found:
        raise failure
    return min(found, key=lambda p: float(a @ p.F))


def published_weights() -> Array:
    """The published weights in the scaled space, shape (5,): (.466, .143, .066, .012, .312)."""
    w = PUBLISHED * SCALES
    return np.asarray(w / w.sum())


def _checked_goals(goals: Sequence[tuple[float, float, float]]) -> Array:
    """Goals with headings in radians, shape (n, 3)."""
    array = np.asarray(goals, dtype=float)
    if array.ndim != 2 or array.shape[1] != 3 or not len(array) or not np.isfinite(array).all():
        raise InvalidInputError("goals must be triples of finite x [m], y [m], heading [deg]")
    for goal in array:
        distance = float(np.hypot(goal[0], goal[1]))
        if not REACH[0] <= distance <= REACH[1] or abs(goal[2]) > 180:
            raise InvalidInputError(
                f"goal {goal.tolist()} is unreachable: its distance must lie in "
                f"[{REACH[0]:g}, {REACH[1]:g}] m and its heading in [-180, 180] deg"
            )
    array[:, 2] = np.deg2rad(array[:, 2])
    return array
