"""Makes ``gaits.npz`` from nothing: run ``python models/make_gaits.py`` (minutes, two cores).

A first guess is drawn from textbook joint angles (D. A. Winter, Biomechanics and Motor Control of
Human Movement, 4th ed. 2009: key points of hip, knee and ankle at natural cadence), which neither
stands on the ground nor obeys physics. It is tied to these angles while a homotopy in the root
penalty makes it walk under the reference weights, and then released: many basins of this problem
are worse than the one that people walk in, and this is how to get there. Every gait then hops
between basins: it is perturbed, solved again, and the cheapest gait is kept; at last the gaits
exchange basins. Nothing but this file decides what is shipped.
"""

from __future__ import annotations

import argparse
from collections.abc import Collection, Iterable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker, lowest_points
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.gait.library import PREFIX, load_gaits, own_gaits
from walking_irl.domains.humanoid.learner import polish, solver_for
from walking_irl.domains.humanoid.optimiser.solver import Solution
from walking_irl.domains.humanoid.optimiser.stages import Stage, stage
from walking_irl.domains.humanoid.population import typical_weights
from walking_irl.domains.humanoid.spec import HUMANOID, PLANAR, WalkerSpec
from walking_irl.errors import SolverError

N_KNOTS = 40
SPEED, HALF_PERIOD = 1.25, 0.55  # of the guess [m/s], [s]
KEY_POINTS = {  # phase of the gait cycle from the right heel strike, angle [deg]
    "hip_flexion": ([0, 0.15, 0.3, 0.5, 0.65, 0.85], [28, 22, 5, -12, 8, 30]),
    "knee": ([0, 0.13, 0.4, 0.55, 0.72, 0.9], [6, 18, 6, 22, 60, 20]),
    "ankle": ([0, 0.07, 0.2, 0.45, 0.63, 0.8], [0, -5, 3, 10, -15, 0]),
    "shoulder": ([0, 0.25, 0.5, 0.75], [-18, 0, 18, 0]),
    "elbow": ([0, 0.5], [20, 20]),
}
TIED = tuple(stage(p, 60, 1e-4, tether=t) for p, t in ((1e1, 10), (1e2, 3), (1e3, 1)))
RELEASED = tuple(stage(p, 60, 1e-4, tether=t) for p, t in ((1e3, 0.1), (1e3, 0.01), (1e3, 0.0)))
SOFTLY = (stage(1e3, 60, 1e-5), stage(1e4, 60, 1e-6))
SEARCH = (stage(1e4, 60, 1e-6),)
FINISH = (stage(1e5, 60, 1e-6), stage(1e6, 100, 1e-11))
HOPS = {"reference": 16, "other": 4}
AMPLITUDES = np.deg2rad([1.0, 3.0])
SMOOTH = 1e-8
"""Decrement of a smooth minimum: a gait on a contact jump is shaken off it."""
HAIRS = np.deg2rad([0.005, 0.02, 0.1, 0.3])


def guess(walker: Walker) -> Array:
    """Textbook joint angles on the ground: a gait vector."""
    phase = np.arange(N_KNOTS) / (2 * N_KNOTS)
    q = np.zeros((N_KNOTS, len(walker.joints)))
    for joint, (at, angle) in KEY_POINTS.items():
        closed = CubicSpline([*at, 1 + at[0]], [*angle, angle[0]], bc_type="periodic")
        for side, offset in (("r", 0.0), ("l", 0.5)):
            column = walker.joints.index(f"{joint}_{side}")
            q[:, column] = np.deg2rad(closed((phase + offset) % 1))
    q[:, 0] = np.arange(N_KNOTS) / N_KNOTS * SPEED * HALF_PERIOD
    z = walker.joints.index("root_z")
    q[:, z] = -lowest_points(walker, q)
    harmonics = np.fft.rfft(q[:, z])
    harmonics[3:] = 0
    q[:, z] = np.fft.irfft(harmonics, N_KNOTS)
    return Gait(q, SPEED * HALF_PERIOD, HALF_PERIOD).to_vector()


class Maker:
    """Searches the optimal gaits of one body.

    Args:
        spec: Which body, and its costs.
        pool: Where independent solves run.
    """

    def __init__(self, spec: WalkerSpec, pool: ProcessPoolExecutor) -> None:
        self.spec, self.pool, self.solver = spec, pool, solver_for(spec)

    def run(self, w: Array, starts: Iterable[Array], stages: tuple[Stage, ...]) -> list[Array]:
        """Gaits from several starts; a start that leads nowhere is left out."""
        jobs = [self.pool.submit(polish, self.spec, w, x, stages) for x in starts]
        found = []
        for job in jobs:
            try:
                solution: Solution = job.result()
            except SolverError:
                continue
            found.append(solution.x)
        return found

    def cost(self, w: Array, x: Array, penalty: float) -> float:
        """w.G of a gait at some root penalty."""
        return self.solver.problem.evaluate(x).total(w, penalty)

    def decrement(self, w: Array, x: Array) -> float:
        """Undamped Newton decrement of a gait."""
        return self.solver.decrement(w, self.solver.linearise(x), self.solver.dual(x))

    def walk(self, x: Array) -> Array:
        """A walk under the reference weights, from joint angles that are no walk."""
        w = self.spec.stack.reference_weights
        for s in (*TIED, *RELEASED, *SOFTLY):  # each tied to the result of the one before
            x = polish(self.spec, w, x, (s,)).x
        return x

    def hop(self, w: Array, x: Array, hops: int, seed: int) -> Array:
        """Perturb, solve again, keep the cheapest; in rounds of two, then finish."""
        rng = np.random.default_rng(seed)
        penalty = SEARCH[-1].penalty
        best = x
        for _ in range(hops // 2):
            starts = [self.solver.perturb(best, a, rng) for a in AMPLITUDES]
            found = self.run(w, starts, SEARCH)
            best = min([best, *found], key=lambda y: self.cost(w, y, penalty))
        return self.finish(w, best, rng)

    def finish(self, w: Array, x: Array, rng: np.random.Generator) -> Array:
        """The gait at full penalty, shaken until it is a smooth minimum."""
        penalty = FINISH[-1].penalty
        found = self.run(w, [x], FINISH) or [x]
        for hair in HAIRS:
            best = min(found, key=lambda y: self.cost(w, y, penalty))
            if self.decrement(w, best) < SMOOTH:
                return best
            found += self.run(w, [self.solver.perturb(best, hair, rng)], FINISH)
        return min(found, key=lambda y: self.cost(w, y, penalty))

    def exchange(self, w: Array, gaits: Collection[Array]) -> Array:
        """The best gait for ``w`` near any of the four known ones that are cheapest under it."""
        penalty = FINISH[-1].penalty
        near = sorted(gaits, key=lambda y: self.cost(w, y, penalty))[:4]
        found = self.run(w, near, (*SOFTLY, *FINISH)) + self.run(w, near[:2], FINISH)
        return min([near[0], *found], key=lambda y: self.cost(w, y, penalty))

    def make(self, start: Array) -> dict[str, Array]:
        """Arrays of the body's gaits, ready to be saved."""
        weights = weights_to_ship(self.spec)
        found = {"reference": self.hop(weights["reference"], start, HOPS["reference"], seed=0)}
        for k, (name, w) in enumerate(weights.items()):
            if name not in found:
                x = self.exchange(w, found.values())
                found[name] = self.hop(w, x, HOPS["other"], seed=k)
        for k, (name, w) in enumerate(weights.items()):
            best = self.exchange(w, found.values())
            found[name] = self.finish(w, best, np.random.default_rng([1, k]))
            self.report(name, w, found[name])
        prefix, problem = PREFIX.get(self.spec.body, ""), self.solver.problem
        costs = [problem.evaluate(found[name]).total_costs() for name in weights]
        return {
            f"{prefix}name": np.array(list(weights)),
            f"{prefix}w": np.array(list(weights.values())),
            f"{prefix}x": np.array([found[name] for name in weights]),
            f"{prefix}folded": np.array(costs),
        }

    def report(self, name: str, w: Array, x: Array) -> None:
        """One line on a gait."""
        print(
            f"{name:14s} J {self.cost(w, x, FINISH[-1].penalty):.5f} "
            f"decrement {self.decrement(w, x):.0e} speed {x[-2] / x[-1]:.2f} m/s",
            flush=True,
        )


def in_the_plane(x: Array) -> Array:
    """The joints that the planar body has, of a gait of the spatial one."""
    spatial, planar = HUMANOID.walker.joints, PLANAR.walker.joints
    gait = Gait.from_vector(x, len(spatial))
    return Gait(gait.q[:, [spatial.index(j) for j in planar]], *x[-2:]).to_vector()


def weights_to_ship(spec: WalkerSpec) -> dict[str, Array]:
    """Names and weights of all gaits, the reference first."""
    reference = spec.stack.reference_weights
    out = {"reference": reference}
    for j, objective in enumerate(spec.stack.objectives):
        w = reference * np.where(np.arange(len(reference)) == j, 3, 1)
        out[f"{objective.name} x3"] = w / w.sum()
    for seed in range(6):
        out[f"typical {seed}"] = typical_weights(np.random.default_rng([7, seed]), reference)
    return out


def main() -> None:
    """Make all gaits and save them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("gaits.npz"))
    parser.add_argument(
        "--body", type=Path, help="an MJCF file: make its gaits, from the shipped ones, beside it"
    )
    parser.add_argument("--workers", type=int, default=2, help="processes [%(default)s]")
    args = parser.parse_args()
    with ProcessPoolExecutor(args.workers, mp_context=get_context("spawn")) as pool:
        if args.body is None:
            maker = Maker(HUMANOID, pool)
            spatial = maker.make(maker.walk(guess(HUMANOID.walker)))
            flat = in_the_plane(spatial[PREFIX[HUMANOID.body] + "x"][0])
            maker = Maker(PLANAR, pool)
            planar = maker.make(maker.walk(flat))
            np.savez_compressed(args.out, **spatial, **planar)
        else:
            spec = WalkerSpec(str(args.body))
            start = next(iter(load_gaits(spec.body).values())).to_vector()
            maker = Maker(spec, pool)
            np.savez_compressed(own_gaits(args.body), **maker.make(maker.walk(start)))


if __name__ == "__main__":
    main()
