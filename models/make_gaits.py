"""Makes ``gaits.npz`` from nothing: run ``python models/make_gaits.py`` (minutes, two cores).

A first guess is drawn from the mean joint angles of healthy adults (``models/norms``), which on
this body neither stand on the ground nor obey physics. It is tied to these angles at hip, knee and
ankle while a homotopy in the root penalty makes it walk under the reference weights, and then
released: many basins of this problem are worse than the one that people walk in, and this is how
to get there. Every gait then hops between basins: it is perturbed, solved again, and the cheapest
gait is kept; at last the gaits exchange basins. The norms decide where the search begins and
nothing else; what is shipped is optimal for its weights alone.
"""

from __future__ import annotations

import argparse
from collections.abc import Collection, Iterable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker, lowest_points
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.gait.library import PREFIX, load_gaits, own_gaits
from walking_irl.domains.humanoid.gait.norm_curves import norm_set
from walking_irl.domains.humanoid.learner import polish, solver_for
from walking_irl.domains.humanoid.optimiser.perturbation import shifted
from walking_irl.domains.humanoid.optimiser.solver import Solution
from walking_irl.domains.humanoid.optimiser.stages import Stage, stage
from walking_irl.domains.humanoid.population import typical_weights
from walking_irl.domains.humanoid.spec import HUMANOID, PLANAR, WalkerSpec
from walking_irl.errors import SolverError

N_KNOTS = 40
STEP_LENGTH, HALF_PERIOD = 0.68, 0.54  # of the guess [m], [s]
SINK = 0.007  # of the soles into the ground, at first [m]
HARMONICS = 13  # of a cycle's curves that the guess keeps
ANGLES = {  # joint, curve of the norm, sign
    "hip_flexion": ("hip_flexion", 1),
    "knee": ("knee_flexion", 1),
    "ankle": ("ankle_dorsiflexion", 1),
    "root_yaw": ("pelvis_rotation", 1),
    "root_roll": ("pelvis_obliquity", -1),
}
ARM_SWING, ELBOW = 15, 20  # [deg]
TIES = {"hip_flexion": 1.0, "knee": 1.0, "ankle": 1.0, "other": 0.01, "step": 0.3}
"""How tightly joints are tied to the guess, and step length and period."""
HELD = ((1e1, 30), (1e2, 30), (1e3, 10), (1e4, 10), (1e4, 3), (1e4, 1), (1e4, 0.3))
"""Root penalties, and how tightly the joints are tied."""
RELEASED = (stage(1e4, 60, 1e-5),)
SEARCH = (stage(1e4, 60, 1e-6),)
FINISH = (stage(1e5, 60, 1e-6), stage(1e6, 100, 1e-11))
HOPS = {"reference": 16, "other": 4}
SHIFTS = (-1.0, -0.5, 0.5, 1.0)
"""Shifts of a gait's knots: which instants are knots decides how a foot's contact is sampled."""
AMPLITUDES = np.deg2rad([1.0, 3.0])
GAIN = 1e-7
"""By which share a gait must be cheaper to count as another one."""
SMOOTH = 1e-8
"""Decrement of a smooth minimum: a gait on a contact jump is shaken off it."""
HAIRS = np.deg2rad([0.005, 0.02, 0.1, 0.3])


def guess(walker: Walker) -> Array:
    """Joint angles of healthy adults, with the soles on the ground: a gait vector."""
    phase = np.arange(N_KNOTS) / (2 * N_KNOTS)
    norm = {
        name: c.mean for name, c in norm_set("adults", STEP_LENGTH / HALF_PERIOD, 1).curves.items()
    }
    norm["hip_flexion"] = norm["hip_flexion"] - norm["pelvis_tilt"].mean()
    turn = 2 * np.pi * np.arange(101) / 100
    curves = {joint: sign * norm[name] for joint, (name, sign) in ANGLES.items()}
    curves["shoulder"] = -ARM_SWING * np.cos(turn)
    curves["elbow"] = np.full(101, ELBOW)
    q = np.zeros((N_KNOTS, len(walker.joints)))
    for column, joint in enumerate(walker.joints):
        curve = curves.get(joint.removesuffix("_r").removesuffix("_l"))
        if curve is not None:
            q[:, column] = np.deg2rad(_cycle(curve, phase + 0.5 * joint.endswith("_l")))
    q[:, 0] = np.arange(N_KNOTS) / N_KNOTS * STEP_LENGTH
    z = walker.joints.index("root_z")
    q[:, z] = _smooth(-lowest_points(walker, q), 3) - SINK
    return Gait(q, STEP_LENGTH, HALF_PERIOD).to_vector()


def _smooth(curve: Array, harmonics: int) -> Array:
    """The first harmonics of a closed curve, the mean counted."""
    amplitudes = np.fft.rfft(curve)
    amplitudes[harmonics:] = 0
    return np.asarray(np.fft.irfft(amplitudes, len(curve)))


def _cycle(curve: Array, phase: Array) -> Array:
    """A curve over 0 ... 100 % of the cycle, closed, at phases in cycles."""
    closed = curve - (curve[-1] - curve[0]) * np.linspace(-0.5, 0.5, 101)
    smooth = _smooth(closed[:-1], HARMONICS)
    return np.asarray(np.interp(phase % 1 * 100, np.arange(101), np.r_[smooth, smooth[0]]))


def ties(walker: Walker) -> Array:
    """How tightly each unknown is tied to the guess, shape (N nv + 2,)."""
    stems = (j.removesuffix("_r").removesuffix("_l") for j in walker.joints)
    joints = [TIES.get(stem, TIES["other"]) for stem in stems]
    return np.concatenate([np.tile(joints, N_KNOTS), [TIES["step"]] * 2])


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
        shares = ties(self.spec.walker)
        tied = self.solver.solve(w, x, [stage(p, 60, 1e-5, t * shares) for p, t in HELD])
        return self.solver.solve(w, tied.x, RELEASED).x

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
        """The best gait for ``w`` near the four known ones that are cheapest under it.

        Then near the best one with its knots shifted, for as long as that helps.
        """
        penalty = FINISH[-1].penalty
        near = sorted(gaits, key=lambda y: self.cost(w, y, penalty))[:4]
        found = self.run(w, near, SEARCH + FINISH) + self.run(w, near[:2], FINISH)
        best = min([near[0], *found], key=lambda y: self.cost(w, y, penalty))
        while True:
            moved = [shifted(self.spec.walker, best, knots) for knots in SHIFTS]
            found = self.run(w, moved, SEARCH + FINISH)
            other = min(found, key=lambda y: self.cost(w, y, penalty), default=best)
            if self.cost(w, other, penalty) > self.cost(w, best, penalty) * (1 - GAIN):
                return best
            best = other

    def make(self, start: Array) -> dict[str, Array]:
        """Gaits of the body by name, from a walk."""
        weights = weights_to_ship(self.spec)
        found = {"reference": self.hop(weights["reference"], start, HOPS["reference"], seed=0)}
        for k, (name, w) in enumerate(weights.items()):
            if name not in found:
                x = self.exchange(w, found.values())
                found[name] = self.hop(w, x, HOPS["other"], seed=k)
        return found

    def settle(self, gaits: Collection[Array]) -> dict[str, Array]:
        """Arrays ready to be saved: each gait in the best basin that any of the others is in."""
        weights, found = weights_to_ship(self.spec), {}
        for k, (name, w) in enumerate(weights.items()):
            best = self.exchange(w, [*gaits, *found.values()])
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


def saved(path: Path, body: str) -> list[Array]:
    """Gait vectors of a body in a file of gaits."""
    with np.load(path) as data:
        return list(data[f"{PREFIX[body]}x"])


def main() -> None:
    """Make all gaits and save them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("gaits.npz"))
    parser.add_argument(
        "--body", type=Path, help="an MJCF file: make its gaits, from the shipped ones, beside it"
    )
    parser.add_argument(
        "--start", type=Path, nargs="*", help="files of gaits, of a like body: settle these instead"
    )
    parser.add_argument("--workers", type=int, default=2, help="processes [%(default)s]")
    args = parser.parse_args()
    with ProcessPoolExecutor(args.workers, mp_context=get_context("spawn")) as pool:
        if args.body is None:
            found: dict[str, Array] = {}
            for spec in (HUMANOID, PLANAR):
                maker = Maker(spec, pool)
                gaits = [x for path in args.start or () for x in saved(path, spec.body)]
                gaits = gaits or list(maker.make(maker.walk(guess(spec.walker))).values())
                found |= maker.settle(gaits)
            np.savez_compressed(args.out, **found)
        else:
            spec = WalkerSpec(str(args.body))
            start = next(iter(load_gaits(spec.body).values())).to_vector()
            maker = Maker(spec, pool)
            gaits = list(maker.make(maker.walk(start)).values())
            np.savez_compressed(own_gaits(args.body), **maker.settle(gaits))


if __name__ == "__main__":
    main()
