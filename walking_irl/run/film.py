"""A run's recording: its iterations and, where the domain has a view, their policies."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Any, Self

from walking_irl.recording import Experiment, Recorder
from walking_irl.recording.views.registry import world_of
from walking_irl.run.problem import Problem
from walking_irl.types import Iteration


class Film:
    """Context manager that records a run; a domain without a view is shown without a picture."""

    def __init__(self, problem: Problem, path: Path) -> None:
        setup, shown = problem.setup, problem.demonstration
        self.world = world_of(problem.domain, shown)
        experiment = Experiment(
            domain=setup.domain,
            objectives=problem.objectives,
            expert=shown.expert,
            centre=setup.centre,
            mode=setup.mode,
            seed=setup.drawn_from,
            truth=shown.truth,
            question=problem.domain.question,
        )
        view = None if self.world is None else self.world.view
        self.recorder: Recorder[Any] = Recorder(path, experiment, view)

    def __enter__(self) -> Self:
        self.recorder.__enter__()
        return self

    def show(self, it: Iteration) -> None:
        """Show an iteration and its policy."""
        self.recorder.iteration(it, self._motion(it))

    def finale(self, it: Iteration) -> None:
        """Show the policy of the recovered weights, for longer."""
        if self.world is not None:
            self.recorder.finale(self._motion(it))

    def _motion(self, it: Iteration) -> Any:
        return None if self.world is None else self.world.motion(it.response.policy, it.w)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.recorder.__exit__(kind, error, trace)
