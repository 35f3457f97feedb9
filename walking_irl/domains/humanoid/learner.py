"""The forward problem "best gait for weights w", from known gaits or from a demonstration."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.load import SHIPPED
from walking_irl.domains.humanoid.costs.defaults import DEFAULT_COSTS
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.optimiser.solver import SMOOTH_DECREMENT, GaitSolver, Solution
from walking_irl.domains.humanoid.optimiser.stages import DIRECT, LADDER, Stage
from walking_irl.domains.humanoid.optimiser.transcription import Transcription
from walking_irl.domains.humanoid.spec import HUMANOID, WalkerSpec
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.types import Response

NUDGE = np.deg2rad(0.005)
"""Learners start this far from the demonstration, so as not to sit on its contact jump."""
SAME_COST = 2e-5
"""A solve that ends worse than a known gait by more than this is repeated from that gait."""
KNOWN_STARTS = 3


class Start(NamedTuple):
    """A known gait and its costs on the walker and under the costs that ask for it."""

    x: Array
    total_costs: Array
    """G at full root penalty, shape (K,)."""


@lru_cache
def solver_for(spec: WalkerSpec = HUMANOID, threads: int = 1) -> GaitSolver:
    """Solver of one body and its costs; one per process and number of threads."""
    return GaitSolver(Transcription(spec.walker, spec.costs, threads=threads))


@lru_cache
def known_gaits(spec: WalkerSpec = HUMANOID) -> tuple[Start, ...]:
    """Known gaits of a body, the reference first."""
    library = load_library(spec.body).values()
    if spec.body in SHIPPED and spec.costs == DEFAULT_COSTS:
        return tuple(Start(g.gait.to_vector(), g.total_costs) for g in library)
    problem = solver_for(spec).problem
    vectors = [g.gait.to_vector() for g in library]
    return tuple(Start(x, problem.evaluate(x).total_costs()) for x in vectors)


def check_weights(w: Array, spec: WalkerSpec = HUMANOID) -> Array:
    """Weights as floats on the simplex.

    Raises:
        InvalidInputError: If they have another shape, or are negative, not finite or all zero.
    """
    w = np.asarray(w, dtype=float)
    names = [c.name for c in spec.stack.per_metre]
    if w.shape != (len(names),):
        raise InvalidInputError(f"expected {len(names)} weights ({', '.join(names)}), got {w.size}")
    if not np.isfinite(w).all() or (w < 0).any() or not w.any():
        raise InvalidInputError(f"weights must be finite, >= 0 and not all zero, got {w.tolist()}")
    w = w / w.max()  # against overflow
    return np.asarray(w / w.sum())


def polish(spec: WalkerSpec, w: Array, x: Array, stages: Sequence[Stage]) -> Solution:
    """One solve, as a function that a process pool can call."""
    return solver_for(spec).solve(w, x, stages)


def respond(solver: GaitSolver, w: Array, best: Solution, others: Iterable[Solution]) -> Response:
    """The answer to a query: the best gait, and all gaits that were evaluated on the way."""
    lin = solver.linearise(best.x)
    decrement = solver.decrement(w, lin)
    is_smooth = decrement < SMOOTH_DECREMENT
    everything = [best, *others]
    passed = np.vstack([p for s in everything for p in (s.passed, s.total_costs[None])])
    return Response(
        policy=Gait.from_vector(best.x, solver.problem.nv),
        mu=-best.total_costs,
        sensitivity=solver.sensitivity(w, lin)[0] if is_smooth else None,
        evaluated=-passed,
        info={
            "iterations": sum(s.iterations for s in everything),
            "starts": len(everything),
            "decrement": decrement,
            "root_residual": float(np.abs(lin.evaluation.root).max()),
            "is_stalled": best.is_stalled,
        },
    )


def search(
    spec: WalkerSpec, w: Array, executor: Executor | None = None, starts: int = KNOWN_STARTS
) -> Response:
    """Best gait for weights ``w`` over the known gaits that are cheapest under ``w``.

    Raises:
        SolverError: If the solver stalls from every start.
    """
    w = check_weights(w, spec)
    near = sorted(known_gaits(spec), key=lambda s: float(s.total_costs @ w))[:starts]
    solutions = run_tasks(polish, [(spec, w, s.x, LADDER) for s in near], executor)
    solutions.sort(key=lambda s: float(s.total_costs @ w))
    if not np.isfinite(solutions[0].total_costs).all():
        raise SolverError(f"no gait found for weights {w.round(4).tolist()} from {starts} starts")
    return respond(solver_for(spec), w, solutions[0], solutions[1:])


def run_tasks(function: Any, tasks: Sequence[tuple[Any, ...]], executor: Executor | None) -> Any:
    """Results of ``function(*task)`` in order, side by side where there is an executor."""
    if executor is None:
        return [function(*task) for task in tasks]
    return [f.result() for f in [executor.submit(function, *task) for task in tasks]]


class WarmStartSolver:
    """The learner's forward solver: it sees a demonstrated gait and starts from there.

    Starting elsewhere may end in another basin than the expert's, whose worse gaits would not cut.
    The answers depend on the queries so far only through the gaits found: a solve that ends worse
    than a known gait is repeated from that gait.

    Args:
        demonstration: Demonstrated gait.
        spec: Which body, and its costs.
        threads: Threads of one solve.
        on_step: Told of every iteration of a solve in this process: its number and the cost.
    """

    def __init__(
        self,
        demonstration: Gait,
        spec: WalkerSpec = HUMANOID,
        threads: int = 1,
        on_step: Callable[[int, float], None] | None = None,
    ) -> None:
        self.spec, self.threads, self.on_step = spec, threads, on_step
        self.start = demonstration.to_vector()
        solver = solver_for(spec, threads)
        self.demonstrated = solver.problem.evaluate(self.start).total_costs()
        self.found: list[Start] = []

    def __getstate__(self) -> dict[str, Any]:
        """One thread in another process: a pool already uses the cores."""
        return {**self.__dict__, "threads": 1, "on_step": None}

    def __call__(self, w: Array) -> Response:
        """Best gait for weights ``w`` near the demonstration."""
        solver = solver_for(self.spec, self.threads)
        seed = [int(v) for v in np.round(np.asarray(w) * 1e9)]
        start = solver.perturb(self.start, NUDGE, np.random.default_rng(seed))
        solutions = [solver.solve(w, start, DIRECT, self.on_step)]
        better = self._better_start(w, float(solutions[0].total_costs @ w))
        if better is not None:
            solutions.append(solver.solve(w, better, DIRECT, self.on_step))
        solutions.sort(key=lambda s: float(s.total_costs @ w))
        best = solutions[0]
        self.found.append(Start(best.x, best.total_costs))
        return respond(solver, w, best, solutions[1:])

    def recall(self, response: Response) -> None:
        """Learn of an answer that another run has found."""
        self.found.append(Start(response.policy.to_vector(), -response.mu))

    def _better_start(self, w: Array, cost: float) -> Array | None:
        if self.demonstrated @ w < cost * (1 - 1e-9):
            return self.start
        best = min(self.found, key=lambda known: float(known.total_costs @ w), default=None)
        if best is None or not float(best.total_costs @ w) < cost * (1 - SAME_COST):
            return None
        return best.x
