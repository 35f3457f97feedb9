"""The main job as a library user writes it: a humanoid walks; what does it walk for?

    python demos/humanoid_walking.py [--seed 0] [--record walking.rrd] [--planar]

Needs no screen; look at the recording with ``walking-irl view walking.rrd``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from walking_irl.cpirl.loop import cpirl
from walking_irl.cpirl.probes import Probing
from walking_irl.cpirl.summary import summarise
from walking_irl.domains.contract import Request
from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.recording import Experiment, Recorder
from walking_irl.recording.views.registry import world_of
from walking_irl.workers import workers


def main() -> None:
    """Make an expert, recover its weights, record how."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0, help="draws the ground-truth weights")
    parser.add_argument("--record", type=Path, default=Path("walking.rrd"), metavar="FILE.rrd")
    parser.add_argument("--planar", action="store_true", help="a smaller body, in a plane")
    args = parser.parse_args()

    domain = Humanoid("humanoid-planar" if args.planar else "humanoid")
    options = {"rollouts": 20, "noise": 0.02}
    rng = np.random.default_rng(args.seed)
    with workers() as executor:
        # Somebody walks for weights that only scoring and pictures may look at.
        shown = domain.demonstrate(Request(options=options), rng=rng, executor=executor)
        expert, truth = shown.expert, shown.truth

        # The learner gets what was recorded: mean features, their error, and the mean gait.
        learner_rng = np.random.default_rng([args.seed, 1])
        learner = domain.learner(expert, options, rng=learner_rng, executor=executor)
        iterations = cpirl(
            learner.forward,
            expert,
            centre="ac",
            max_solves=domain.defaults.max_solves,
            min_weight=domain.defaults.min_weight,
            rng=np.random.default_rng(args.seed),
            measure=learner.measure,
            probe=Probing(executor=executor),
        )
        experiment = Experiment(
            domain=domain.name,
            objectives=domain.objectives,
            expert=expert,
            seed=args.seed,
            truth=truth,
            question=domain.question,
        )
        view, motion = world_of(domain, shown)
        done = []
        with Recorder(args.record, experiment, view) as recorder:
            for it in iterations:
                print(f"{it.k + 1:3d}  {it.rule.value:35s} regret {it.regret:.2e}")
                recorder.iteration(it, motion(it.response.policy, it.w))
                done.append(it)

    found = summarise(done, expert, domain.objectives)
    print(f"\n{found.status.value}\n{'objective':12s}{'found':>8s}   interval")
    for objective, w, (low, high) in zip(domain.objectives, found.w, found.intervals, strict=True):
        print(f"{objective.name:12s}{w:8.4f}   {low:.4f} .. {high:.4f}")
    if found.weakest is not None:
        print(f"least revealed: {found.weakest}")
    print(f"recording: {args.record}")
    print(f"L1 distance to the ground-truth weights: {np.abs(found.w - truth.w).sum():.5f}")


if __name__ == "__main__":  # worker processes import this file
    main()
