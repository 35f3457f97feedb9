"""A run's recording: its iterations and, where the domain has a view, their policies."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from walking_irl.arrays import Array
from walking_irl.recording import Experiment, Recorder
from walking_irl.recording.views.registry import World, world_of
from walking_irl.run.problem import Problem
from walking_irl.types import Iteration


class Film(NamedTuple):
    """A recorder, and what it shows of policies; a domain without a view has no picture."""

    recorder: Recorder[Any]
    world: World | None

    def show(self, it: Iteration) -> None:
        """Show an iteration and its policy."""
        self.recorder.iteration(it, self._motion(it.response.policy, it.w))

    def finale(self, iterations: Sequence[Iteration], w: Array) -> None:
        """Show the answer for longer: of all policies found, the best for the recovered weights.

        The query nearest to them may have a policy far from theirs, where one of the weights is
        tiny or its solve ended in another minimum.
        """
        best = max(iterations, key=lambda it: float(w @ it.response.mu))
        self.recorder.finale(self._motion(best.response.policy, w))

    def _motion(self, policy: Any, w: Array) -> Any:
        return None if self.world is None else self.world.motion(policy, w)


def experiment_of(problem: Problem) -> Experiment:
    """What a recording knows of a problem, by whatever method it is solved."""
    setup, shown = problem.setup, problem.demonstration
    return Experiment(
        domain=setup.domain,
        objectives=problem.objectives,
        expert=shown.expert,
        seed=setup.drawn_from,
        truth=shown.truth,
        question=problem.domain.question,
    )


@contextmanager
def film(problem: Problem, path: Path) -> Iterator[Film]:
    """Record a run; the file appears when the block ends, also after an error."""
    world = world_of(problem.domain, problem.demonstration)
    experiment = replace(
        experiment_of(problem), centre=problem.setup.centre, mode=problem.setup.mode
    )
    with Recorder(path, experiment, None if world is None else world.view) as recorder:
        yield Film(recorder, world)
