"""How well weights come back from noisy joint angles: walkers of known weights, as recordings.

Weights are drawn, the best gait for them is disturbed by slow errors of every joint angle (each
cycle's own, both sides averaged, the mean of some cycles taken), and the nearest gait and the
weights are sought as for a person, from the reference weights alone. Told are the errors of the
weights (L1), of the start's, and whether the half widths hold them, without the parts that several
starts or trials add. Every walker's result is kept at once in ``--results``, from which a run goes
on; ``--markdown`` writes what recording quality buys, as docs/tables/known_walkers.md has it.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from bench import table, verdict

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.physics import inverse_dynamics
from walking_irl.domains.humanoid.body.variants import Surroundings, variant
from walking_irl.domains.humanoid.gait.gait import Gait, cycle_motion
from walking_irl.domains.humanoid.gait.realism import ON_GROUND
from walking_irl.domains.humanoid.learner import search
from walking_irl.domains.humanoid.population import POPULATIONS
from walking_irl.domains.humanoid.recorded.closeness import Walk
from walking_irl.domains.humanoid.spec import HUMANOID, PLANAR, WalkerSpec
from walking_irl.run.joint import joint_fit
from walking_irl.run.walk import NARROWEST, half_widths, nearest

HARMONICS = 6
COVERED = 0.95
"""Share of weights that half widths must hold."""
PLATE = 0.03
"""Standard deviation of a measured force [body weights]."""


class Recording(NamedTuple):
    """Who is recorded, and how."""

    population: str
    seed: int
    noise: float
    """Of each cycle's joint angles [deg]."""
    cycles: int = 1
    force: bool = False
    load: float = 0.0
    """On the back [kg]: of a body that the search does not know of."""

    @property
    def quality(self) -> str:
        """How well it is recorded, in words."""
        cycles = "1 cycle" if self.cycles == 1 else f"{self.cycles} cycles"
        load = f", {self.load:g} kg on the back that nobody told of" if self.load else ""
        return f"{self.noise:g} deg, {cycles}{', force' if self.force else ''}{load}"


@dataclass(frozen=True)
class Result:
    """What came back."""

    truth: list[float]
    start: list[float]
    w: list[float]
    half: list[float]
    gap: float

    @property
    def errors(self) -> Array:
        """Of each weight, in half widths, shape (K,)."""
        return np.asarray(np.abs(np.subtract(self.w, self.truth)) / self.half)

    @property
    def l1(self) -> tuple[float, float]:
        """Of the start and of the answer."""
        start, error = (
            float(np.abs(np.subtract(v, self.truth)).sum()) for v in (self.start, self.w)
        )
        return start, error


def main() -> None:
    """Recover walkers of known weights and say how far off they are."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--walkers", type=int, default=5, help="of each population and noise")
    parser.add_argument("--noise", type=float, nargs="+", default=[1.0, 2.0], help="[deg]")
    parser.add_argument("--cycles", type=int, nargs="+", default=[1], help="of each recording")
    parser.add_argument("--force", action="store_true", help="with the vertical force")
    parser.add_argument("--load", type=float, default=0.0, help="unknown to the search [kg]")
    parser.add_argument("--planar", action="store_true", help="a smaller body, in a plane")
    parser.add_argument("--quick", action="store_true", help="one walker in the plane")
    parser.add_argument("--results", type=Path, help="one line a walker; known ones are not redone")
    parser.add_argument("--markdown", type=Path, help="write all results as a table by quality")
    args = parser.parse_args()
    spec = PLANAR if args.planar or args.quick else HUMANOID
    asked = [
        Recording(population, seed, noise, cycles, args.force, args.load)
        for seed in range(args.walkers)
        for cycles in args.cycles
        for noise in args.noise
        for population in POPULATIONS
    ]
    if args.quick:
        asked = [Recording("typical", 0, 1.0)]
    known = read(args.results)
    for recording in asked:
        if recording not in known:
            known[recording] = recovered(spec, recording)
            if args.results is not None:
                with args.results.open("a") as file:
                    line = {**recording._asdict(), **asdict(known[recording])}
                    file.write(json.dumps(line) + "\n")
    tell({r: known[r] for r in asked})
    if args.markdown is not None:
        args.markdown.write_text(markdown(known))


def read(path: Path | None) -> dict[Recording, Result]:
    """Results of earlier runs."""
    if path is None or not path.exists():
        return {}
    out = {}
    for line in path.read_text().splitlines():
        row = json.loads(line)
        key = Recording(**{name: row.pop(name) for name in Recording._fields if name in row})
        out[key] = Result(**row)
    return out


def recovered(spec: WalkerSpec, recording: Recording) -> Result:
    """One walker, from drawn weights to recovered ones."""
    rng = np.random.default_rng(recording.seed)
    reference = spec.stack.reference_weights
    w = POPULATIONS[recording.population](rng, reference)
    there = replace(spec, body=variant(spec.body, Surroundings(load=recording.load)))
    walk = recorded(there, search(there, w).policy, recording, rng)
    near = nearest(spec, walk)
    fit = joint_fit(spec, walk, reference, near, near.total_costs)
    end = fit.last
    half = np.maximum(half_widths(fit), NARROWEST)
    return Result(w.tolist(), reference.tolist(), end.w.tolist(), half.tolist(), end.gap)


def recorded(spec: WalkerSpec, gait: Gait, recording: Recording, rng: np.random.Generator) -> Walk:
    """The mean of some cycles, each off by slow errors of its own, and how well it is known."""
    errors = np.array(
        [slow_errors(spec, gait, recording.noise, rng) for _ in range(recording.cycles)]
    )
    n = recording.cycles
    variance: Array | float = 0.0
    if n > 1:
        variance = np.r_[errors.var(axis=0, ddof=1).ravel() / n, 0.0, 0.0]
    shown = Gait(gait.q + errors.mean(axis=0), gait.step_length, gait.half_period)
    force = measured_force(spec, gait, rng) if recording.force else None
    return Walk(shown, variance=variance, force=force)


def measured_force(spec: WalkerSpec, gait: Gait, rng: np.random.Generator) -> Array:
    """Vertical force under the right foot from the gait's first knot, (2 N,) [body weights]."""
    _, sensors = inverse_dynamics(spec.walker, *cycle_motion(gait, spec.walker.mirror))
    touch = sensors[:, spec.walker.sensor["touch_r"]][:, 0] / spec.walker.weight
    return np.asarray(touch + (touch > ON_GROUND) * PLATE * rng.normal(size=len(touch)))


def slow_errors(spec: WalkerSpec, gait: Gait, noise: float, rng: np.random.Generator) -> Array:
    """Errors of joint angles of a standard deviation [deg], both sides averaged, shape (N, nv)."""
    n, mirror = gait.n_knots, spec.walker.mirror
    phase = np.pi * np.arange(2 * n) / n
    waves = [f(k * phase) for k in range(1, HARMONICS + 1) for f in (np.cos, np.sin)]
    error = np.column_stack(waves) @ rng.normal(size=(len(waves), gait.q.shape[1]))
    error *= np.deg2rad(noise) / error.std(axis=0)
    error[:, : spec.walker.n_root] = 0
    return np.asarray((error[:n] + error[n:] @ mirror.T) / 2)


def tell(results: dict[Recording, Result]) -> None:
    """A row a walker, and what the acceptance asks for."""
    rows = []
    for recording, found in results.items():
        start, error = found.l1
        name = f"{recording.population} {recording.seed}, {recording.quality}"
        worst = f"{found.errors.max():.2f}"
        widest = f"{max(found.half):.3f}"
        rows.append([name, f"{start:.3f}", f"{error:.3f}", f"{found.gap:.4f}", widest, worst])
    heads = ["walker", "L1 of start", "L1", "gap", "widest half width", "largest error in them"]
    print(table(heads, rows))
    better = sum(found.l1[1] < found.l1[0] for found in results.values())
    print(f"nearer than the start: {better} of {len(results)}")
    held = share_held(results.values())
    text = f"half widths hold {100 * held:.0f} % of the weights (target >= {100 * COVERED:.0f})"
    print(verdict(text, held >= COVERED))


def share_held(results: Iterable[Result]) -> float:
    """Share of weights that lie within their half widths."""
    return float(np.mean([found.errors <= 1 for found in results]))


def markdown(results: dict[Recording, Result]) -> str:
    """A row a quality, worst recordings last."""
    heads = (
        *("recording", "walkers", "L1 of the reference", "L1", "largest", "median half width"),
        "weights held",
    )
    lines = [f"| {' | '.join(heads)} |", "|" + " --- |" * len(heads)]
    by_quality: dict[tuple[float, bool, int, float], dict[Recording, Result]] = {}
    for r, found in results.items():
        by_quality.setdefault((r.load, r.force, r.cycles, r.noise), {})[r] = found
    lines += [f"| {' | '.join(_row(by_quality[key]))} |" for key in sorted(by_quality)]
    return "\n".join(lines) + "\n"


def _row(chosen: dict[Recording, Result]) -> Sequence[str]:
    found = list(chosen.values())
    start, error = np.array([f.l1 for f in found]).T
    half = np.median([f.half for f in found])
    return (
        next(iter(chosen)).quality,
        str(len(found)),
        f"{np.median(start):.2f}",
        f"{np.median(error):.3f}",
        f"{error.max():.2f}",
        f"{half:.3f}",
        f"{100 * share_held(found):.0f} %",
    )


if __name__ == "__main__":
    main()
