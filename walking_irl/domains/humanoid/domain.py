"""The humanoid as a domain: six objectives, a solver, experts whose weights stay hidden."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.closed_loop.policy import tracking_policy
from walking_irl.domains.humanoid.closed_loop.rollout import averaged_gait
from walking_irl.domains.humanoid.closed_loop.trials import MANY, Measurement, Trials, measure
from walking_irl.domains.humanoid.costs.defaults import DEFAULT_COSTS, Costs
from walking_irl.domains.humanoid.expert_search import OptimalGait, best_gait
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.learner import WarmStartSolver, search, solver_for
from walking_irl.domains.humanoid.optimiser.solver import Solution
from walking_irl.domains.humanoid.optimiser.stages import stage
from walking_irl.domains.humanoid.spec import WalkerSpec
from walking_irl.errors import SolverError
from walking_irl.expert import expert_from_returns
from walking_irl.types import Expert, Objective, Response, Rollout

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


@dataclass(frozen=True)
class Demonstration:
    """An expert and what stands behind it.

    Attributes:
        expert: All that a learner receives.
        gait: The optimal gait itself; for scoring and pictures.
        optimum: How it was found.
        rollouts: What was recorded, or nothing where the gait itself is the demonstration.
    """

    expert: Expert
    gait: Gait
    optimum: OptimalGait
    rollouts: tuple[Rollout, ...]


class Remeasure:
    """Measures a learner's gait the way the expert's was measured, under its own disturbances."""

    def __init__(
        self, spec: WalkerSpec, trials: Trials, seed: int, executor: Executor | None
    ) -> None:
        n = max(trials.rollouts, MANY if trials.disturbance == "kicks" else 0)
        self.spec, self.executor = spec, executor
        self.trials = replace(trials, rollouts=n)
        self.rng = np.random.default_rng([seed, 1])

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
            rescale them as you like, for example
            ``(*DEFAULT_COSTS, MyCost())`` or ``tuple(c for c in DEFAULT_COSTS if ...)``.
    """

    def __init__(self, body: str | Path = "humanoid", costs: Costs = DEFAULT_COSTS) -> None:
        self.spec = WalkerSpec(str(body), costs)
        self.name = Path(self.spec.body).stem
        self.objectives: tuple[Objective, ...] = self.spec.stack.objectives

    @property
    def walker(self) -> Walker:
        """The body."""
        return self.spec.walker

    def forward(self, w: Array, executor: Executor | None = None) -> Response:
        """Best gait for weights ``w``, shape (K,), from the shipped gaits."""
        return search(self.spec, w, executor)

    def expert(self, w_E: Array, rng: np.random.Generator) -> Expert:
        """Expert for hidden weights, known by 20 closed-loop trajectories."""
        return self.demonstrate(w_E, rng).expert

    def demonstrate(
        self,
        w_E: Array,
        rng: np.random.Generator,
        trials: Trials | None = None,
        executor: Executor | None = None,
    ) -> Demonstration:
        """Solve for the expert's gait and record it.

        Args:
            w_E: Hidden weights, shape (K,).
            rng: Source of the search's hops and of the disturbances.
            trials: What is recorded.
            executor: Runs independent solves and trajectories side by side.

        Raises:
            FallError: If the expert falls.
        """
        search_rng, walk_rng = rng.spawn(2)
        optimum = best_gait(self.spec, w_E, search_rng, executor)
        gait = Gait.from_vector(optimum.x, len(self.walker.joints))
        trials = trials or Trials()
        if trials.rollouts == 0:
            expert = exact_expert(gait, optimum.total_costs)
            return Demonstration(expert, gait, optimum, ())
        measured = measure(self.spec, gait, trials, walk_rng, executor)
        policy = tracking_policy(self.walker, gait)
        shown = averaged_gait(self.walker, measured.rollouts, policy, skip=trials.skip)
        return Demonstration(expert_from(measured, shown), gait, optimum, measured.rollouts)

    def demonstrate_poorly(
        self, w_E: Array, rng: np.random.Generator, executor: Executor | None = None
    ) -> Demonstration:
        """A walk that no weights make optimal: the best gait, shaken, then only made physical.

        Args:
            w_E: Weights of the gait that is spoilt, shape (K,).
            rng: Source of the search's hops and of the shake.
            executor: Runs independent solves side by side.

        Raises:
            SolverError: If no shake spoils it by 1 to 10 %.
        """
        search_rng, shake_rng = rng.spawn(2)
        optimum = best_gait(self.spec, w_E, search_rng, executor)
        spoilt = self._spoilt(w_E, optimum, shake_rng)
        gait = Gait.from_vector(spoilt.x, len(self.walker.joints))
        expert = replace(exact_expert(gait, spoilt.total_costs), suboptimality=0.0)
        return Demonstration(expert, gait, optimum, ())

    def _spoilt(self, w_E: Array, optimum: OptimalGait, rng: np.random.Generator) -> Solution:
        solver, amplitude, best = solver_for(self.spec), SPOILT_BY, float(optimum.total_costs @ w_E)
        for _ in range(SPOILING):
            start = solver.perturb(optimum.x, amplitude, rng)
            spoilt = solver.solve(w_E, start, TO_PHYSICS)
            worse = float(spoilt.total_costs @ w_E) / best - 1.0
            if WORSE[0] <= worse <= WORSE[1]:
                return spoilt
            amplitude *= 0.7 if worse > WORSE[1] else 1.3
        raise SolverError(f"no shake of {SPOILING} made the gait worse by 1 to 10 %")

    def learner(self, expert: Expert, threads: int = 1) -> WarmStartSolver:
        """The learner's forward solver: it starts from the demonstrated gait."""
        return WarmStartSolver(expert.demonstration, self.spec, threads)

    def pack(self, policy: Gait) -> Array:
        """A gait as one array, for files."""
        return policy.to_vector()

    def unpack(self, packed: Array) -> Gait:
        """Inverse of :meth:`pack`."""
        return Gait.from_vector(packed, len(self.walker.joints))

    def remeasure(
        self, trials: Trials, seed: int = 0, executor: Executor | None = None
    ) -> Remeasure | None:
        """Measures learners' gaits as the expert's was; None where the expert is exact."""
        if trials.rollouts == 0:
            return None
        return Remeasure(self.spec, trials, seed, executor)


def exact_expert(gait: Gait, total_costs: Array) -> Expert:
    """Expert whose gait is known exactly on its knots."""
    slack = SUBOPTIMALITY * float(np.mean(total_costs))
    return Expert(-total_costs, np.zeros(len(total_costs)), slack, demonstration=gait)


def expert_from(measured: Measurement, shown: Gait) -> Expert:
    """Expert known by recorded walks: their mean with its error bars, and their mean gait."""
    slack = SUBOPTIMALITY * float(np.mean(measured.mean))
    return expert_from_returns(-measured.total_costs, suboptimality=slack, demonstration=shown)
