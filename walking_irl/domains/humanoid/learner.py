"""The forward problem "best gait for weights w", from the shipped gaits or from a demonstration."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import Executor
from functools import lru_cache
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.contract import OnStep
from walking_irl.domains.humanoid.body.anatomy import load_walker
from walking_irl.domains.humanoid.costs.objectives import OBJECTIVES
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.optimiser.solver import (
    DIRECT,
    LADDER,
    SMOOTH_DECREMENT,
    GaitSolver,
    Solution,
    Stage,
)
from walking_irl.domains.humanoid.optimiser.transcription import Transcription
from walking_irl.domains.weights import normalised
from walking_irl.errors import SolverError
from walking_irl.types import Response
from walking_irl.workers import run_tasks

NUDGE = np.deg2rad(0.005)
"""Learners start this far from the demonstration, so as not to sit on its contact jump."""
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
    return normalised(w, OBJECTIVES)


def polish(planar: bool, w: Array, x: Array, stages: Sequence[Stage]) -> Solution:
    """One solve, as a function that a process pool can call."""
    return solver_for(planar).solve(w, x, stages)


def respond(solver: GaitSolver, w: Array, best: Solution, others: Iterable[Solution]) -> Response:
    """The answer to a query: the best gait, and all gaits that were evaluated on the way."""
    lin = solver.linearise(best.x)
    decrement = solver.decrement(w, lin)
    is_smooth = decrement < SMOOTH_DECREMENT
    everything = [best, *others]
    passed = np.vstack([p for s in everything for p in (s.passed.reshape(-1, 6), s.folded)])
    return Response(
        policy=Gait.from_vector(best.x, solver.problem.nv),
        mu=-best.folded,
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
    planar: bool, w: Array, executor: Executor | None = None, starts: int = CATALOGUE_STARTS
) -> Response:
    """Best gait for weights ``w`` over the shipped gaits that are cheapest under ``w``.

    Raises:
        SolverError: If the solver stalls from every start.
    """
    w = check_weights(w)
    library = sorted(load_library(planar).values(), key=lambda s: float(s.folded @ w))[:starts]
    tasks = [(planar, w, s.gait.to_vector(), LADDER) for s in library]
    solutions = run_tasks(polish, tasks, executor)
    solutions.sort(key=lambda s: float(s.folded @ w))
    if not np.isfinite(solutions[0].folded).all():
        raise SolverError(f"no gait found for weights {w.round(4).tolist()} from {starts} starts")
    return respond(solver_for(planar), w, solutions[0], solutions[1:])


class Imitator:
    """The learner's forward solver: it sees a demonstrated gait and starts from there.

    Starting elsewhere may end in another basin than the expert's, whose worse gaits would not cut.
    The answers depend on the queries so far only through an archive: a solve that ends worse than a
    known gait is repeated from that gait.

    Args:
        demonstration: Demonstrated gait.
        planar: Which body.
        threads: Threads of one solve.
        on_step: Told of every iteration of a solve in this process, with its cost.
    """

    def __init__(
        self,
        demonstration: Gait,
        planar: bool = False,
        threads: int = 1,
        on_step: OnStep | None = None,
    ) -> None:
        self.planar, self.threads, self.on_step = planar, threads, on_step
        self.start = demonstration.to_vector()
        solver = solver_for(planar, threads)
        self.demonstrated = solver.problem.evaluate(self.start).folded()
        self.archive: list[tuple[Array, Array]] = []

    def __getstate__(self) -> dict[str, Any]:
        """One thread in another process, unseen: a pool already uses the cores."""
        return {**self.__dict__, "threads": 1, "on_step": None}

    def __call__(self, w: Array) -> Response:
        """Best gait for weights ``w`` near the demonstration."""
        solver = solver_for(self.planar, self.threads)
        seed = [int(v) for v in np.round(np.asarray(w) * 1e9)]
        start = solver.shake(self.start, NUDGE, np.random.default_rng(seed))
        solutions = [solver.solve(w, start, DIRECT, self.on_step)]
        better = self._better_start(w, float(solutions[0].folded @ w))
        if better is not None:
            solutions.append(solver.solve(w, better, DIRECT, self.on_step))
        solutions.sort(key=lambda s: float(s.folded @ w))
        best = solutions[0]
        self.archive.append((best.x, best.folded))
        return respond(solver, w, best, solutions[1:])

    def recall(self, response: Response) -> None:
        """Learn of an answer that another run has found."""
        self.archive.append((response.policy.to_vector(), -response.mu))

    def _better_start(self, w: Array, cost: float) -> Array | None:
        if self.demonstrated @ w < cost * (1 - 1e-9):
            return self.start
        known = [(float(g @ w), x) for x, g in self.archive]
        best = min(known, key=lambda item: item[0], default=(np.inf, None))
        return best[1] if best[0] < cost * (1 - ARCHIVE_TOL) else None
