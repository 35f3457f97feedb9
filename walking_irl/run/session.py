"""One recovery, from what was asked to a report: expert, learner, recording, scoring."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import ExitStack, suppress
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, cast

import numpy as np

from walking_irl.cpirl.loop import cpirl
from walking_irl.cpirl.probes import Probing
from walking_irl.domains.contract import OnStep
from walking_irl.errors import FallError, InvalidInputError, RecordingError, SolverError
from walking_irl.files import check_writable
from walking_irl.run.checkpoint import Checkpoint, CheckpointFile, Replay
from walking_irl.run.problem import Problem, pose, prepare
from walking_irl.run.report import Report
from walking_irl.run.setup import Setup
from walking_irl.run.stopwatch import Stopwatch, Timed
from walking_irl.types import Iteration, Mode, Rule
from walking_irl.workers import interrupts_answered, interrupts_held, interrupts_kept

if TYPE_CHECKING:
    from walking_irl.run.film import Film


def run(
    setup: Setup,
    *,
    resumed: Checkpoint | None = None,
    executor: Executor | None = None,
    on_expert: Callable[[Problem], None] = lambda problem: None,
    on_iteration: Callable[[Iteration, Report], None] = lambda it, report: None,
    on_step: OnStep | None = None,
) -> Report:
    """Recover the weights of one expert.

    Ctrl-C after the first iteration, or a solver that fails then, ends the run with a report of
    what is done, marked so; the recording is complete up to there. A recording that cannot be
    written at the end is told by the report, too, so that the result is not lost with it.

    Args:
        setup: What to do.
        resumed: A run of the same setup to go on with: its expert and its solver's answers are
            taken from there, and every figure is computed again.
        executor: Runs independent solves side by side.
        on_expert: Called when the expert is known.
        on_iteration: Called after every iteration.
        on_step: Called after every step of the learner's solver, with its number and cost.

    Raises:
        InvalidInputError: If the setup is wrong.
        RecordingError: If the recording cannot be written; before any iteration.
    """
    watch = Stopwatch()
    if setup.record is not None:
        check_writable(setup.record, RecordingError)
        if executor is not None:
            threading.Thread(target=_load_film).start()
    with watch.part("expert"):
        problem = _problem(setup, resumed, executor, on_step)
    on_expert(problem)
    report = Report(problem)
    known = Checkpoint(setup, problem.demonstration, []) if resumed is None else resumed
    if setup.checkpoint is not None:  # when resumed, it may be another file than that was read
        CheckpointFile(setup.checkpoint).save(replace(known, setup=setup))
        report.checkpoint = str(setup.checkpoint)
    try:
        with interrupts_kept():
            _learn(report, watch, len(known.answers), executor, on_iteration)
    except (KeyboardInterrupt, SolverError, FallError, RecordingError) as trouble:
        if not report.iterations:
            raise
        _tell(trouble, report)
        interrupts_answered()
    if problem.w_expert is not None and not report.was_interrupted:
        with suppress(KeyboardInterrupt, SolverError, FallError), interrupts_kept():
            # the result does not hang on it
            report.recovered_mu = problem.learner.forward(report.w).mu
    report.seconds = watch.finish()
    return report


def _load_film() -> None:
    """What recordings need takes half a second to load: meanwhile others look for the expert."""
    with suppress(Exception):  # whoever needs it says what is wrong
        import_module("walking_irl.run.film")


def _problem(
    setup: Setup, resumed: Checkpoint | None, executor: Executor | None, on_step: OnStep | None
) -> Problem:
    if resumed is None:
        return prepare(setup, executor, on_step)
    problem = pose(setup, resumed.demonstration, executor, on_step)
    forward = Replay(problem.learner.forward, resumed.answers)
    return replace(problem, learner=replace(problem.learner, forward=forward))


def _tell(trouble: BaseException, report: Report) -> None:
    """Let the report tell why the run was cut short, or its recording not written."""
    if isinstance(trouble, RecordingError):
        report.failed_write, report.recording = trouble, None
        return
    report.was_interrupted = isinstance(trouble, KeyboardInterrupt)
    report.failure = "" if report.was_interrupted else str(trouble)
    notes = getattr(trouble, "__notes__", [])  # of a recording that could not be written
    if notes:
        report.failed_write, report.recording = RecordingError(notes[0]), None


def _learn(
    report: Report,
    watch: Stopwatch,
    n_known: int,
    executor: Executor | None,
    on_iteration: Callable[[Iteration, Report], None],
) -> None:
    problem, path = report.problem, report.problem.setup.checkpoint
    file = None if path is None else CheckpointFile(path)
    with ExitStack() as stack:
        recorded: Film | None = None
        if problem.setup.record is not None:
            from walking_irl.run.film import film

            recorded = stack.enter_context(film(problem, problem.setup.record))
            report.recording = str(problem.setup.record)
        for it in _timed(problem, watch, executor):
            with interrupts_held(), watch.part("recording"):
                report.iterations.append(it)
                if file is not None:
                    _keep(report, file, n_known)
            on_iteration(it, report)
            if recorded is not None:
                with watch.part("recording"):
                    recorded.show(it)
        if recorded is not None:
            with watch.part("recording"):
                recorded.finale(report.iterations, report.w)


def _timed(problem: Problem, watch: Stopwatch, executor: Executor | None) -> Iterator[Iteration]:
    """CPIRL; what neither solves nor waits for the caller is the learner's own time ("centre")."""
    forward = Timed(problem.learner.forward)
    steps = cpirl(
        forward,
        problem.expert,
        centre=problem.setup.centre,
        mode=cast(Mode, problem.setup.mode),
        max_solves=problem.max_solves,
        min_weight=problem.min_weight,
        rng=np.random.default_rng(problem.setup.seed),
        measure=problem.learner.measure,
        probe=Probing(executor=executor),
    )
    start = time.perf_counter()
    for it in steps:
        spent = time.perf_counter() - start
        solving = spent if it.rule is Rule.PROBE else min(spent, forward.seconds)
        forward.seconds = 0.0
        watch.seconds["forward"] += solving
        watch.seconds["centre"] += spent - solving
        yield it
        start = time.perf_counter()


def _keep(report: Report, file: CheckpointFile, n_known: int) -> None:
    """Save the run so far; where that fails, the run goes on, and the report tells of it."""
    problem = report.problem
    if report.failed_write is not None:
        return
    if len(report.iterations) <= n_known:  # an interrupt here must not shorten what is there
        return
    answers = [(it.w, it.response) for it in report.iterations]
    try:
        file.save(Checkpoint(problem.setup, problem.demonstration, answers))
        report.checkpoint = str(file.path)
    except InvalidInputError as error:
        report.failed_write, report.checkpoint = error, None
