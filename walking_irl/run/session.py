"""One recovery from hidden weights to report: expert, learner, recording, scoring."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from copy import copy
from multiprocessing import get_context
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.loop import cpirl
from walking_irl.cpirl.probes import Probing
from walking_irl.errors import FallError, InvalidInputError, RecordingError, SolverError
from walking_irl.run.case import Case, Setup
from walking_irl.run.checkpoint import Remembering, SavedRun, save_run
from walking_irl.run.preparation import case_of, prepare
from walking_irl.run.report import Report
from walking_irl.types import Iteration, Response, Rule

PROBE = 1e-4
"""Relative suboptimality whose extreme weights are probed at the end."""


@contextmanager
def workers() -> Iterator[Executor]:
    """A process pool of the machine's cores; an interrupt reaches this process only."""
    count = os.cpu_count() or 1
    pool = ProcessPoolExecutor(
        count,
        mp_context=get_context("spawn"),
        initializer=signal.signal,
        initargs=(signal.SIGINT, signal.SIG_IGN),
    )
    try:
        with _interrupts_held():
            for _ in range(count):
                pool.submit(os.getpid)  # starts a process, which inherits the held signal
        yield pool
        pool.shutdown()
    except BaseException:
        for process in list((pool._processes or {}).values()):
            process.terminate()
        pool.shutdown(wait=False, cancel_futures=True)
        raise


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Ctrl-C waits: it would hit processes that cannot ignore it yet, and they would say so."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class Stopwatch:
    """Wall time by part; wraps callables so that algorithms know nothing of clocks."""

    def __init__(self) -> None:
        self.seconds = {
            "total": 0.0,
            "forward": 0.0,
            "centre": 0.0,
            "expert": 0.0,
            "recording": 0.0,
        }
        self._start = time.perf_counter()

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Add the time of a block."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] += time.perf_counter() - start

    def finish(self) -> dict[str, float]:
        """All parts; what neither solves nor records is the learner's own ("centre")."""
        s = self.seconds
        s["total"] = time.perf_counter() - self._start
        return {k: round(v, 3) for k, v in s.items()}


class TimedForward:
    """A forward solver that counts its own time; in another process it is the plain solver."""

    def __init__(self, forward: Callable[[Array], Response]) -> None:
        self.forward = forward
        self.seconds = 0.0

    def __call__(self, w: Array) -> Response:
        """The solver's answer."""
        start = time.perf_counter()
        try:
            return self.forward(w)
        finally:
            self.seconds += time.perf_counter() - start

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles as the solver that it wraps."""
        return copy, (self.forward,)


def run(
    setup: Setup,
    *,
    saved: SavedRun | None = None,
    executor: Executor | None = None,
    on_expert: Callable[[Case], None] = lambda case: None,
    on_iteration: Callable[[Iteration, Report], None] = lambda it, report: None,
) -> Report:
    """Recover the weights of one expert.

    Ctrl-C after the first iteration, or a solver that fails then, ends the run with a report of
    what is done, marked so; the recording is complete up to there. A recording that cannot be
    written at the end is told by the report, too, so that the result is not lost with it.

    Args:
        setup: What to do.
        saved: A run of the same setup to resume: its expert and its solver's answers are taken
            from there, and every figure is computed again.
        executor: Runs independent solves side by side.
        on_expert: Called when the expert is known.
        on_iteration: Called after every iteration.

    Raises:
        InvalidInputError: If the setup is wrong.
        RecordingError: If the recording cannot be written; before any iteration.
    """
    watch = Stopwatch()
    if setup.record is not None:
        from walking_irl.recording import check_writable

        check_writable(setup.record)
    with watch.part("expert"):
        if saved is None:
            case = prepare(setup, executor)
        else:
            case = case_of(setup, saved.subject, executor)
            case.forward = Remembering(case.forward, saved.answers)
    subject = case.subject
    on_expert(case)
    report = Report(
        domain=setup.domain,
        objectives=case.domain.objectives,
        centre=setup.centre,
        mode=setup.mode,
        seed=setup.seed if setup.weights is None and setup.demonstration is None else None,
        w_expert=subject.w_expert,
        expert=subject.expert,
        true_mu=subject.true_mu,
    )
    n_saved = 0
    if saved is not None:
        n_saved = len(saved.answers)
        if setup.archive is not None:  # it may be another file than the one that was read
            save_run(setup.archive, SavedRun(setup, subject, saved.answers))
            report.archive = str(setup.archive)
    try:
        _learn(setup, case, report, watch, n_saved, executor, on_iteration)
    except (KeyboardInterrupt, SolverError, FallError, RecordingError) as problem:
        if not report.iterations:
            raise
        _tell(problem, report)
    if report.w_expert is not None and not report.was_interrupted:
        with suppress(KeyboardInterrupt, SolverError, FallError):  # the result does not hang on it
            report.recovered_mu = case.forward(report.w).mu
    report.seconds = watch.finish()
    return report


def _tell(problem: BaseException, report: Report) -> None:
    """Let the report tell why the run was cut short, or its recording not written."""
    if isinstance(problem, RecordingError):
        report.failed_write, report.recording = problem, None
        return
    report.was_interrupted = isinstance(problem, KeyboardInterrupt)
    report.failure = "" if report.was_interrupted else str(problem)
    notes = getattr(problem, "__notes__", [])  # of a recording that could not be written
    if notes:
        report.failed_write, report.recording = RecordingError(notes[0]), None


def _learn(
    setup: Setup,
    case: Case,
    report: Report,
    watch: Stopwatch,
    n_saved: int,
    executor: Executor | None,
    on_iteration: Callable[[Iteration, Report], None],
) -> None:
    with ExitStack() as stack:
        recorder = None
        if setup.record is not None:
            from walking_irl.recording import Experiment, Recorder

            experiment = Experiment(
                domain=setup.domain,
                objectives=report.objectives,
                expert=case.subject.expert,
                centre=setup.centre,
                mode=setup.mode,
                seed=report.seed,
                w_expert=case.subject.w_expert,
            )
            recorder = stack.enter_context(Recorder(setup.record, experiment, case.world))
            report.recording = str(setup.record)
        forward = TimedForward(case.forward)
        steps = cpirl(
            forward,
            case.subject.expert,
            centre=setup.centre,
            mode=setup.mode,  # type: ignore[arg-type]
            max_solves=setup.max_solves,
            min_weight=case.min_weight,
            rng=np.random.default_rng(setup.seed),
            measure=case.measure,
            probe=Probing(PROBE, executor),
        )
        start = time.perf_counter()
        for it in steps:
            spent = time.perf_counter() - start
            solving = spent if it.rule is Rule.PROBE else min(spent, forward.seconds)
            forward.seconds = 0.0
            watch.seconds["forward"] += solving
            watch.seconds["centre"] += spent - solving
            report.iterations.append(it)
            with watch.part("recording"):
                _keep(setup, case, report, n_saved)
            on_iteration(it, report)
            if recorder is not None:
                with watch.part("recording"):
                    recorder.iteration(it, case.motion(it.response.policy, it.w))
            start = time.perf_counter()
        if recorder is not None and case.world is not None:
            with watch.part("recording"):
                best = _nearest(report)
                recorder.finale(case.motion(best.response.policy, best.w))


def _keep(setup: Setup, case: Case, report: Report, n_saved: int) -> None:
    """Save the run so far; where that fails, the run goes on, and the report tells of it."""
    if setup.archive is None or report.failed_write is not None:
        return
    if len(report.iterations) <= n_saved:  # an interrupt here must not shorten what is there
        return
    answers = [(it.w, it.response) for it in report.iterations]
    try:
        save_run(setup.archive, SavedRun(setup, case.subject, answers))
        report.archive = str(setup.archive)
    except InvalidInputError as error:
        report.failed_write, report.archive = error, None


def _nearest(report: Report) -> Iteration:
    """The query nearest to the recovered weights."""
    return min(report.iterations, key=lambda it: float(np.abs(it.w - report.w).sum()))
