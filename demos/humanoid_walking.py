"""The main job as a library user writes it: a humanoid walks; what does it walk for?

    python demos/humanoid_walking.py [--seed 0] [--record walking.rrd] [--planar]

Needs no screen; look at the recording with ``walking-irl view walking.rrd``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from walking_irl.cpirl.loop import cpirl
from walking_irl.cpirl.summary import summarise
from walking_irl.domains.humanoid.closed_loop.trials import Trials
from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.domains.humanoid.population import typical_weights
from walking_irl.recording import Experiment, Recorder
from walking_irl.recording.views.gait import WalkerView
from walking_irl.run.humanoid_case import one_cycle
from walking_irl.run.session import workers

MIN_WEIGHT = 0.005
PROBE = 1e-4


def main() -> None:
    """Make an expert, recover its weights, record how."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0, help="draws the hidden weights")
    parser.add_argument("--record", type=Path, default=Path("walking.rrd"), metavar="FILE.rrd")
    parser.add_argument("--planar", action="store_true", help="a smaller body, in a plane")
    args = parser.parse_args()

    rng = np.random.default_rng(args.seed)
    domain = Humanoid("humanoid-planar" if args.planar else "humanoid")
    with workers() as executor:
        # Somebody walks for weights that only the last line of this file may look at.
        w_hidden = typical_weights(rng)
        protocol = Trials(rollouts=20, noise=0.02)
        shown = domain.demonstrate(w_hidden, rng, protocol, executor)
        expert = shown.expert

        # The learner gets what was recorded: mean features, their error, and the mean gait.
        iterations = cpirl(
            domain.learner(expert, threads=2),
            expert,
            centre="ac",
            max_solves=20,
            min_weight=MIN_WEIGHT,
            rng=np.random.default_rng(args.seed),
            measure=domain.remeasure(protocol, args.seed, executor),
            executor=executor,
            probe=PROBE,
        )
        experiment = Experiment(
            domain=domain.name,
            objectives=domain.objectives,
            expert=expert,
            seed=args.seed,
            w_expert=w_hidden,
        )
        world = WalkerView(domain.walker.model, one_cycle(domain, shown.gait))
        done = []
        with Recorder(args.record, experiment, world) as recorder:
            for it in iterations:
                print(f"{it.k + 1:3d}  {it.rule.value:35s} regret {it.regret:.2e}")
                recorder.iteration(it, one_cycle(domain, it.response.policy))
                done.append(it)

    found = summarise(done, expert, domain.objectives)
    print(f"\n{found.status.value}\n{'objective':12s}{'found':>8s}   interval")
    for objective, w, (low, high) in zip(domain.objectives, found.w, found.intervals, strict=True):
        print(f"{objective.name:12s}{w:8.4f}   {low:.4f} .. {high:.4f}")
    if found.weakest is not None:
        print(f"least revealed: {found.weakest}")
    print(f"recording: {args.record}")
    print(f"L1 distance to the hidden weights: {np.abs(found.w - w_hidden).sum():.5f}")


if __name__ == "__main__":  # worker processes import this file
    main()
