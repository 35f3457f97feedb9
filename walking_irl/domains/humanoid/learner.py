"""The forward problem "best gait for weights w", from the shipped gaits or from a demonstration."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import load_walker
from walking_irl.domains.humanoid.costs.defaults import OBJECTIVES
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.optimiser.newton import FAR, Stage, Status
from walking_irl.domains.humanoid.optimiser.solver import (
    DIRECT,
    LADDER,
    SMOOTH_DECREMENT,
    GaitSolver,
    Solution,
    stage,
)
from walking_irl.domains.humanoid.optimiser.transcription import ROOT_PENALTY, Transcription
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.types import Response

TO_PHYSICS = tuple(stage(p, 12, 1e-4, tether=1e5) for p in (1e4, 1e5, 1e6))
"""Makes the mean of recorded cycles physical while it stays near itself."""
PHYSICAL = 1e-3
"""Root penalty, in units of cost, above which a demonstration is made physical first."""
WORTH = 0.05
"""Regret above which an answer's sensitivity is not worth its price."""
ARCHIVE_TOL = 2e-5
"""A solve that ends worse than a known gait by more than this is repeated from that gait."""
CATALOGUE_STARTS = 3


@lru_cache
def solver_for(planar: bool, threads: int = 1) -> GaitSolver:
    """Solver of one body; one per process and number of threads."""
    return GaitSolver(Transcription(load_walker(planar), threads=threads))


def check_weights(w: Array) -> Array:
    """Weights as floats on the simplex.

    Raises:
        InvalidInputError: If they have another shape, or are negative, not finite or all zero.
    """
    w = np.asarray(w, dtype=float)
    names = ", ".join(o.name for o in OBJECTIVES)
    if w.shape != (len(OBJECTIVES),):
        raise InvalidInputError(f"expected {len(OBJECTIVES)} weights ({names}), got {w.size}")
    if not np.isfinite(w).all() or (w < 0).any() or not w.any():
        raise InvalidInputError(f"weights must be finite, >= 0 and not all zero, got {w.tolist()}")
    w = w / w.max()  # against overflow
    return np.asarray(w / w.sum())


def polish(
    planar: bool, w: Array, x: Array, stages: Sequence[Stage], root: Array | None = None
) -> Solution:
    """One solve, as a function that a process pool can call; see :meth:`.GaitSolver.solve`."""
    return solver_for(planar).solve(w, x, stages, root=root)


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
        lin = solver.linearise(best.x)
        found = solver.sensitivity(w, lin, best.root)
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
    planar: bool, w: Array, executor: Executor | None = None, starts: int = CATALOGUE_STARTS
) -> Response:
    """Best gait for weights ``w`` over the shipped gaits that are cheapest under ``w``.

    Raises:
        SolverError: If the solver stalls from every start.
    """
    w = check_weights(w)
    library = sorted(load_library(planar).values(), key=lambda s: float(s.folded @ w))[:starts]
    starts_at = [s.gait.to_vector() for s in library]
    tasks = [(planar, w, x, LADDER, solver_for(planar).dual(x)) for x in starts_at]
    solutions = run_tasks(polish, tasks, executor)
    solutions.sort(key=lambda s: float(s.total_costs @ w))
    if not np.isfinite(solutions[0].total_costs).all():
        raise SolverError(f"no gait found for weights {w.round(4).tolist()} from {starts} starts")
    return respond(solver_for(planar), w, solutions[0], solutions[1:])


def run_tasks(function: Any, tasks: Sequence[tuple[Any, ...]], executor: Executor | None) -> Any:
    """Results of ``function(*task)`` in order, side by side where there is an executor."""
    if executor is None:
        return [function(*task) for task in tasks]
    return [f.result() for f in [executor.submit(function, *task) for task in tasks]]


class Imitator:
    """The learner's forward solver: it sees a demonstrated gait and starts from there.

    Starting elsewhere may end in another basin than the expert's, whose worse gaits would not cut.
    A demonstration that no body could walk (the mean of recorded cycles) is made physical first.
    The answers depend on the queries so far only through an archive: a solve that ends worse than a
    known gait is repeated from that gait.

    Args:
        demonstration: Demonstrated gait.
        planar: Which body.
        threads: Threads of one solve.
        mu: Demonstrated feature expectations, shape (K,); None: those of the gait itself.

    Attributes:
        start: Gait vector from which queries start.
        demonstrated: Total costs G of the start, shape (K,).
        known: Costs that an answer must beat to cut, -mu.
    """

    def __init__(
        self,
        demonstration: Gait,
        planar: bool = False,
        threads: int = 1,
        mu: Array | None = None,
    ) -> None:
        self.planar, self.threads = planar, threads
        solver = solver_for(planar, threads)
        self.start = demonstration.to_vector()
        ev = solver.problem.evaluate(self.start)
        if ROOT_PENALTY * ev.root_square > PHYSICAL:
            even = np.full(len(solver.problem.stack.objectives), 1.0)
            self.start = solver.solve(even / even.sum(), self.start, TO_PHYSICS).x
            ev = solver.problem.evaluate(self.start)
        self.demonstrated = ev.total_costs()
        self.known = self.demonstrated if mu is None else -np.asarray(mu)
        self.root = solver.dual(self.start)
        self.archive: list[tuple[Array, Array]] = []

    def __getstate__(self) -> dict[str, Any]:
        """One thread in another process: a pool already uses the cores."""
        return {**self.__dict__, "threads": 1}

    def __call__(self, w: Array) -> Response:
        """Best gait for weights ``w`` near the demonstration."""
        solver = solver_for(self.planar, self.threads)
        known = float(self.known @ w)
        solutions = [solver.solve(w, self.start, DIRECT, known=known, root=self.root)]
        better = self._better_start(w, solutions[0], known)
        if better is not None:
            root = solver.dual(better)
            solutions.append(solver.solve(w, better, DIRECT, known=known, root=root))
        solutions.sort(key=lambda s: float(s.total_costs @ w))
        best = solutions[0]
        self.archive.append((best.x, best.total_costs))
        cost = float(best.total_costs @ w)
        if self.demonstrated @ w < cost * (1 - 1e-9):
            best = replace(best, x=self.start, total_costs=self.demonstrated, status=Status.STUCK)
        return respond(solver, w, best, solutions[1:], known < cost * (1 + WORTH))

    def recall(self, response: Response) -> None:
        """Learn of an answer that another run has found."""
        self.archive.append((response.policy.to_vector(), -response.mu))

    def _better_start(self, w: Array, found: Solution, known: float) -> Array | None:
        """A known gait that is cheaper than what was found, where that matters."""
        cost = float(found.total_costs @ w)
        if known > cost * (1 + FAR):
            return None
        others = [(float(g @ w), x) for x, g in self.archive]
        best = min(others, key=lambda item: item[0], default=(np.inf, None))
        return best[1] if best[0] < cost * (1 - ARCHIVE_TOL) else None
