"""The expert: the best gait for hidden weights, and what is recorded of it.

The search for the gait is at least as hard as any learner's query: it starts from several gaits,
shakes the best, takes two basins to the full root penalty, and finishes far below the learner's
tolerance, also from the nudged starts that the learner uses.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.learner import NUDGE, check_weights, polish, solver_for
from walking_irl.domains.humanoid.optimiser.solver import Solution, Stage, stage
from walking_irl.workers import run_tasks

SEARCH_PENALTY = 1e4
CONTINUE = (stage(1e3, 60, 1e-5), stage(SEARCH_PENALTY, 100, 1e-6))
DIRECTLY = (stage(SEARCH_PENALTY, 100, 1e-6),)
RAISE = (stage(1e5, 60, 1e-5), stage(1e6, 150, 1e-6))
FINISH = (stage(1e6, 100, 1e-8), stage(1e6, 120, 1e-11))
APPROACH = (stage(SEARCH_PENALTY, 60, 1e-6), *RAISE)
HOP = np.deg2rad(1.0)
FINISH_SHAKES = ((0.0, NUDGE), *np.deg2rad([[0.1, 0.3], [0.3, 1.0], [0.1, 0.3]]).tolist())
"""Amplitudes of the starts of the last solves, by round [rad]; the first is the learner's."""
SAME_BASIN, RIVAL_BASIN = 2e-5, 5e-3
"""Relative cost differences below which gaits are the same, and above which a basin is lost."""
SMOOTH = 1e-8
"""Decrement of a demonstration on which every derivative can be trusted."""


@dataclass(frozen=True)
class OptimalGait:
    """A gait, its folded costs and how it was found.

    Attributes:
        x: Gait vector.
        folded: Folded costs G, shape (6,).
        decrement: Undamped Newton decrement; above 1e-5 the optimum sits on a contact jump.
        starts: Solves of the whole search.
        iterations: Their iterations.
    """

    x: Array
    folded: Array
    decrement: float
    starts: int
    iterations: int


class _Search:
    """Counts solves and keeps what they found."""

    def __init__(self, planar: bool, w: Array, executor: Executor | None) -> None:
        self.planar, self.w, self.executor = planar, w, executor
        self.solver = solver_for(planar)
        self.starts = self.iterations = 0

    def run(self, jobs: Sequence[tuple[Array, tuple[Stage, ...]]]) -> list[Solution]:
        tasks = [(self.planar, self.w, x, stages) for x, stages in jobs]
        found: list[Solution] = run_tasks(polish, tasks, self.executor)
        self.starts += len(found)
        self.iterations += sum(s.iterations for s in found)
        return found

    def search_cost(self, s: Solution) -> float:
        return self.solver.problem.evaluate(s.x).total(self.w, DIRECTLY[0].penalty)

    def cost(self, s: Solution) -> float:
        return float(s.folded @ self.w)

    def decrement(self, s: Solution) -> float:
        return self.solver.decrement(self.w, self.solver.linearise(s.x))


def best_gait(
    planar: bool,
    w: Array,
    rng: np.random.Generator,
    executor: Executor | None = None,
    also: Sequence[Array] = (),
) -> OptimalGait:
    """Search hard for the best gait under weights ``w``.

    Args:
        planar: Which body.
        w: Weights, shape (6,).
        rng: Source of the hops.
        executor: Runs independent solves side by side.
        also: Further gait vectors to start from.
    """
    w = check_weights(w)
    job = _Search(planar, w, executor)
    shipped = list(load_library(planar).values())
    near = sorted(shipped, key=lambda s: float(s.folded @ w))[:2]
    reference = shipped[0].gait.to_vector()
    starts = [(reference, CONTINUE), (reference, DIRECTLY)]
    starts += [(s.gait.to_vector(), CONTINUE) for s in near]
    starts += [(x, DIRECTLY) for x in also]
    found = sorted(job.run(starts), key=job.search_cost)
    hops = [(job.solver.shake(found[0].x, HOP, r), DIRECTLY) for r in rng.spawn(2)]
    found = sorted(found + job.run(hops), key=job.search_cost)
    raised = job.run([(s.x, RAISE) for s in _basins(found, job)])
    chosen = _finish(job, min(raised, key=job.cost), rng)
    return OptimalGait(chosen.x, chosen.folded, job.decrement(chosen), job.starts, job.iterations)


def _finish(job: _Search, best: Solution, rng: np.random.Generator) -> Solution:
    """Solve tightly, from starts ever farther away, until the best gait is a smooth minimum.

    A smooth gait is preferred to a cheaper one on a contact jump if it costs the same otherwise.
    """
    found = [best]
    for amplitudes in FINISH_SHAKES:
        best = min(found, key=job.cost)
        starts = [
            job.solver.shake(best.x, a, r) for a, r in zip(amplitudes, rng.spawn(2), strict=True)
        ]
        found += job.run(
            [
                (x, APPROACH + FINISH if a > NUDGE else FINISH)
                for a, x in zip(amplitudes, starts, strict=True)
            ]
        )
        best = min(found, key=job.cost)
        near = [s for s in found[1:] if job.cost(s) < job.cost(best) * (1 + SAME_BASIN)]
        smooth = [s for s in near if job.decrement(s) < SMOOTH]
        if smooth:
            return min(smooth, key=job.cost)
    return best


def _basins(found: Sequence[Solution], job: _Search) -> list[Solution]:
    """The best solution and the best of another basin that is nearly as good."""
    best = job.search_cost(found[0])
    rivals = [s for s in found[1:] if 1 + SAME_BASIN < job.search_cost(s) / best < 1 + RIVAL_BASIN]
    return [found[0], *rivals[:1]]
