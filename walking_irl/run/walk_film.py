"""A recording of a person's walk: three walkers, their curves on norms, and the polyhedron."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from walking_irl.domains.humanoid.gait.curves import gait_curves
from walking_irl.domains.humanoid.gait.gait import Gait, cycle_motion
from walking_irl.domains.humanoid.gait.norm_curves import norm_set
from walking_irl.domains.humanoid.gait.realism import gait_cycle, leg_length
from walking_irl.domains.humanoid.recorded.person import Person
from walking_irl.domains.humanoid.recorded.person_curves import person_curves
from walking_irl.domains.humanoid.spec import WalkerSpec
from walking_irl.recording import Experiment, Recorder
from walking_irl.recording.views.motion import periodic_rollout
from walking_irl.recording.views.norm_panels import Curves, NormPanels
from walking_irl.recording.views.people import COLOURS, PersonView
from walking_irl.run.walk import Explanation
from walking_irl.types import Expert, Rollout


def record_explanation(
    path: Path, spec: WalkerSpec, person: Person, found: Explanation, answer: str
) -> None:
    """Record how the weights of least regret were closed in on, and the answer at its end.

    Every iteration plays the best gait for its query between the person and the nearest gait.

    Args:
        path: The ``.rrd`` file.
        spec: Which body, and its costs.
        person: Who was recorded.
        found: What was found.
        answer: The same in words, as Markdown.

    Raises:
        RecordingError: If the file cannot be written.
    """
    end, walker = found.end, spec.walker

    def motion(gait: Gait) -> Rollout:
        cycle = cycle_motion(gait, walker.mirror)
        return periodic_rollout(*cycle, gait.timestep, 2 * gait.step_length)

    shown = (
        person_curves(person, walker),
        *(gait_curves(gait_cycle(walker, g)) for g in (end.near.gait, end.gait)),
    )
    names = ("recorded", "nearest possible", "best for the weights")
    curves = [Curves(*parts) for parts in zip(names, COLOURS, shown, strict=True)]
    panels = NormPanels(curves, norm_set("adults", person.gait.speed, leg_length(walker)))
    view = PersonView(walker.model, motion(person.gait), motion(end.near.gait), panels)
    experiment = Experiment(
        domain=", ".join(p.name for p in person.sources),
        objectives=spec.stack.objectives,
        expert=Expert(-end.near.total_costs, 0 * end.near.total_costs),
        mode="minimise",
        question="What does this person walk for?",
        answer=answer,
    )
    with Recorder(path, experiment, view) as recorder:
        *first, last = found.history
        told = replace(last, estimate=found.w, intervals=found.intervals)
        for it in (*first, told):
            recorder.iteration(it, motion(it.response.policy))
        recorder.finale(motion(end.gait))
