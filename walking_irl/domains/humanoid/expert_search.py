"""The expert: the best gait for ground-truth weights, by a search over basins.

The search is at least as hard as any learner's query. At a soft root penalty it starts from the
reference gait (twice, see CONTINUE and DIRECTLY) and from the two known gaits that are cheapest,
and makes two basin hops from the best (D. J. Wales, J. P. K. Doye 1997, Global optimization by
basin-hopping). It takes the two best basins to the full penalty (RAISE), and the better one far
below the learner's tolerance (FINISH), also from the perturbed start that the learner uses.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.learner import (
    NUDGE,
    check_weights,
    known_gaits,
    polish,
    run_tasks,
    solver_for,
)
from walking_irl.domains.humanoid.optimiser.solver import Solution
from walking_irl.domains.humanoid.optimiser.stages import Stage, stage
from walking_irl.domains.humanoid.spec import WalkerSpec

SEARCH_PENALTY = 1e4
"""Root penalty at which basins are compared: soft, so that a gait can still change its kind."""
CONTINUE = (stage(1e3, 60, 1e-5), stage(SEARCH_PENALTY, 100, 1e-6))
"""From a gait of other weights: first through a softer penalty, which may leave its basin."""
DIRECTLY = (stage(SEARCH_PENALTY, 100, 1e-6),)
"""From a gait that is to keep its basin."""
RAISE = (stage(1e5, 60, 1e-5), stage(1e6, 150, 1e-6))
"""From the search's penalty to the full one."""
APPROACH = (stage(SEARCH_PENALTY, 60, 1e-6), *RAISE)
"""From a perturbed gait to the full penalty."""
FINISH = (stage(1e6, 100, 1e-8), stage(1e6, 120, 1e-11))
"""At the full penalty far below the learner's tolerance of 1e-7."""
HOP = np.deg2rad(1.0)
"""Amplitude of a basin hop: a perturbation of the best gait, which is then solved again [rad]."""
FINISH_STARTS = ((0.0, NUDGE), *np.deg2rad([[0.1, 0.3], [0.3, 1.0], [0.1, 0.3]]).tolist())
"""Perturbations from which the best gait is solved again, two a round [rad].

The first round has the learner's own start (NUDGE) beside the gait itself; later rounds, from ever
farther away, are run only while no gait found is a smooth minimum."""
SAME_BASIN = 2e-5
"""Relative difference of costs below which two gaits are the same one."""
OTHER_BASIN = 5e-3
"""Relative difference of costs above which another basin is no longer followed."""
SMOOTH = 1e-8
"""Decrement of a demonstration on which every derivative can be trusted."""


@dataclass(frozen=True)
class OptimalGait:
    """A gait, its total costs and how it was found.

    Attributes:
        x: Gait vector.
        total_costs: Its total costs G, shape (K,).
        decrement: Undamped Newton decrement; above 1e-5 the optimum sits on a contact jump.
        starts: Solves of the whole search.
        iterations: Their iterations.
    """

    x: Array
    total_costs: Array
    decrement: float
    starts: int
    iterations: int


class _Search:
    """Counts solves and keeps what they found."""

    def __init__(self, spec: WalkerSpec, w: Array, executor: Executor | None) -> None:
        self.spec, self.w, self.executor = spec, w, executor
        self.solver = solver_for(spec)
        self.starts = self.iterations = 0

    def run(self, jobs: Sequence[tuple[Array, tuple[Stage, ...]]]) -> list[Solution]:
        tasks = [(self.spec, self.w, x, stages) for x, stages in jobs]
        found: list[Solution] = run_tasks(polish, tasks, self.executor)
        self.starts += len(found)
        self.iterations += sum(s.iterations for s in found)
        return found

    def search_cost(self, s: Solution) -> float:
        return self.solver.problem.evaluate(s.x).total(self.w, DIRECTLY[0].penalty)

    def cost(self, s: Solution) -> float:
        return float(s.total_costs @ self.w)

    def decrement(self, s: Solution) -> float:
        return self.solver.decrement(self.w, self.solver.linearise(s.x))


def best_gait(
    spec: WalkerSpec,
    w: Array,
    rng: np.random.Generator,
    executor: Executor | None = None,
    also: Sequence[Array] = (),
) -> OptimalGait:
    """Search hard for the best gait under weights ``w``.

    Args:
        spec: Which body, and its costs.
        w: Weights, shape (K,).
        rng: Source of the basin hops.
        executor: Runs independent solves side by side.
        also: Further gait vectors to start from.
    """
    w = check_weights(w, spec)
    job = _Search(spec, w, executor)
    known = known_gaits(spec)
    near = sorted(known, key=lambda s: float(s.total_costs @ w))[:2]
    reference = known[0].x
    starts = [(reference, CONTINUE), (reference, DIRECTLY)]
    starts += [(s.x, CONTINUE) for s in near]
    starts += [(x, DIRECTLY) for x in also]
    found = sorted(job.run(starts), key=job.search_cost)
    hops = [(job.solver.perturb(found[0].x, HOP, r), DIRECTLY) for r in rng.spawn(2)]
    found = sorted(found + job.run(hops), key=job.search_cost)
    raised = job.run([(s.x, RAISE) for s in _basins(found, job)])
    chosen = _finish(job, min(raised, key=job.cost), rng)
    return OptimalGait(
        chosen.x, chosen.total_costs, job.decrement(chosen), job.starts, job.iterations
    )


def _finish(job: _Search, best: Solution, rng: np.random.Generator) -> Solution:
    """Solve tightly, from starts ever farther away, until the best gait is a smooth minimum.

    A smooth gait is preferred to a cheaper one on a contact jump if it costs the same otherwise.
    """
    found = [best]
    for amplitudes in FINISH_STARTS:
        best = min(found, key=job.cost)
        starts = [
            job.solver.perturb(best.x, a, r) for a, r in zip(amplitudes, rng.spawn(2), strict=True)
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
    others = [s for s in found[1:] if 1 + SAME_BASIN < job.search_cost(s) / best < 1 + OTHER_BASIN]
    return [found[0], *others[:1]]
