"""Records a run as it goes; the file appears at the end, complete, or not at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, TypeVar

from walking_irl.cpirl.summary import summarise
from walking_irl.errors import RecordingError
from walking_irl.files import check_writable
from walking_irl.recording.blueprint import blueprint, motion_blueprint
from walking_irl.recording.experiment import Clock, Experiment, Other
from walking_irl.recording.polyhedron_view import PolyhedronView
from walking_irl.recording.progress_view import ProgressView
from walking_irl.recording.stream import RecordingFile, open_stream, save_stream
from walking_irl.recording.style import PLAYBACK_RATE
from walking_irl.recording.summary import motion_properties, properties, summary
from walking_irl.recording.views.view import WorldView
from walking_irl.types import Iteration

FRAMES_WITHOUT_WORLD = round(1.5 * PLAYBACK_RATE)

Motion = TypeVar("Motion")


class Recorder(RecordingFile, Generic[Motion]):
    """Context manager that records a run of CPIRL, iteration by iteration.

    Args:
        path: The ``.rrd`` file; whether it can be written is checked now.
        experiment: What is known before the run.
        world: What to show beside the polyhedron, or None.

    Raises:
        RecordingError: If ``path`` cannot be written, now or at the end, or Rerun is disabled.
    """

    def __init__(
        self,
        path: str | Path,
        experiment: Experiment,
        world: WorldView[Motion] | None = None,
    ) -> None:
        super().__init__(path)
        self.experiment = experiment
        self.world = world
        self._polyhedron = PolyhedronView(experiment, is_alone=world is None)
        self._progress = ProgressView(experiment)
        self._iterations: list[Iteration] = []
        self._n_frames = 0

    def _begin(self) -> None:
        self._stream.send_blueprint(blueprint(self.experiment, self.world))
        self._stream.send_recording_name(title_of(self.experiment))
        if self.world is not None:
            self.world.log_static(self._stream)
        self._polyhedron.log_static(self._stream)
        self._progress.log_static(self._stream)

    def iteration(
        self, it: Iteration, motion: Motion | None = None, others: Sequence[Other] = ()
    ) -> None:
        """Show one iteration, and the walk (or other motion) of its policy.

        Args:
            it: The iteration.
            motion: What the world shows of its policy.
            others: The experiment's ``others``, in their order.
        """
        clock = Clock(self._n_frames, it.k)
        self._progress.log_iteration(self._stream, clock, it, others)
        self._polyhedron.log_iteration(self._stream, clock, it, others)
        self._iterations.append(it)
        self._play(clock, motion, is_last=False)

    def finale(self, motion: Motion | None) -> None:
        """Show the answer, as part of the last iteration: the estimate alone, without a query.

        Args:
            motion: Of the recovered weights, played for longer; None where there is no world.
        """
        k = self._iterations[-1].k if self._iterations else 0
        clock = Clock(self._n_frames, k)
        self._progress.log_answer(self._stream, clock)
        self._polyhedron.log_answer(self._stream, clock)
        self._play(clock, motion, is_last=True)

    def _play(self, clock: Clock, motion: Motion | None, is_last: bool) -> None:
        n_frames = FRAMES_WITHOUT_WORLD
        if self.world is not None and motion is not None:
            n_frames = self.world.log_iteration(self._stream, clock, motion, is_last)
        self._n_frames = clock.first + n_frames

    def _end(self, ending: str | None) -> tuple[str, dict[str, Any]]:
        world = "" if self.world is None else self.world.describe()
        e, found = self.experiment, None
        if self._iterations:
            end = Clock(self._n_frames - 1, self._iterations[-1].k)
            self._progress.log_end(self._stream, end)
            found = summarise(self._iterations, e.expert, e.objectives)
        return summary(e, found, world, ending), properties(e, found, ending)


def record_motion(
    path: str | Path,
    world: WorldView[Motion],
    motion: Motion,
    *,
    title: str,
    text: str = "",
    weights: Mapping[str, float] | None = None,
    plots: Mapping[str, Sequence[str]] | None = None,
) -> Path:
    """Record one motion alone, without any inverse problem.

    Args:
        path: The ``.rrd`` file.
        world: Shows the motion.
        motion: What to show, for as long as the last motion of a run.
        title: Name of the recording.
        text: Markdown below the title.
        weights: What it is the best motion for, by objective; kept as properties of the file.
        plots: Further plots beside the world's own curves: entities by the plot's name.

    Raises:
        RecordingError: If ``path`` cannot be written, or Rerun is disabled.
    """
    target = check_writable(path, RecordingError)
    stream, memory = open_stream()
    stream.send_blueprint(motion_blueprint(world, plots or {}))
    stream.send_recording_name(title)
    world.log_static(stream)
    world.log_iteration(stream, Clock(0, 0), motion, True)
    known = motion_properties(title, weights or {})
    save_stream(stream, memory, target, f"# {title}\n\n{text}", known)
    return target


def title_of(experiment: Experiment) -> str:
    """Name of a recording."""
    seed = "" if experiment.seed is None else f", seed {experiment.seed}"
    return f"{experiment.domain}{seed}"
