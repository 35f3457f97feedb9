"""A walker that walks badly: is there a gait that beats it in every objective at once?

    python demos/suboptimal_expert.py [--seed 100] [--record better.rrd] [--planar]

The best gait for drawn weights is perturbed and only made physical again, so that no weights make
it optimal. CPIRL lowers its level to the least regret of any weights: it ends with one gait that is
at least as good in every objective, or says how far it got and how sub-optimal the walker is.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from walking_irl.run.report import Report, progress_line
from walking_irl.run.session import run
from walking_irl.run.setup import Setup
from walking_irl.types import Status
from walking_irl.workers import workers


def main() -> int:
    """Perturb a gait, look for a better one, compare the two."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--seed", type=int, default=100, help="draws the walker and its perturbation"
    )
    parser.add_argument("--record", type=Path, default=Path("better.rrd"), metavar="FILE.rrd")
    parser.add_argument("--planar", action="store_true", help="a smaller body, in a plane")
    args = parser.parse_args()
    setup = Setup(
        domain="humanoid-planar" if args.planar else "humanoid",
        expert="suboptimal",
        mode="minimise",
        seed=args.seed,
        record=args.record,
    )
    with workers() as executor:
        report = run(
            setup,
            executor=executor,
            on_iteration=lambda it, report: print(progress_line(it, report)),
        )
    return compare(report)


def compare(report: Report) -> int:
    """Print the walker's costs beside the costs of the gait found; returns the exit code."""
    costs, best = -report.expert.mu, report.last
    print(f"\n{report.status}")
    if report.ending is Status.DOMINATED:
        print(f"{'cost':12s}{'walker':>9s}{'found':>9s}{'saved':>9s}")
        for objective, a, b in zip(report.objectives, costs, -best.response.mu, strict=True):
            print(f"{objective.name:12s}{a:9.4f}{b:9.4f}{100 * (a - b) / a:8.1f} %")
    low, high = report.summary.bracket
    print(f"the best mixture of gaits beats the walker by {low:.4f} to {high:.4f} in every cost")
    print(f"recording: {report.recording}")
    return 0 if report.is_success else 1


if __name__ == "__main__":  # worker processes import this file
    sys.exit(main())
