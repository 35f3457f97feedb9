"""The humanoid as a domain: a body and its costs, a solver, experts with ground-truth weights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.domains.contract import (
    INTERIOR,
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
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.closed_loop.rollout import averaged_gait
from walking_irl.domains.humanoid.closed_loop.trials import MANY, Measurement, Trials, measure
from walking_irl.domains.humanoid.costs.defaults import DEFAULT_COSTS, Costs
from walking_irl.domains.humanoid.demonstrations import demonstrated
from walking_irl.domains.humanoid.expert_search import OptimalGait, best_gait
from walking_irl.domains.humanoid.gait.gait import Gait, cycle_motion
from walking_irl.domains.humanoid.inverse_optimal_control import (
    NearestGait,
    nearby_costs,
    stationarity,
)
from walking_irl.domains.humanoid.learner import WarmStartSolver, search, solver_for, warm_up
from walking_irl.domains.humanoid.optimiser.solver import Solution
from walking_irl.domains.humanoid.optimiser.stages import stage
from walking_irl.domains.humanoid.options import OPTIONS, RECORDING
from walking_irl.domains.humanoid.population import POPULATIONS
from walking_irl.domains.humanoid.spec import WalkerSpec
from walking_irl.errors import SolverError
from walking_irl.expert import expert_from_returns
from walking_irl.rl.constraints import free_gradient
from walking_irl.types import Expert, Objective, Response, Rollout

MIN_WEIGHT = 0.005
"""The learner's lower bound of every weight; the gait of a vanishing weight is ill-defined."""
N_NEARBY = 40
"""Other gaits that a gait is compared with."""
SUBOPTIMAL_BY = np.deg2rad(1.0)
"""First amplitude of the perturbation that makes a gait worse [rad]."""
WORSE = (0.01, 0.10)
"""By how much a sub-optimal gait's costs exceed the optimum, relative."""
MAX_PERTURBATIONS = 8
"""Most perturbations until one makes a gait worse by that much."""
TO_PHYSICS = tuple(stage(p, 30, 1e-9, tether=1.0) for p in (1e4, 1e5, 1e6))
"""Makes a perturbed gait physical while it stays near itself."""
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
        spec: WalkerSpec,
        trials: Trials,
        rng: np.random.Generator,
        executor: Executor | None = None,
    ) -> None:
        n = max(trials.rollouts, MANY if trials.disturbance == "kicks" else 0)
        self.spec, self.rng, self.executor = spec, rng, executor
        self.trials = replace(trials, rollouts=n)

    def __call__(self, policy: Gait) -> tuple[Array, Array]:
        """Mean feature expectations (K,) of a gait in closed loop, and their covariance (K, K)."""
        measured = measure(self.spec, policy, self.trials, self.rng, self.executor)
        return -measured.mean, measured.covariance


class Humanoid:
    """The walking humanoid (see :mod:`walking_irl.domains.humanoid`).

    Args:
        body: "humanoid", "humanoid-planar" (14 instead of 25 joints, in the sagittal plane), or the
            path of an MJCF file of your own (see :mod:`~.body.load`).
        costs: What it may walk for, and what it avoids (see :mod:`~.costs.base`); drop, add or
            rescale them as you like, for example ``(*DEFAULT_COSTS, MyCost())``.
    """

    options: Mapping[str, Option] = OPTIONS
    defaults = Defaults(20, MIN_WEIGHT, INTERIOR, needs_workers=True, files="walking")
    view: str | None = "walker"
    has_trajectories = True

    def __init__(self, body: str | Path = "humanoid", costs: Costs = DEFAULT_COSTS) -> None:
        self.spec = WalkerSpec(str(body), costs)
        self.name = Path(self.spec.body).stem
        self.objectives: tuple[Objective, ...] = self.spec.stack.objectives

    @property
    def question(self) -> str:
        """What a recovery answers."""
        return f"What does the {self.name} walk for?"

    @property
    def walker(self) -> Walker:
        """The body."""
        return self.spec.walker

    def forward(self, w: Array, executor: Executor | None = None) -> Response:
        """Best gait for weights ``w``, shape (K,), from the shipped gaits."""
        return search(self.spec, w, executor)

    def expert(self, w_E: Array, rng: np.random.Generator) -> Expert:
        """Expert for given weights, known by 20 closed-loop trajectories."""
        return self.demonstrate(Request(w_E), rng=rng).expert

    def random_weights(self, population: str, rng: np.random.Generator) -> Array:
        """Ground-truth weights of a population, shape (K,)."""
        return POPULATIONS[population](rng, self.spec.stack.reference_weights)

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
        if executor is not None:
            warm_up(self.spec, executor)
        given = settings(self.options, request.options, self.name)
        if request.expert == "suboptimal":
            refuse(request.options, RECORDING, "a suboptimal gait is known exactly")
        elif given["rollouts"] == 0:
            refuse(request.options, RECORDING[1:], "without rollouts the gait is known exactly")
        trials = trials_of(given)
        w_E = request.weights
        if w_E is None:
            w_E = self.random_weights(given["population"], rng)
        search_rng, own_rng = rng.spawn(2)
        optimum = best_gait(self.spec, w_E, search_rng, executor)
        if request.expert == "suboptimal":
            return self._suboptimal(w_E, optimum, own_rng)
        gait, truth = self.unpack(optimum.x), Truth(w_E, -optimum.total_costs)
        if trials.rollouts == 0:
            return Demonstration(exact_expert(gait, optimum.total_costs), gait, truth)
        measured = measure(self.spec, gait, trials, own_rng, executor)
        shown = averaged_gait(self.walker, measured.rollouts, gait, skip=trials.skip)
        return Demonstration(expert_from(measured, shown), gait, truth, measured.rollouts)

    def _suboptimal(
        self, w_E: Array, optimum: OptimalGait, rng: np.random.Generator
    ) -> Demonstration:
        """A gait that no weights make optimal: the best one, perturbed, then made physical."""
        worsened = self._perturbed(w_E, optimum, rng)
        gait = self.unpack(worsened.x)
        expert = replace(exact_expert(gait, worsened.total_costs), suboptimality=0.0)
        return Demonstration(expert, gait, Truth(w_E, expert.mu))

    def _perturbed(self, w_E: Array, optimum: OptimalGait, rng: np.random.Generator) -> Solution:
        solver, amplitude, best = (
            solver_for(self.spec),
            SUBOPTIMAL_BY,
            float(optimum.total_costs @ w_E),
        )
        for _ in range(MAX_PERTURBATIONS):
            start = solver.perturb(optimum.x, amplitude, rng)
            worsened = solver.solve(w_E, start, TO_PHYSICS)
            worse = float(worsened.total_costs @ w_E) / best - 1.0
            if WORSE[0] <= worse <= WORSE[1]:
                return worsened
            amplitude *= 0.7 if worse > WORSE[1] else 1.3
        raise SolverError(
            f"no perturbation of {MAX_PERTURBATIONS} made the gait worse by 1 to 10 %"
        )

    def read_demonstration(self, path: Path) -> Demonstration:
        """A gait known exactly, or recorded rollouts, from a file of this product.

        Raises:
            InvalidInputError: If it cannot be read, or is no walk of this body.
        """
        shown = demonstrated(path, self.spec)
        return Demonstration(shown.expert, shown.gait, trajectories=shown.rollouts)

    def learner(
        self,
        expert: Expert,
        options: Mapping[str, Any],
        *,
        rng: np.random.Generator,
        executor: Executor | None = None,
        on_step: OnStep | None = None,
    ) -> Learner:
        """A solver that starts from the demonstrated gait."""
        forward = WarmStartSolver(expert.demonstration, self.spec, on_step, mu=expert.mu)
        if expert.covariance is None:
            return Learner(forward)
        trials = trials_of(settings(self.options, options, self.name))
        return Learner(forward, Remeasure(self.spec, trials, rng, executor))

    def policy_gradient(self, policy: Gait) -> Array:
        """Gradient of each objective in a gait, along what the root forces leave free, (n, K)."""
        return -free_gradient(*stationarity(self.spec, policy))

    def advantages(
        self, policy: Gait, *, size: float, rng: np.random.Generator
    ) -> tuple[Array, Indices]:
        """By how much a gait beats others near it in each objective, (n, K).

        They lie where gaits of weights would that are off by ``size``. All belong to one state.
        """
        X = nearby_costs(self.spec, policy, size, N_NEARBY, rng)
        return X, np.zeros(len(X), dtype=np.intp)

    def nearest(self, policy: Gait) -> NearestGait:
        """Maps weights to their best gait beside the joint angles of ``policy``."""
        return NearestGait(self.spec, policy)

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


def trials_of(options: Mapping[str, Any]) -> Trials:
    """How an expert is recorded, from all options."""
    return Trials(options["rollouts"], options["noise"], options["disturbance"])


def exact_expert(gait: Gait, total_costs: Array) -> Expert:
    """Expert whose gait is known exactly on its knots."""
    slack = SUBOPTIMALITY * float(np.mean(total_costs))
    return Expert(-total_costs, np.zeros(len(total_costs)), slack, demonstration=gait)


def expert_from(measured: Measurement, shown: Gait) -> Expert:
    """Expert known by recorded walks: their mean with its error bars, and their mean gait."""
    slack = SUBOPTIMALITY * float(np.mean(measured.mean))
    return expert_from_returns(-measured.total_costs, suboptimality=slack, demonstration=shown)
