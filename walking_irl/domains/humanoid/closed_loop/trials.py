"""How a gait is measured: closed-loop rollouts under a disturbance, averaged over gait cycles."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.closed_loop.disturbance import Disturbance
from walking_irl.domains.humanoid.closed_loop.policy import tracking_policy
from walking_irl.domains.humanoid.closed_loop.rollout import Course
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.spec import WalkerSpec
from walking_irl.errors import InvalidInputError
from walking_irl.types import Rollout
from walking_irl.workers import run_tasks

DISTURBANCES = ("initial", "kicks")
MANY = 100
"""Rollouts of a learner's gait where kicks make every cycle random; simulating is cheap."""


@dataclass(frozen=True)
class Trials:
    """What is recorded of an expert.

    Attributes:
        rollouts: Number of closed-loop trajectories; 0 takes the gait itself on its knots.
        noise: Standard deviation of the random joint velocities [rad/s].
        disturbance: "initial": random initial joint velocities; "kicks": joint velocities jump at
            a random step of every cycle.
        cycles: Gait cycles that are measured per trajectory.
        skip: Gait cycles before them.
    """

    rollouts: int = 20
    noise: float = 0.02
    disturbance: str = "initial"
    cycles: int = 5
    skip: int = 2

    def __post_init__(self) -> None:
        if self.rollouts < 0 or self.rollouts == 1:
            raise InvalidInputError(
                f"rollouts must be 0 (exact) or at least 2 (for error bars), got {self.rollouts}"
            )
        if not (np.isfinite(self.noise) and self.noise >= 0):
            raise InvalidInputError(f"noise must be a number >= 0 in rad/s, got {self.noise}")
        if self.disturbance not in DISTURBANCES:
            choices = ", ".join(DISTURBANCES)
            raise InvalidInputError(
                f"unknown disturbance {self.disturbance!r}; choose from {choices}"
            )


class Measurement(NamedTuple):
    """Recorded rollouts and their total costs G, shape (n, K)."""

    rollouts: tuple[Rollout, ...]
    total_costs: Array

    @property
    def mean(self) -> Array:
        """Mean total costs, shape (K,)."""
        return np.asarray(self.total_costs.mean(axis=0))

    @property
    def covariance(self) -> Array:
        """Covariance of the mean, shape (K, K)."""
        return np.asarray(np.cov(self.total_costs.T) / len(self.total_costs))


def measure(
    spec: WalkerSpec,
    gait: Gait,
    trials: Trials,
    rng: np.random.Generator,
    executor: Executor | None = None,
    parts: int = 2,
) -> Measurement:
    """Walk a gait in closed loop and measure it.

    Args:
        spec: Which body, and its costs.
        gait: What to walk.
        trials: How often, under which disturbance.
        rng: Source of the disturbances.
        executor: Runs the trajectories side by side.
        parts: Tasks that they are divided into.

    Raises:
        FallError: If the walker falls; no trajectory is left out silently.
    """
    seeds = rng.integers(0, 2**63, size=trials.rollouts)
    chunks = [c for c in np.array_split(seeds, parts if executor else 1) if len(c)]
    tasks = [(spec, gait, trials, c) for c in chunks]
    results: list[tuple[list[Rollout], Array]] = run_tasks(walk, tasks, executor)
    walks = tuple(r for rollouts, _ in results for r in rollouts)
    return Measurement(walks, np.vstack([costs for _, costs in results]))


def walk(
    spec: WalkerSpec, gait: Gait, trials: Trials, seeds: Sequence[int]
) -> tuple[list[Rollout], Array]:
    """Trajectories of one gait, one per seed, and their mean total costs per cycle, (n, K)."""
    walker, stack = spec.walker, spec.stack
    policy = tracking_policy(walker, gait)
    noise = (0.0, trials.noise) if trials.disturbance == "kicks" else (trials.noise, 0.0)
    course = Course(walker, policy, Disturbance(*noise))
    walks, costs = [], []
    for seed in seeds:
        rng = np.random.default_rng(int(seed))
        walked = course.walk(rng, cycles=trials.skip + trials.cycles)
        walks.append(walked)
        steps = policy.steps_per_cycle
        cycles = [
            stack.rollout_costs(part(walked, c * steps, (c + 1) * steps + 1), policy.timestep)
            for c in range(trials.skip, trials.skip + trials.cycles)
        ]
        costs.append(np.mean(cycles, axis=0))
    return walks, np.array(costs)


def part(walked: Rollout, start: int, stop: int) -> Rollout:
    """Samples ``start`` to ``stop`` of a rollout."""
    fields = (walked.time, walked.q, walked.v, walked.a, walked.u, walked.sensors)
    return Rollout(*(f[start:stop] for f in fields))
