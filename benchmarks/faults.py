"""How often a run survives what the world does to it: kills, interrupts and full disks.

The faults of ``tests/faults`` at instants spread over a whole run. A run has survived where its
files can be read, no process and no unfinished file is left, there is no stack trace, and what a
killed run goes on to is, figure by figure, what the whole run found. Counts, and no times.
"""

from __future__ import annotations

import argparse
import signal
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from bench import table, verdict

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "faults"))
import injection  # what the tests do, done oftener

JOBS = {"gridworld": ("--domain", "gridworld", "--seed", "2"),
        "planar": ("--domain", "humanoid-planar", "--rollouts", "0")}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--job", choices=JOBS, default="gridworld")
    parser.add_argument(
        "--times", type=int, default=50, help="instants of each fault (%(default)s)"
    )
    parser.add_argument("--quick", action="store_true", help="two instants")
    args = parser.parse_args()
    n, job = 2 if args.quick else args.times, JOBS[args.job]
    with tempfile.TemporaryDirectory() as folder:
        whole, seconds = injection.whole_run(Path(folder), job)
    instants = np.linspace(0.05, 0.98, n) * seconds
    writes = range(1, n + 1)
    kinds: dict[str, tuple[Callable[..., Any], list[Any]]] = {
        "kill -9": (lambda f, t: injection.killed(f, job, whole, t), list(instants)),
        "kill -9 in mid write": (
            lambda f, k: injection.killed_in_write(f, job, whole, k), list(writes)
        ),
        "Ctrl-C": (lambda f, t: injection.stopped(f, job, signal.SIGINT, t), list(instants)),
        "SIGTERM": (lambda f, t: injection.stopped(f, job, signal.SIGTERM, t), list(instants)),
        "full disk": (lambda f, k: injection.full_disk(f, job, whole, k), list(writes)),
    }  # fmt: skip
    rows, lost, tried = [], [], 0
    for name, (fault, places) in kinds.items():
        found = []
        for place in places:
            with tempfile.TemporaryDirectory() as folder:
                outcome = fault(Path(folder), place)
            found += [] if outcome is None else [outcome]
        bad = [f"{name}, {where}: {'; '.join(wrong)}" for where, wrong in found if wrong]
        rows.append([name, f"{len(found)}", f"{len(found) - len(bad)}"])
        lost, tried = lost + bad, tried + len(found)
    print(f"{args.job}, a run of {seconds:.1f} s\n")
    print(table(["fault", "tried", "survived"], rows) + "\n")
    for text in lost:
        print(f"lost: {text}")
    print(verdict(f"{tried - len(lost)} of {tried} faults survived", not lost))


if __name__ == "__main__":
    main()
