"""Where the time of a whole recovery of the humanoid's weights goes.

The functions are wrapped with timers from outside: MuJoCo's inverse dynamics and their
derivatives, the linear algebra of the gait solver, and the queries (centres, linear programs,
intervals). Everything runs in one process and one thread, so that the parts add up.
"""

from __future__ import annotations

import argparse
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from unittest import mock

import numpy as np
from bench import table, verdict

from walking_irl.cpirl.loop import cpirl
from walking_irl.cpirl.probes import Probing
from walking_irl.domains.contract import Request
from walking_irl.domains.humanoid import domain as domain_module
from walking_irl.domains.humanoid.closed_loop.trials import measure
from walking_irl.domains.humanoid.domain import Humanoid, exact_expert
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.optimiser import newton
from walking_irl.domains.humanoid.optimiser.linearisation import Linearisation, Weighted
from walking_irl.domains.humanoid.optimiser.ring import BorderedMatrix, Factor
from walking_irl.domains.humanoid.optimiser.transcription import Transcription
from walking_irl.types import Expert, Iteration

EVALUATIONS = "MuJoCo's inverse dynamics"
DERIVATIVES = "first derivatives of inverse dynamics"
HESSIANS = "Hessians"
ALGEBRA = "linear algebra of the gait solver"
REST = "rest of the gait solver"
MEASURE = "closed-loop walks and their policies"
QUERIES = "queries: centres, linear programs, intervals"


class Clock:
    """Own time of nested parts: a part's time does not count for the one around it."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = defaultdict(float)
        self.calls: dict[str, int] = defaultdict(int)
        self._open: list[str] = []
        self._since = 0.0

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Add the time of a block, less that of the parts inside it."""
        self._switch()
        self._open.append(name)
        self.calls[name] += 1
        try:
            yield
        finally:
            self._switch()
            self._open.pop()

    def wrap(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, timed."""

        def timed(*args: Any, **kwargs: Any) -> Any:
            with self.part(name):
                return function(*args, **kwargs)

        return timed

    def _switch(self) -> None:
        now = time.process_time()
        if self._open:
            self.seconds[self._open[-1]] += now - self._since
        self._since = now


@contextmanager
def timers(clock: Clock) -> Iterator[None]:
    """Wrap the parts of the gait solver."""
    wrapped: list[tuple[Any, str, str]] = [
        (Transcription, "_over_knots", EVALUATIONS),
        (Transcription, "differentiate", DERIVATIVES),
        (newton, "half_hessian", HESSIANS),
        (BorderedMatrix, "factor", ALGEBRA),
        (Factor, "solve", ALGEBRA),
        (Linearisation, "__init__", ALGEBRA),
        (Weighted, "times", ALGEBRA),
        (Weighted, "transpose_times", ALGEBRA),
    ]
    patches = [mock.patch.object(o, n, clock.wrap(p, getattr(o, n))) for o, n, p in wrapped]
    for patch in patches:
        patch.start()
    try:
        yield
    finally:
        for patch in patches:
            patch.stop()


def make_expert(clock: Clock, domain: Humanoid, rollouts: int, seed: int) -> Expert:
    """The expert of drawn weights, timed."""
    rng = np.random.default_rng(seed)
    with timers(clock), mock.patch.object(domain_module, "measure", clock.wrap(MEASURE, measure)):
        with clock.part(REST):
            request = Request(options={"rollouts": rollouts})
            return domain.demonstrate(request, rng=rng).expert


def shipped_expert(domain: Humanoid) -> Expert:
    """An exact expert that walks the shipped reference gait."""
    shipped = load_library(domain.spec.body)["reference"]
    return exact_expert(shipped.gait, shipped.total_costs)


def recover(
    clock: Clock, domain: Humanoid, expert: Expert, rollouts: int, seed: int, max_solves: int
) -> list[Iteration]:
    """One recovery, timed."""
    rng = np.random.default_rng([seed, 1])
    learner = domain.learner(expert, {"rollouts": rollouts}, rng=rng)
    measured = learner.measure
    steps = cpirl(
        clock.wrap(REST, learner.forward),
        expert,
        max_solves=max_solves,
        min_weight=domain.defaults.min_weight,
        rng=np.random.default_rng(seed),
        measure=None if measured is None else clock.wrap(MEASURE, measured),
        probe=Probing(),
    )
    with timers(clock), clock.part(QUERIES):
        return list(steps)


def report(expert: Clock, learner: Clock, steps: list[Iteration]) -> str:
    totals = [sum(clock.seconds.values()) for clock in (expert, learner)]
    rows = []
    for part in (EVALUATIONS, DERIVATIVES, HESSIANS, ALGEBRA, REST, MEASURE, QUERIES):
        own = [clock.seconds[part] for clock in (expert, learner)]
        rows.append([part, *(f"{t:.2f}" for t in own), f"{sum(own) / sum(totals):.1%}"])
    rows.append(["all", *(f"{t:.2f}" for t in totals), "100.0%"])
    iterations = sum(s.response.info["iterations"] for s in steps)
    share = learner.seconds[QUERIES] / totals[1]
    lines = [
        table(["part", "expert [s]", "learner [s]", "share"], rows),
        "",
        f"learner: {len(steps)} forward solves with {iterations} iterations of the gait solver, "
        f"status {steps[-1].status.name.lower()}",
        verdict(f"queries take {share:.1%} of the learner's time (target <= 5 %)", share <= 0.05),
    ]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=100, help="draws the ground-truth weights")
    parser.add_argument("--rollouts", type=int, default=20, help="of the expert; 0: exact features")
    parser.add_argument("--planar", action="store_true")
    parser.add_argument(
        "--quick", action="store_true", help="planar, the shipped gait as expert, two solves"
    )
    args = parser.parse_args()
    domain = Humanoid("humanoid-planar" if args.planar or args.quick else "humanoid")
    rollouts = 0 if args.quick else args.rollouts
    expert_clock, clock = Clock(), Clock()
    if args.quick:
        expert = shipped_expert(domain)
    else:
        expert = make_expert(expert_clock, domain, rollouts, args.seed)
    max_solves = 2 if args.quick else domain.defaults.max_solves
    steps = recover(clock, domain, expert, rollouts, args.seed, max_solves)
    print(f"{domain.name}, seed {args.seed}, one process, one thread\n")
    print(report(expert_clock, clock, steps))


if __name__ == "__main__":
    main()
