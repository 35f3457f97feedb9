"""Makes ``gaits.npz`` from nothing: run ``python models/make_gaits.py`` (half an hour, two cores).

A first guess is drawn from textbook joint angles (D. A. Winter, Biomechanics and Motor Control of
Human Movement, 4th ed. 2009: key points of hip, knee and ankle at natural cadence), which neither
stands on the ground nor obeys physics. A homotopy in the root penalty makes it walk, first under
weights that keep it calm, then under the reference weights. Every gait then hops between
basins: it is perturbed, solved again, and the cheapest gait is kept. Nothing but this file decides
what is shipped.
"""

from __future__ import annotations

import argparse
from collections.abc import Collection
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker, lowest_points
from walking_irl.domains.humanoid.costs.defaults import OBJECTIVES, REFERENCE_WEIGHTS
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.gait.library import PREFIX, load_gaits, own_gaits
from walking_irl.domains.humanoid.learner import polish, solver_for
from walking_irl.domains.humanoid.optimiser.stages import stage
from walking_irl.domains.humanoid.population import typical_weights
from walking_irl.domains.humanoid.spec import HUMANOID, PLANAR, WalkerSpec

N_KNOTS = 40
SPEED, HALF_PERIOD = 1.25, 0.55  # of the guess [m/s], [s]
KEY_POINTS = {  # phase of the gait cycle from the right heel strike, angle [deg]
    "hip_flexion": ([0, 0.15, 0.3, 0.5, 0.65, 0.85], [28, 22, 5, -12, 8, 30]),
    "knee": ([0, 0.13, 0.4, 0.55, 0.72, 0.9], [6, 18, 6, 22, 60, 20]),
    "ankle": ([0, 0.07, 0.2, 0.45, 0.63, 0.8], [0, -5, 3, 10, -15, 0]),
    "shoulder": ([0, 0.25, 0.5, 0.75], [-18, 0, 18, 0]),
    "elbow": ([0, 0.5], [20, 20]),
}
CALM = np.array([0.1, 0.05, 0.1, 0.35, 0.2, 0.2])
"""Weights under which the guess settles: mostly stability and soft landings."""
TO_WALK = (
    stage(1e1, 60, 1e-4, tether=10),
    stage(1e2, 60, 1e-4, tether=3),
    stage(1e3, 60, 1e-4, tether=1),
    stage(1e3, 60, 1e-4, tether=0.1),
    stage(1e3, 60, 1e-4, tether=0.01),
)
SEARCH = (stage(1e3, 60, 1e-5), stage(1e4, 100, 1e-6))
FINISH = (stage(1e5, 60, 1e-6), stage(1e6, 150, 1e-8))
HOPS = {"reference": 24, "other": 8}
AMPLITUDES = np.deg2rad([1.0, 3.0])


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


def basin_hops(
    spec: WalkerSpec, w: Array, x: Array, hops: int, pool: ProcessPoolExecutor, seed: int
) -> Array:
    """Perturb, solve again, keep the cheapest; in rounds of two, then finish at full penalty."""
    solver, rng = solver_for(spec), np.random.default_rng(seed)
    pick = SEARCH[-1].penalty

    def cost(y: Array) -> float:
        return solver.problem.evaluate(y).total(w, pick)

    best = x
    for _ in range(hops // 2):
        starts = [solver.perturb(best, amplitude, rng) for amplitude in AMPLITUDES]
        jobs = [pool.submit(polish, spec, w, start, SEARCH) for start in starts]
        best = min([best, *(job.result().x for job in jobs)], key=cost)
    return polish(spec, w, best, FINISH).x


def reference(spec: WalkerSpec, x: Array, pool: ProcessPoolExecutor) -> Array:
    """The reference gait, from a guess ``x``."""
    for s in TO_WALK:
        x = polish(spec, CALM, x, (s,)).x
    x = polish(spec, REFERENCE_WEIGHTS, x, SEARCH).x
    return basin_hops(spec, REFERENCE_WEIGHTS, x, HOPS["reference"], pool, seed=0)


def in_the_plane(x: Array) -> Array:
    """The joints that the planar body has, of a gait of the spatial one."""
    spatial, planar = HUMANOID.walker.joints, PLANAR.walker.joints
    gait = Gait.from_vector(x, len(spatial))
    return Gait(gait.q[:, [spatial.index(j) for j in planar]], *x[-2:]).to_vector()


def weights_to_ship() -> dict[str, Array]:
    """Names and weights of all gaits but the reference."""
    out = {}
    for j, objective in enumerate(OBJECTIVES):
        w = REFERENCE_WEIGHTS * np.where(np.arange(len(OBJECTIVES)) == j, 3, 1)
        out[f"{objective.name} x3"] = w / w.sum()
    for seed in range(6):
        out[f"typical {seed}"] = typical_weights(np.random.default_rng([7, seed]))
    return out


def make(spec: WalkerSpec, start: Array, pool: ProcessPoolExecutor) -> dict[str, Array]:
    """Arrays of one body, ready to be saved."""
    weights = {"reference": REFERENCE_WEIGHTS, **weights_to_ship()}
    found = {"reference": reference(spec, start, pool)}
    for k, (name, w) in enumerate(weights.items()):
        if name not in found:
            x = exchange(spec, w, found.values(), pool)
            found[name] = basin_hops(spec, w, x, HOPS["other"], pool, seed=k)
    for name, w in weights.items():
        found[name] = exchange(spec, w, found.values(), pool)
        report(spec, name, w, found[name])
    prefix, problem = PREFIX.get(spec.body, ""), solver_for(spec).problem
    return {
        f"{prefix}name": np.array(list(weights)),
        f"{prefix}w": np.array(list(weights.values())),
        f"{prefix}x": np.array([found[name] for name in weights]),
        f"{prefix}folded": np.array(
            [problem.evaluate(found[name]).total_costs() for name in weights]
        ),
    }


def exchange(
    spec: WalkerSpec, w: Array, gaits: Collection[Array], pool: ProcessPoolExecutor
) -> Array:
    """The best gait for ``w`` near any of the four known ones that are cheapest under it."""
    problem = solver_for(spec).problem

    def cost(x: Array) -> float:
        return float(w @ problem.evaluate(x).total_costs())

    near = sorted(gaits, key=cost)[:4]
    jobs = [pool.submit(polish, spec, w, x, SEARCH + FINISH) for x in near]
    jobs += [pool.submit(polish, spec, w, x, FINISH) for x in near[:2]]
    return min([near[0], *(job.result().x for job in jobs)], key=cost)


def report(spec: WalkerSpec, name: str, w: Array, x: Array) -> None:
    """One line on a gait."""
    solver = solver_for(spec)
    lin = solver.linearise(x)
    print(
        f"{name:14s} J {w @ lin.evaluation.total_costs():.5f} "
        f"decrement {solver.decrement(w, lin):.0e} speed {x[-2] / x[-1]:.2f} m/s",
        flush=True,
    )


def main() -> None:
    """Make all gaits and save them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("gaits.npz"))
    parser.add_argument(
        "--body", type=Path, help="an MJCF file: make its gaits, from the shipped ones, beside it"
    )
    args = parser.parse_args()
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        if args.body is None:
            spatial = make(HUMANOID, guess(HUMANOID.walker), pool)
            planar = make(PLANAR, in_the_plane(spatial[PREFIX[HUMANOID.body] + "x"][0]), pool)
            np.savez_compressed(args.out, **spatial, **planar)
        else:
            spec = WalkerSpec(str(args.body))
            start = next(iter(load_gaits(spec.body).values())).to_vector()
            np.savez_compressed(own_gaits(args.body), **make(spec, start, pool))


if __name__ == "__main__":
    main()
