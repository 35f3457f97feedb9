"""The forward problem "best gait for weights w", from known gaits or from a demonstration."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.contract import OnStep
from walking_irl.domains.humanoid.body.load import SHIPPED
from walking_irl.domains.humanoid.costs.defaults import DEFAULT_COSTS
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.optimiser.newton import FAR, Status
from walking_irl.domains.humanoid.optimiser.solver import SMOOTH_DECREMENT, GaitSolver, Solution
from walking_irl.domains.humanoid.optimiser.stages import DIRECT, LADDER, Stage
from walking_irl.domains.humanoid.optimiser.transcription import Transcription
from walking_irl.domains.humanoid.spec import HUMANOID, WalkerSpec
from walking_irl.domains.weights import normalised
from walking_irl.errors import SolverError
from walking_irl.types import Response
from walking_irl.workers import run_tasks

WORTH = 0.05
"""Regret above which an answer's sensitivity is not worth its price."""
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


def warm_up(spec: WalkerSpec, executor: Executor) -> None:
    """Let workers load the body side by side with this process, not when it asks them first."""
    for _ in range(os.cpu_count() or 1):
        executor.submit(_load, spec)


def _load(spec: WalkerSpec) -> None:
    solver_for(spec)


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
    return normalised(w, spec.stack.objectives)


def polish(
    spec: WalkerSpec, w: Array, x: Array, stages: Sequence[Stage], root: Array | None = None
) -> Solution:
    """One solve, as a function that a process pool can call; see :meth:`.GaitSolver.solve`."""
    return replace(solver_for(spec).solve(w, x, stages, root=root), model=None)


def respond(
    solver: GaitSolver,
    w: Array,
    best: Solution,
    others: Iterable[Solution] = (),
    is_wanted: bool = True,
) -> Response:
    """The answer to a query: the best gait, and all gaits that were evaluated on the way.

    Its sensitivity comes along if it is wanted and the gait is a smooth minimum.
    """
    k = len(best.total_costs)
    everything = [best, *others]
    passed = np.vstack([p for s in everything for p in (s.passed.reshape(-1, k), s.total_costs)])
    info = {
        "iterations": sum(s.iterations for s in everything),
        "starts": len(everything),
        "status": best.status.name.lower(),
        "is_stalled": best.status in (Status.STUCK, Status.CAPPED),
    }
    sensitivity = None
    if is_wanted:
        found = solver.sensitivity_of(w, best)
        info["decrement"] = np.inf if found is None else found[2]
        if found is not None and found[2] < SMOOTH_DECREMENT:
            sensitivity = found[0]
    return Response(
        policy=Gait.from_vector(best.x, solver.problem.nv),
        mu=-best.total_costs,
        sensitivity=sensitivity,
        evaluated=-passed,
        info=info,
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
    dual = solver_for(spec).dual
    solutions = run_tasks(polish, [(spec, w, s.x, LADDER, dual(s.x)) for s in near], executor)
    solutions.sort(key=lambda s: float(s.total_costs @ w))
    if not np.isfinite(solutions[0].total_costs).all():
        raise SolverError(f"no gait found for weights {w.round(4).tolist()} from {starts} starts")
    return respond(solver_for(spec), w, solutions[0], solutions[1:])


class WarmStartSolver:
    """The learner's forward solver: it sees a demonstrated gait and starts from there.

    Starting elsewhere may end in another basin than the expert's, whose worse gaits would not cut.
    A demonstration that no body could walk, like the mean of recorded cycles, is made physical
    first. The answers depend on the queries so far only through the gaits found: a solve that ends
    worse than a known gait is repeated from that gait.

    Args:
        demonstration: Demonstrated gait.
        spec: Which body, and its costs.
        threads: Threads of one solve.
        on_step: Told of every iteration of a solve in this process: its number and the cost.
        mu: Demonstrated feature expectations, shape (K,); None: those of the gait itself.

    Attributes:
        start: Gait vector from which queries start.
        demonstrated: Total costs G of the start, shape (K,).
        known: Costs that an answer must beat to cut, -mu.
        found: The answers so far.
    """

    def __init__(
        self,
        demonstration: Gait,
        spec: WalkerSpec = HUMANOID,
        threads: int = 1,
        on_step: OnStep | None = None,
        *,
        mu: Array | None = None,
    ) -> None:
        self.spec, self.threads, self.on_step = spec, threads, on_step
        solver, self.start = solver_for(spec, threads), demonstration.to_vector()
        self.start = solver.physical(self.start)
        self.demonstrated = solver.problem.evaluate(self.start).total_costs()
        self.known = self.demonstrated if mu is None else -np.asarray(mu)
        self.root = solver.dual(self.start)
        self.found: list[Start] = []

    def __getstate__(self) -> dict[str, Any]:
        """One thread in another process, unseen: a pool already uses the cores."""
        return {**self.__dict__, "threads": 1, "on_step": None}

    def __call__(self, w: Array) -> Response:
        """Best gait for weights ``w`` near the demonstration."""
        solver = solver_for(self.spec, self.threads)
        # Perturbations make what was seen dearer than its gait, at any weights: no regret, that.
        known = min(float(self.known @ w), float(self.demonstrated @ w))
        solutions = [self._solve(w, self.start, self.root, known)]
        better = self._better_start(w, float(solutions[0].total_costs @ w), known)
        if better is not None:
            solutions.append(self._solve(w, better, solver.dual(better), known))
        solutions.sort(key=lambda s: float(s.total_costs @ w))
        best = solutions[0]
        self.found.append(Start(best.x, best.total_costs))
        cost = float(best.total_costs @ w)
        if self.demonstrated @ w < cost * (1 - 1e-9):
            best = Solution(
                self.start,
                self.demonstrated,
                best.passed,
                best.iterations,
                Status.STUCK,
                self.root,
            )
        return respond(solver, w, best, solutions[1:], known < cost * (1 + WORTH))

    def _solve(self, w: Array, x: Array, root: Array | None, known: float) -> Solution:
        solver = solver_for(self.spec, self.threads)
        return solver.solve(w, x, DIRECT, known=known, root=root, on_step=self.on_step)

    def recall(self, response: Response) -> None:
        """Learn of an answer that another run has found."""
        self.found.append(Start(response.policy.to_vector(), -response.mu))

    def _better_start(self, w: Array, cost: float, known: float) -> Array | None:
        """A gait found before that is cheaper than a new answer, where the answer cuts little."""
        best = min(self.found, key=lambda s: float(s.total_costs @ w), default=None)
        if best is None or known > cost * (1 + FAR):
            return None
        return best.x if float(best.total_costs @ w) < cost * (1 - SAME_COST) else None
