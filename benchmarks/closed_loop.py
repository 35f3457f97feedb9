"""How many walks and pushes the tracking policy survives in forward dynamics.

Nine gaits: the reference, the six whose weights have one objective threefold, and two for weights
drawn uniformly from the simplex. Each walks for a minute at the knot timestep and at half of it,
and is pushed at the pelvis at half of it: for 0.1 s, forwards, backwards, left and right, at four
phases of the gait cycle.
"""

from __future__ import annotations

import argparse
import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from bench import table, verdict

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.closed_loop.disturbance import Push
from walking_irl.domains.humanoid.closed_loop.policy import TrackingPolicy, tracking_policy
from walking_irl.domains.humanoid.closed_loop.rollout import rollout
from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.gait.library import load_gaits
from walking_irl.domains.humanoid.population import uniform_weights
from walking_irl.errors import FallError

UNIFORM_SEEDS = (100, 101)
DIRECTIONS = {"forwards": (1, 0), "backwards": (-1, 0), "left": (0, 1), "right": (0, -1)}
PHASES = 4
FORCES = (80.0, 150.0)  # [N]
REQUIRED = (1.0, 135 / 144)
"""Least share of the pushes survived, by force."""
SETTLE = 2  # whole cycles before the first push
RECOVER = 6.0  # time after a push in which a fall counts [s]


class Lost(NamedTuple):
    """A push after which the walker fell."""

    gait: str
    force: float
    direction: str
    phase: int


@dataclass(frozen=True)
class Outcome:
    """What one gait survived.

    Attributes:
        name: Of the gait.
        speed: Of the gait [m/s].
        walked: Time walked without a fall at the knot timestep and at half of it [s].
        survived: Pushes survived, by force.
        pushes: Pushes given at each force.
        lost: The others.
    """

    name: str
    speed: float
    walked: tuple[float, float]
    survived: tuple[int, ...]
    pushes: int
    lost: tuple[Lost, ...]


def gaits(path: Path | None, quick: bool) -> dict[str, Gait]:
    """The gaits to test; those of uniform weights are solved for, or read from ``path``."""
    shipped = load_gaits()
    named = {n: g for n, g in shipped.items() if n == "reference" or n.endswith(" x3")}
    if quick:
        return {"reference": named["reference"]}
    joints = shipped["reference"].q.shape[1]
    if path is not None and path.exists():
        with np.load(path) as kept:
            return named | {n: Gait.from_vector(kept[n], joints) for n in kept.files}
    solved: dict[str, Gait] = {}
    for seed in UNIFORM_SEEDS:
        w = uniform_weights(np.random.default_rng(seed))
        solved[f"uniform {seed}"] = Humanoid().forward(w).policy
    if path is not None:
        np.savez(path, **{n: g.to_vector() for n, g in solved.items()})
    return named | solved


def time_walked(walker: Walker, policy: TrackingPolicy, seconds: float) -> float:
    """Time until a fall, at most ``seconds``."""
    try:
        rollout(walker, policy, seconds=seconds)
    except FallError as fall:
        return fall.time
    return seconds


def pushes(
    walker: Walker, policy: TrackingPolicy, name: str, directions: Sequence[str], recover: float
) -> Iterator[tuple[Lost, bool]]:
    """Each push, and whether the walker stays up."""
    for force in FORCES:
        for direction in directions:
            for phase in range(PHASES):
                x, y = DIRECTIONS[direction]
                time = policy.period * (SETTLE + phase / PHASES)
                push = Push(time, (force * x, force * y, 0.0))
                walk = rollout(
                    walker, policy, seconds=time + recover, push=push, raise_on_fall=False
                )
                stays = walk.time[-1] >= time + recover - 1.5 * policy.timestep
                yield Lost(name, force, direction, phase), bool(stays)


def test_gait(name: str, gait: Gait, seconds: float, quick: bool) -> Outcome:
    walker = load_walker()
    coarse, fine = (tracking_policy(walker, gait, substeps=s) for s in (1, 2))
    directions = ["left"] if quick else list(DIRECTIONS)
    results = list(pushes(walker, fine, name, directions, 1.0 if quick else RECOVER))
    lost = tuple(push for push, stays in results if not stays)
    each = len(results) // len(FORCES)
    return Outcome(
        name=name,
        speed=gait.speed,
        walked=(time_walked(walker, coarse, seconds), time_walked(walker, fine, seconds)),
        survived=tuple(each - sum(x.force == force for x in lost) for force in FORCES),
        pushes=each,
        lost=lost,
    )


def report(outcomes: Sequence[Outcome], seconds: float) -> str:
    header = ["gait", "m/s", "walks [s], h", "h/2", *(f"{f:.0f} N, h/2" for f in FORCES)]
    rows = [
        [
            o.name,
            f"{o.speed:.2f}",
            *(f"{t:.1f}" for t in o.walked),
            *(f"{n} / {o.pushes}" for n in o.survived),
        ]
        for o in outcomes
    ]
    lines = [table(header, rows), ""]
    lines += [
        f"lost: {x.gait}, {x.force:.0f} N {x.direction} at phase {x.phase}/{PHASES}"
        for o in outcomes
        for x in o.lost
    ]
    falls = sum(t < seconds for o in outcomes for t in o.walked)
    lines.append(
        verdict(f"{2 * len(outcomes)} walks of {seconds:g} s: {falls} falls (target 0)", falls == 0)
    )
    total = sum(o.pushes for o in outcomes)
    for i, (force, share) in enumerate(zip(FORCES, REQUIRED, strict=True)):
        n = sum(o.survived[i] for o in outcomes)
        least = round(share * total)
        text = f"pushes of {force:.0f} N: {n} of {total} survived (target >= {least})"
        lines.append(verdict(text, n >= least))
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60.0, help="length of the long walks")
    parser.add_argument("--keep", type=Path, help=".npz that keeps the solved gaits for next time")
    parser.add_argument("--quick", action="store_true", help="one gait, pushed to one side")
    args = parser.parse_args()
    logging.getLogger("absl").setLevel(logging.ERROR)  # a fall may end in numbers too large
    seconds = min(args.seconds, 3.0) if args.quick else args.seconds
    found = gaits(args.keep, args.quick)
    print(report([test_gait(n, g, seconds, args.quick) for n, g in found.items()], seconds))


if __name__ == "__main__":
    main()
