"""How the time of one iteration of the gait solver grows: with knots, joints, objectives, threads.

The same query is answered with one thing changed at a time, for a fixed number of iterations from
the reference gait. A gait with other knots is the reference resampled; further objectives are the
deviations of single joints from the reference, fewer are the first of the six. Threads are those of
MuJoCo's inverse dynamics, and are compared by wall time.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from functools import cache

import numpy as np
from bench import medians, table, verdict
from scipy.interpolate import CubicSpline

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.costs.base import Cost, Term, read_joints
from walking_irl.domains.humanoid.costs.defaults import PER_METRE, SHARED
from walking_irl.domains.humanoid.gait.gait import Gait, cycle_motion
from walking_irl.domains.humanoid.gait.library import load_gaits
from walking_irl.domains.humanoid.optimiser.solver import GaitSolver
from walking_irl.domains.humanoid.optimiser.stages import stage
from walking_irl.domains.humanoid.optimiser.transcription import Transcription
from walking_irl.domains.humanoid.spec import HUMANOID, PLANAR, WalkerSpec

MOST_EXPONENT = 1.2
"""Time may grow with knots a little faster than linearly: the factor is banded."""


@dataclass(frozen=True)
class Bend(Cost):
    """Squared angle of one joint."""

    joint: str = "knee"
    name: str = "bend"
    unit: str = "rad^2"
    scale: float = 0.1
    meaning: str = "Squared angle of one joint."
    formula: str = "|q|^2"

    def terms(self, walker: Walker) -> list[Term]:
        """The angles of both sides."""
        sides = (f"{self.joint}_r", f"{self.joint}_l")
        return [Term((read_joints(walker, "q", sides),), lambda q: q, is_linear=True)]


FURTHER = tuple(Bend(joint, f"bend_{joint}") for joint in ("knee", "ankle", "elbow"))


def resampled(gait: Gait, n_knots: int, mirror: Array) -> Gait:
    """The gait with other knots: a periodic spline through those of its cycle."""
    q = cycle_motion(gait, mirror)[0]
    forward = np.zeros(q.shape[1])
    forward[0] = gait.step_length / gait.n_knots
    knots = np.arange(len(q) + 1.0)
    around = np.vstack([q - knots[:-1, None] * forward, q[:1]])
    new = np.arange(n_knots) * gait.n_knots / n_knots
    steady = CubicSpline(knots, around, bc_type="periodic")(new)
    return Gait(steady + new[:, None] * forward, gait.step_length, gait.half_period)


@cache
def _solver(spec: WalkerSpec, n_knots: int, threads: int) -> GaitSolver:
    return GaitSolver(Transcription(spec.walker, spec.costs, n_knots=n_knots, threads=threads))


def iterate(spec: WalkerSpec, n_knots: int, iterations: int, threads: int = 1) -> int:
    """Iterations that one query took, at most the given number."""
    reference = load_gaits(spec.body)["reference"]
    x = resampled(reference, n_knots, spec.walker.mirror).to_vector()
    solver = _solver(spec, n_knots, threads)
    w = np.full(len(spec.stack.objectives), 1 / len(spec.stack.objectives))
    return int(solver.solve(w, x, (stage(1e4, iterations, 1e-12),)).iterations)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--quick", action="store_true", help="two iterations, once")
    args = parser.parse_args()
    iterations, repeats = (2, 1) if args.quick else (12, args.repeats)
    three = WalkerSpec("humanoid", (*PER_METRE[:3], *SHARED))
    nine = WalkerSpec("humanoid", (*PER_METRE, *FURTHER, *SHARED))
    cases = {
        "3-D, 40 knots, 6 objectives": (HUMANOID, 40),
        "20 knots": (HUMANOID, 20),
        "80 knots": (HUMANOID, 80),
        "planar": (PLANAR, 40),
        "3 objectives": (three, 40),
        "9 objectives": (nine, 40),
    }
    counts = [iterate(*case, iterations) for case in cases.values()]
    calls = [lambda c=case: iterate(*c, iterations) for case in cases.values()]
    times = dict(zip(cases, np.divide(medians(calls, repeats), counts), strict=True))
    base = next(iter(times.values()))
    rows = [
        [
            name,
            f"{len(spec.walker.joints)}",
            f"{1e3 * times[name]:.1f}",
            f"{times[name] / base:.2f}",
        ]
        for name, (spec, _) in cases.items()
    ]
    print(table(["what differs", "unknowns a knot", "ms", "of the first"], rows) + "\n")
    for threads in (1, 2):
        start = time.perf_counter()
        for _ in range(repeats):
            iterate(HUMANOID, 40, iterations, threads)
        wall = (time.perf_counter() - start) / repeats / counts[0]
        print(f"{threads} thread{'s' * (threads > 1)}: {1e3 * wall:.1f} ms of wall time")
    exponent = float(np.log2(times["80 knots"] / times["20 knots"]) / 2)
    text = f"time grows with the power {exponent:.2f} of the knots (target <= {MOST_EXPONENT})"
    print(verdict(text, exponent <= MOST_EXPONENT))


if __name__ == "__main__":
    main()
