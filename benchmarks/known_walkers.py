"""How well weights come back from noisy joint angles: walkers of known weights, as recordings.

Weights are drawn, the best gait for them is disturbed by slow errors of every joint angle (both
sides averaged, one cycle), and the nearest gait and the weights are sought as for a person. Told
are the errors of the weights (L1), of the start's, and by how much the gap at the truth would have
to exceed the least one for half widths to hold it: the largest such need, relative to the gap, is
what ``run.walk.SLACK`` must grant.
"""

from __future__ import annotations

import argparse
from typing import NamedTuple

import numpy as np
from bench import table, verdict

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.learner import search
from walking_irl.domains.humanoid.population import POPULATIONS
from walking_irl.domains.humanoid.spec import HUMANOID, PLANAR, WalkerSpec
from walking_irl.run.joint import Walk, joint_fit
from walking_irl.run.walk import SLACK, nearest

HARMONICS = 6
COVERED = 0.95
"""Share of weights that half widths of SLACK must hold."""


class Case(NamedTuple):
    """One walker."""

    name: str
    start: float
    error: float
    gap: float
    need: Array


def main() -> None:
    """Recover walkers of known weights and say how far off they are."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--walkers", type=int, default=5, help="of each population and noise")
    parser.add_argument("--noise", type=float, nargs="+", default=[1.0, 2.0], help="[deg]")
    parser.add_argument("--planar", action="store_true", help="a smaller body, in a plane")
    parser.add_argument("--quick", action="store_true", help="one walker in the plane")
    args = parser.parse_args()
    spec = PLANAR if args.planar or args.quick else HUMANOID
    populations = ("typical",) if args.quick else tuple(POPULATIONS)
    noises, walkers = ([1.0], 1) if args.quick else (args.noise, args.walkers)
    cases = [
        recovered(spec, population, noise, seed)
        for population in populations
        for noise in noises
        for seed in range(walkers)
    ]
    rows = [
        [c.name, f"{c.start:.3f}", f"{c.error:.3f}", f"{c.gap:.4f}", f"{c.need.max():.2f}"]
        for c in cases
    ]
    print(table(["walker", "L1 of start", "L1", "gap", "largest need"], rows))
    held = float(np.mean([c.need <= SLACK for c in cases]))
    better = sum(c.error < c.start for c in cases)
    print(f"nearer than the start: {better} of {len(cases)}")
    text = f"half widths hold {100 * held:.0f} % of the weights (target >= {100 * COVERED:.0f})"
    print(verdict(text, held >= COVERED))


def recovered(spec: WalkerSpec, population: str, noise: float, seed: int) -> Case:
    """One walker, from drawn weights to recovered ones."""
    rng = np.random.default_rng(seed)
    reference = spec.stack.reference_weights
    w = POPULATIONS[population](rng, reference)
    walk = Walk(disturbed(spec, search(spec, w).policy, noise, rng))
    near = nearest(spec, walk)
    fit = joint_fit(spec, walk, reference, near, near.total_costs)
    end = fit.last
    need = (end.w - w) ** 2 / (2 * np.maximum(np.diag(fit.spread), 1e-12)) / end.gap
    start, error = (float(np.abs(v - w).sum()) for v in (reference, end.w))
    return Case(f"{population} {seed}, {noise:g} deg", start, error, end.gap, need)


def disturbed(spec: WalkerSpec, gait: Gait, noise: float, rng: np.random.Generator) -> Gait:
    """Joint angles off by slow errors of a standard deviation [deg], both sides averaged."""
    n, mirror = gait.n_knots, spec.walker.mirror
    phase = np.pi * np.arange(2 * n) / n
    waves = [f(k * phase) for k in range(1, HARMONICS + 1) for f in (np.cos, np.sin)]
    error = np.column_stack(waves) @ rng.normal(size=(len(waves), gait.q.shape[1]))
    error *= np.deg2rad(noise) / error.std(axis=0)
    error[:, : spec.walker.n_root] = 0
    both = (error[:n] + error[n:] @ mirror.T) / 2
    return Gait(gait.q + both, gait.step_length, gait.half_period)


if __name__ == "__main__":
    main()
