"""The humanoid as a domain: six objectives, a solver, experts whose weights stay hidden."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.contract import (
    Defaults,
    Demonstration,
    Learner,
    OnStep,
    Option,
    Request,
    Truth,
    refuse,
    settings,
)
from walking_irl.domains.humanoid.body.anatomy import Walker, load_walker
from walking_irl.domains.humanoid.closed_loop.policy import tracking_policy
from walking_irl.domains.humanoid.closed_loop.rollout import averaged_gait
from walking_irl.domains.humanoid.closed_loop.trials import MANY, Measurement, Protocol, measure
from walking_irl.domains.humanoid.costs.objectives import OBJECTIVES
from walking_irl.domains.humanoid.expert_search import OptimalGait, best_gait
from walking_irl.domains.humanoid.gait.files import load_gait
from walking_irl.domains.humanoid.gait.gait import Gait, cycle_motion
from walking_irl.domains.humanoid.learner import Imitator, search, solver_for
from walking_irl.domains.humanoid.optimiser.solver import Solution, stage
from walking_irl.domains.humanoid.options import OPTIONS, RECORDING
from walking_irl.domains.humanoid.population import POPULATIONS
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.expert import expert_from_returns
from walking_irl.types import Expert, Objective, Response, Rollout

THREADS = 2
"""Threads of one learner's solve: solves follow one another, so the cores would idle."""
MIN_WEIGHT = 0.005
"""The learner's lower bound of every weight; the gait of a vanishing weight is ill-defined."""
PHYSICAL = 0.05
"""Largest root force of a demonstration [body weights]: more is not this body's walk."""
SPOILT_BY = np.deg2rad(1.0)
"""First amplitude of the shake that spoils a gait [rad]."""
WORSE = (0.01, 0.10)
"""By how much a spoilt gait's costs exceed the optimum, relative."""
SPOILING = 8
"""Most shakes until one spoils a gait by that much."""
TO_PHYSICS = tuple(stage(p, 30, 1e-9, tether=1.0) for p in (1e4, 1e5, 1e6))
"""Makes a shaken gait physical while it stays near itself."""
SUBOPTIMALITY = 1e-4
"""How far from optimal an expert may be, relative to its costs: what contact jumps leave open."""


class Cycle(NamedTuple):
    """A gait's whole cycle, for pictures."""

    q: Array
    """Positions [m, rad], shape (2 N, nv)."""
    v: Array
    """Velocities [m/s, rad/s], shape (2 N, nv)."""
    a: Array
    """Accelerations, shape (2 N, nv)."""
    timestep: float
    """Time between knots [s]."""
    stride: float
    """Distance of the cycle [m]."""


class Remeasure:
    """Measures a learner's gait the way the expert's was measured, under its own disturbances."""

    def __init__(
        self,
        planar: bool,
        protocol: Protocol,
        rng: np.random.Generator,
        executor: Executor | None = None,
    ) -> None:
        n = max(protocol.rollouts, MANY if protocol.disturbance == "kicks" else 0)
        self.planar, self.rng, self.executor = planar, rng, executor
        self.protocol = replace(protocol, rollouts=n)

    def __call__(self, policy: Gait) -> tuple[Array, Array]:
        """Mean feature expectations (6,) of a gait in closed loop, and their covariance (6, 6)."""
        measured = measure(self.planar, policy, self.protocol, self.rng, self.executor)
        return -measured.mean, measured.covariance


class Humanoid:
    """The walking humanoid (see :mod:`walking_irl.domains.humanoid`).

    Args:
        planar: Whether it walks in the sagittal plane only (14 instead of 25 joints).
    """

    objectives: tuple[Objective, ...] = OBJECTIVES
    options: Mapping[str, Option] = OPTIONS
    defaults = Defaults(max_solves=20, min_weight=MIN_WEIGHT)
    view: str | None = "walker"
    has_trajectories = True

    def __init__(self, planar: bool = False) -> None:
        self.planar = planar
        self.name = "humanoid-planar" if planar else "humanoid"

    @property
    def question(self) -> str:
        """What a recovery answers."""
        return f"What does the {self.name} walk for?"

    @property
    def walker(self) -> Walker:
        """The body."""
        return load_walker(self.planar)

    def forward(self, w: Array, executor: Executor | None = None) -> Response:
        """Best gait for weights ``w``, shape (6,), from the shipped gaits."""
        return search(self.planar, w, executor)

    def expert(self, w_E: Array, rng: np.random.Generator) -> Expert:
        """Expert for given weights, known by 20 closed-loop trajectories."""
        return self.demonstrate(Request(w_E), rng=rng).expert

    def random_weights(self, population: str, rng: np.random.Generator) -> Array:
        """Ground-truth weights of a population, shape (6,)."""
        return POPULATIONS[population](rng)

    def demonstrate(
        self, request: Request, *, rng: np.random.Generator, executor: Executor | None = None
    ) -> Demonstration:
        """Solve for the expert's gait and record it, or make it worse.

        Args:
            request: Which expert.
            rng: Source of weights, of the search's hops and of the disturbances.
            executor: Runs independent solves and trajectories side by side.

        Raises:
            FallError: If the expert falls.
            SolverError: If no perturbation of the gait makes it worse by 1 to 10 %.
        """
        given = settings(self.options, request.options, self.name)
        if request.expert == "suboptimal":
            refuse(request.options, RECORDING, "a suboptimal gait is known exactly")
        elif given["rollouts"] == 0:
            refuse(request.options, RECORDING[1:], "without rollouts the gait is known exactly")
        protocol = protocol_of(given)
        w_E = request.weights
        if w_E is None:
            w_E = self.random_weights(given["population"], rng)
        search_rng, own_rng = rng.spawn(2)
        optimum = best_gait(self.planar, w_E, search_rng, executor)
        if request.expert == "suboptimal":
            return self._suboptimal(w_E, optimum, own_rng)
        gait, truth = self.unpack(optimum.x), Truth(w_E, -optimum.folded)
        if protocol.rollouts == 0:
            return Demonstration(exact_expert(gait, optimum.folded), gait, truth)
        measured = measure(self.planar, gait, protocol, own_rng, executor)
        policy = tracking_policy(self.walker, gait)
        shown = averaged_gait(self.walker, measured.rollouts, policy, skip=protocol.skip)
        return Demonstration(expert_from(measured, shown), gait, truth, measured.rollouts)

    def _suboptimal(
        self, w_E: Array, optimum: OptimalGait, rng: np.random.Generator
    ) -> Demonstration:
        """A gait that no weights make optimal: the best one, perturbed, then made physical."""
        spoilt = self._spoilt(w_E, optimum, rng)
        gait = self.unpack(spoilt.x)
        expert = replace(exact_expert(gait, spoilt.folded), suboptimality=0.0)
        return Demonstration(expert, gait, Truth(w_E, expert.mu))

    def _spoilt(self, w_E: Array, optimum: OptimalGait, rng: np.random.Generator) -> Solution:
        solver, amplitude, best = solver_for(self.planar), SPOILT_BY, float(optimum.folded @ w_E)
        for _ in range(SPOILING):
            start = solver.shake(optimum.x, amplitude, rng)
            spoilt = solver.solve(w_E, start, TO_PHYSICS)
            worse = float(spoilt.folded @ w_E) / best - 1.0
            if WORSE[0] <= worse <= WORSE[1]:
                return spoilt
            amplitude *= 0.7 if worse > WORSE[1] else 1.3
        raise SolverError(f"no shake of {SPOILING} made the gait worse by 1 to 10 %")

    def read_demonstration(self, path: Path) -> Demonstration:
        """A gait from a file, known exactly.

        Raises:
            InvalidInputError: If it cannot be read, or is no gait that this body can walk.
        """
        gait = load_gait(path, self.walker)
        evaluation = solver_for(self.planar).problem.evaluate(gait.to_vector())
        worst = float(np.abs(evaluation.root).max())
        if not worst < PHYSICAL:
            raise InvalidInputError(
                f"{path} is not a walk of this body: its root would need {worst:.2g} body weights "
                f"of external force (at most {PHYSICAL}); give a gait saved by walking-irl gait "
                "--save"
            )
        return Demonstration(exact_expert(gait, evaluation.folded()), gait)

    def learner(
        self,
        expert: Expert,
        options: Mapping[str, Any],
        *,
        rng: np.random.Generator,
        executor: Executor | None = None,
        on_step: OnStep | None = None,
    ) -> Learner:
        """A solver that starts from the demonstrated gait; it has the cores where a pool idles."""
        threads = 1 if executor is None else THREADS
        forward = Imitator(expert.demonstration, self.planar, threads, on_step)
        if expert.covariance is None:
            return Learner(forward)
        protocol = protocol_of(settings(self.options, options, self.name))
        return Learner(forward, Remeasure(self.planar, protocol, rng, executor))

    def picture(self, policy: Gait) -> Cycle:
        """A gait's whole cycle."""
        q, v, a = cycle_motion(policy, self.walker.mirror)
        return Cycle(q, v, a, policy.timestep, 2 * policy.step_length)

    def pack(self, policy: Gait) -> Array:
        """A gait as one array, for files."""
        return policy.to_vector()

    def unpack(self, packed: Array) -> Gait:
        """Inverse of :meth:`pack`."""
        return Gait.from_vector(packed, len(self.walker.joints))

    def pack_trajectories(self, trajectories: Sequence[Rollout]) -> dict[str, Array]:
        """Joint names, time (n, T), q and v (n, T, nv) and u (n, T, nu)."""
        columns = {
            key: np.array([getattr(rollout, key) for rollout in trajectories])
            for key in ("time", "q", "v", "u")
        }
        return {"joints": np.array(self.walker.joints), **columns}


def protocol_of(options: Mapping[str, Any]) -> Protocol:
    """How an expert is recorded, from all options."""
    return Protocol(options["rollouts"], options["noise"], options["disturbance"])


def exact_expert(gait: Gait, folded: Array) -> Expert:
    """Expert whose gait is known exactly on its knots."""
    slack = SUBOPTIMALITY * float(np.mean(folded))
    return Expert(-folded, np.zeros(len(folded)), slack, demonstration=gait)


def expert_from(measured: Measurement, shown: Gait) -> Expert:
    """Expert known by recorded walks: their mean with its error bars, and their mean gait."""
    slack = SUBOPTIMALITY * float(np.mean(measured.mean))
    return expert_from_returns(-measured.folded, suboptimality=slack, demonstration=shown)
