"""Four centres of one polyhedron: where each would ask next, while one of them cuts.

    python demos/four_centres.py [--seed 6] [--objectives 3] [--cuts ac] [--record centres.rrd]

The expert is an LQR with weights that the learner does not know. One centre (--cuts) chooses the
queries, the others watch: all four are drawn in the same shrinking polyhedron, beside them how far
each is from the true weights, and which share of the volume its query would leave. Needs no
screen; look at the recording with ``walking-irl view centres.rrd``.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.loop import cpirl
from walking_irl.domains.contract import Truth
from walking_irl.domains.lqr import LQR
from walking_irl.errors import EmptyPolyhedronError
from walking_irl.geometry.centres import CENTRES
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.recording import Experiment, Other, Recorder
from walking_irl.types import Response

NAMES = {
    "ac": "analytic centre",
    "cg": "centre of gravity",
    "mvie": "centre of the inscribed ellipsoid",
    "cc": "Chebyshev centre",
}
MAX_SOLVES = 16


def main() -> None:
    """Recover the LQR's weights by cuts alone, and watch four centres."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=6, help="draws the ground-truth weights")
    parser.add_argument("--objectives", type=int, default=3, choices=(3, 4), help="weights, K")
    parser.add_argument("--cuts", default="ac", choices=list(CENTRES), help="whose queries cut")
    parser.add_argument("--record", type=Path, default=Path("centres.rrd"), metavar="FILE.rrd")
    args = parser.parse_args()

    rng = np.random.default_rng(args.seed)
    domain = LQR(args.objectives)
    w_E = rng.dirichlet(np.ones(args.objectives))
    expert = domain.expert(w_E, rng)

    def forward(w: Array) -> Response:
        return replace(domain.forward(w), sensitivity=None)  # cuts alone, no Newton steps

    def seen(key: str, P: WeightPolyhedron) -> Other:
        """A centre, and which share of the volume its query would leave."""
        w = CENTRES[key](P, rng=rng).w
        return Other(w, P.cut(domain.forward(w).mu - expert.mu).volume() / P.volume())

    experiment = Experiment(
        domain="lqr",
        objectives=domain.objectives,
        expert=expert,
        centre=args.cuts,
        seed=args.seed,
        truth=Truth(w_E, expert.mu),
        others=tuple(NAMES.values()),
    )
    run = cpirl(forward, expert, centre=args.cuts, max_solves=MAX_SOLVES, rng=rng)
    print("sum of absolute errors of the weights\nsolve" + "".join(f"{c:>9s}" for c in NAMES))
    recorder: Recorder[None] = Recorder(args.record, experiment)
    shares = []
    with recorder:
        for it in run:
            try:
                points = [seen(key, it.polyhedron) for key in NAMES]
            except EmptyPolyhedronError:  # too thin by now: the weights are known
                break
            recorder.iteration(it, others=points)
            errors = [float(np.abs(point.w - w_E).sum()) for point in points]
            print(f"{it.k + 1:5d}" + "".join(f"{error:9.5f}" for error in errors))
            shares.append([point.share for point in points])
    means = np.exp(np.mean(np.log(shares), axis=0))
    print("volume that a query leaves, geometric mean\n     " + "".join(f"{v:9.5f}" for v in means))
    print(f"recording: {args.record}")


if __name__ == "__main__":
    main()
