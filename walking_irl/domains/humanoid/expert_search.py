"""The expert: the best gait for ground-truth weights, and what is recorded of it.

Newton's method finds the minimum of a basin at once, so the price is the search for the basin: from
the known gaits that are cheapest under the weights, all at a low root penalty. A still lower
penalty first lets a gait leave its basin for a better one, or a worse one: both are tried. Where
between two knots a foot lands and leaves the ground makes basins of their own, up to some
hundredths of the cost apart, that no small step joins: the best gaits are shifted by half a knot,
as long as that helps. The best basins go to the full penalty. Detours over the optimal gaits of
neighbouring weights then find what a learner would find, and known gaits that are still cheaper are
finished themselves. An optimum that is no smooth minimum sits on a contact jump: it is perturbed
and solved again.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.learner import (
    Start,
    check_weights,
    known_gaits,
    polish,
    solver_for,
)
from walking_irl.domains.humanoid.optimiser.perturbation import shifted
from walking_irl.domains.humanoid.optimiser.solver import Solution
from walking_irl.domains.humanoid.optimiser.stages import Stage, stage
from walking_irl.domains.humanoid.spec import WalkerSpec
from walking_irl.workers import run_tasks

APPROACH = (stage(1e4, 15, 1e-4),)
SOFTLY = (stage(1e3, 8, 1e-3), *APPROACH)
"""From a gait of other weights, first through a penalty at which it may leave its basin. Tolerances
can be rough: the step that shows a decrement leaves one of about its square."""
RETURN = (stage(1e4, 25, 1e-4),)
"""After a shift: to be judged by its costs, a gait must have arrived."""
FINISH = (stage(1e6, 25, 1e-11),)
THERE, BACK = (stage(1e6, 15, 1e-3),), (stage(1e6, 25, 1e-4),)
"""A detour to a gait of neighbouring weights, and back; only the best is finished."""
NEAREST = 4
"""Known gaits from which a search starts softly, the cheapest under the weights; the first of them
also keeps its basin."""
SHIFT, MAX_SHIFTS, SHIFTED = 0.5, 6, 2
"""By how many knots the best gaits are shifted, how often at most, and how many of them."""
DETOUR = 0.05
"""How far detours go towards each corner of the simplex."""
MAX_DETOURS, WORTH_MORE = 3, 1e-4
"""Rounds of detours, as long as one finds a gait that is better by this share of the cost."""
BASINS = 2
"""Most basins that are taken to the full root penalty."""
FINISH_HOPS = tuple(np.deg2rad([[0.005, 0.1], [0.3, 1.0], [0.1, 0.3]]).tolist())
"""Amplitudes of the perturbations of an optimum that is no smooth minimum, by round [rad]."""
SAME_BASIN, RIVAL_BASIN = 5e-6, 1e-3
"""Relative cost differences below which gaits are the same, and above which a basin is lost."""
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


Job = tuple[Array, tuple[Stage, ...], Array | None]
"""Start, stages, and multipliers of the root forces at the start."""


class _Search:
    """Counts solves and keeps what they found."""

    def __init__(self, spec: WalkerSpec, w: Array, executor: Executor | None) -> None:
        self.spec, self.w, self.executor = spec, w, executor
        self.solver = solver_for(spec)
        self.starts = self.iterations = 0
        self._costs: dict[int, tuple[Solution, float]] = {}

    def run(self, jobs: Sequence[Job]) -> list[Solution]:
        tasks = [(self.spec, self.w, *job) for job in jobs]
        found: list[Solution] = run_tasks(polish, tasks, self.executor)
        self.starts += len(found)
        self.iterations += sum(s.iterations for s in found)
        return found

    def detours(self, s: Solution) -> list[Solution]:
        """Solutions from the optimal gaits of weights nearer to each corner of the simplex."""
        others = [self.w + DETOUR * (e - self.w) for e in np.eye(len(self.w))]
        tasks = [(self.spec, self.w, other, s.x, s.root) for other in others]
        found: list[Solution] = run_tasks(_detour, tasks, self.executor)
        self.starts += 2 * len(found)
        self.iterations += sum(f.iterations for f in found)
        return found

    def search_cost(self, s: Solution) -> float:
        if id(s) not in self._costs:  # asked for again and again, and takes a millisecond
            cost = self.solver.problem.evaluate(s.x).total(self.w, APPROACH[0].penalty)
            self._costs[id(s)] = s, cost  # which keeps it alive, and its id its own
        return self._costs[id(s)][1]

    def cost(self, s: Solution) -> float:
        return float(s.total_costs @ self.w)

    def shifted(self, s: Solution, knots: float) -> Array:
        return shifted(self.spec.walker, s.x, knots)

    def decrement(self, s: Solution) -> float:
        return self.solver.decrement(self.w, self.solver.linearise(s.x), s.root)

    def hop(self, s: Solution, amplitude: float, rng: np.random.Generator) -> Array:
        return self.solver.perturb(s.x, amplitude, rng)


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
        rng: Source of perturbations.
        executor: Runs independent solves side by side.
        also: Further gait vectors to start from.
    """
    w = check_weights(w, spec)
    job = _Search(spec, w, executor)
    known = known_gaits(spec)
    near = [s.x for s in sorted(known, key=lambda s: float(s.total_costs @ w))[:NEAREST]]
    starts = [(x, SOFTLY) for x in reversed(near)] + [(near[0], APPROACH)]  # the longest first
    jobs: list[Job] = [(x, stages, job.solver.dual(x)) for x, stages in starts]
    found = job.run([*jobs, *((x, APPROACH, None) for x in also)])
    found += _shifted(job, found)
    raised = job.run([(s.x, FINISH, s.root) for s in _basins(job, found, BASINS, RIVAL_BASIN)])
    for _ in range(MAX_DETOURS):
        best = min(raised, key=job.cost)
        other = min(job.detours(best), key=job.cost)
        gain = 1 - job.cost(other) / job.cost(best)
        if not gain > SAME_BASIN:
            break
        raised += job.run([(other.x, FINISH, other.root)])
        if not gain > WORTH_MORE:
            break
    chosen = _finish(job, raised + _cheaper(job, known, raised), rng)
    return OptimalGait(
        chosen.x, chosen.total_costs, job.decrement(chosen), job.starts, job.iterations
    )


def _shifted(job: _Search, found: Sequence[Solution]) -> list[Solution]:
    """Solutions from the best gaits, shifted; on in the same direction where one is better."""
    ways = [(s, d) for s in _basins(job, found, SHIFTED) for d in (-SHIFT, SHIFT)]
    out: list[Solution] = []
    for _ in range(MAX_SHIFTS):
        hops = job.run([(job.shifted(s, d), RETURN, None) for s, d in ways])
        out += hops
        ways = [
            (hop, d)
            for hop, (s, d) in zip(hops, ways, strict=True)
            if job.search_cost(hop) < job.search_cost(s) * (1 - SAME_BASIN)
        ]
        if not ways:
            break
    return out


def _cheaper(job: _Search, known: Sequence[Start], found: Sequence[Solution]) -> list[Solution]:
    """Solutions in the basins of known gaits that are cheaper than all that was found."""
    least = min(job.cost(s) for s in found)
    missed = [s.x for s in known if float(s.total_costs @ job.w) < least]
    return job.run([(x, FINISH, job.solver.dual(x)) for x in missed])


def _detour(spec: WalkerSpec, w: Array, other: Array, x: Array, root: Array | None) -> Solution:
    """Best gait for ``w`` from that for other weights, as a function for a process pool."""
    there = polish(spec, other, x, THERE, root)
    back = polish(spec, w, there.x, BACK, there.root)
    back.iterations += there.iterations
    return back


def _finish(job: _Search, found: list[Solution], rng: np.random.Generator) -> Solution:
    """Perturb and solve again, ever farther away, until the best gait is a smooth minimum.

    A smooth gait is preferred to a cheaper one on a contact jump if it costs the same otherwise.
    """
    for amplitudes in (*FINISH_HOPS, ()):
        best = min(found, key=job.cost)
        near = [s for s in found if job.cost(s) < job.cost(best) * (1 + SAME_BASIN)]
        smooth = [s for s in near if job.decrement(s) < SMOOTH]
        if smooth:
            return min(smooth, key=job.cost)
        rngs = rng.spawn(len(amplitudes))
        hops = [job.hop(best, a, r) for a, r in zip(amplitudes, rngs, strict=True)]
        found = found + job.run([(x, (*APPROACH, *FINISH), None) for x in hops])
    return best


def _basins(
    job: _Search, found: Sequence[Solution], most: int, rival: float = np.inf
) -> list[Solution]:
    """The best solutions of different basins, none dearer than the best by more than ``rival``."""
    cost = job.search_cost
    ordered = sorted(found, key=cost)
    basins = ordered[:1]
    for s in ordered[1:]:
        is_other = cost(s) > cost(basins[-1]) * (1 + SAME_BASIN)
        if is_other and cost(s) < cost(basins[0]) * (1 + rival):
            basins.append(s)
    return basins[:most]
