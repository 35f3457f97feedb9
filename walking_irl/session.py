"""One recovery from hidden weights to report: expert, learner, recording, scoring.

The learner's side, :func:`~walking_irl.cpirl.cpirl` and the forward solver handed to it, receives
the :class:`~walking_irl.types.Expert` only. Hidden weights stay in this module, for scoring and for
the picture.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from copy import copy
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from walking_irl.centres import centre_rule
from walking_irl.cpirl import MODES, cpirl
from walking_irl.domains import load
from walking_irl.errors import InvalidInputError, RecordingError
from walking_irl.report import Report
from walking_irl.types import Array, Expert, Iteration, Response, Rollout, Rule

PROBE = 1e-4
"""Relative suboptimality whose extreme weights are probed at the end."""
MAX_SOLVES = 20
EXPERTS = ("optimal", "suboptimal")


@dataclass(frozen=True)
class Setup:
    """What to recover and how; the defaults are the main job.

    Attributes:
        domain: Name of the domain.
        centre: Key of the centre.
        mode: Mode of CPIRL.
        seed: Draws hidden weights and disturbances.
        weights: Hidden weights instead of drawn ones, or None.
        population: "typical" or "uniform" hidden weights.
        expert: "optimal", or "suboptimal": then known exactly, whatever ``rollouts`` says.
        rollouts: Trajectories recorded of the expert; 0 for its exact features.
        noise: Standard deviation of their disturbance [rad/s].
        disturbance: "initial" or "kicks".
        demonstration: A gait file instead of a synthetic expert, or None.
        max_solves: Budget of forward solves, probes left aside.
        record: Where to write the recording, or None.
    """

    domain: str = "humanoid"
    centre: str = "ac"
    mode: str = "optimal"
    seed: int = 0
    weights: tuple[float, ...] | None = None
    population: str = "typical"
    expert: str = "optimal"
    rollouts: int = 20
    noise: float = 0.02
    disturbance: str = "initial"
    demonstration: Path | None = None
    max_solves: int = MAX_SOLVES
    record: Path | None = None

    def __post_init__(self) -> None:
        centre_rule(self.centre)
        if self.mode not in MODES:
            raise InvalidInputError(f"unknown mode {self.mode!r}; choose from {', '.join(MODES)}")
        if self.expert not in EXPERTS:
            choices = " or ".join(EXPERTS)
            raise InvalidInputError(f"unknown expert {self.expert!r}; choose {choices}")
        if self.seed < 0:
            raise InvalidInputError(f"seed must be a whole number >= 0, got {self.seed}")
        if self.max_solves < 1:
            raise InvalidInputError(f"max-solves must be at least 1, got {self.max_solves}")


@dataclass
class Case:
    """An expert to be explained, with what only scoring and pictures may use.

    Attributes:
        domain: The domain.
        expert: What the learner receives.
        forward: The learner's forward solver.
        measure: Measures a policy as the expert was measured, or None.
        min_weight: The learner's lower bound of every weight.
        w_expert: Hidden weights, or None.
        true_mu: Features of the expert's own policy without noise, or None.
        world: What a recording shows beside the polyhedron, or None.
        motion: Maps a policy, and the weights it is the best for, to what the world shows of it.
        trajectories: What was recorded of the expert.
        watch: Hands the learner's solver a function of its iteration and cost.
    """

    domain: Any
    expert: Expert
    forward: Callable[[Array], Response]
    measure: Any = None
    min_weight: float = 0.0
    w_expert: Array | None = None
    true_mu: Array | None = None
    world: Any = None
    motion: Callable[[Any, Array], Any] = field(default=lambda policy, w: None)
    trajectories: tuple[Rollout, ...] = ()
    watch: Callable[[Callable[[int, float], None]], None] = field(default=lambda f: None)


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


def prepare(setup: Setup, executor: Executor | None) -> Case:
    """Make the expert: solve for its policy, record it; or read the demonstration.

    Raises:
        InvalidInputError: If the setup asks for what there is not.
        FallError: If a recorded expert falls.
    """
    domain = load(setup.domain)
    if setup.domain.startswith("humanoid"):
        from walking_irl.humanoid_case import humanoid_case

        return humanoid_case(domain, setup, executor)
    if setup.demonstration is not None:
        raise InvalidInputError(f"domain {setup.domain} takes no demonstration files")
    rng = np.random.default_rng(setup.seed)
    K = len(domain.objectives)
    w_E = _given(setup, K) if setup.weights else rng.dirichlet(np.ones(K))
    if setup.expert == "optimal":
        expert = domain.expert(w_E, rng)
    elif hasattr(domain, "suboptimal_expert"):
        expert = domain.suboptimal_expert(w_E, rng)
    else:
        raise InvalidInputError(f"domain {setup.domain} has no suboptimal expert")
    case = Case(domain, expert, domain.forward, w_expert=w_E, true_mu=expert.mu)
    if setup.record is not None:
        from walking_irl.recording.worlds import world_of

        case.world, case.motion = world_of(setup.domain, domain, expert.demonstration, w_E)
    return case


def _given(setup: Setup, n: int) -> Array:
    w = np.asarray(setup.weights, dtype=float)
    if w.shape != (n,):
        raise InvalidInputError(f"{setup.domain} has {n} objectives, got {w.size} weights")
    if not np.isfinite(w).all() or (w < 0).any() or w.sum() <= 0:
        raise InvalidInputError(f"weights must be finite, >= 0 and not all zero, got {w.tolist()}")
    return np.asarray(w / w.sum())


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
    executor: Executor | None = None,
    on_expert: Callable[[Case], None] = lambda case: None,
    on_iteration: Callable[[Iteration, Report], None] = lambda it, report: None,
) -> Report:
    """Recover the weights of one expert.

    Ctrl-C after the first iteration ends the run with a report of what is done, marked
    interrupted; the recording is complete up to there. A recording that cannot be written at the
    end is told by the report, too, so that the result is not lost with it.

    Args:
        setup: What to do.
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
        case = prepare(setup, executor)
    on_expert(case)
    report = Report(
        domain=setup.domain,
        objectives=case.domain.objectives,
        centre=setup.centre,
        mode=setup.mode,
        seed=setup.seed if setup.weights is None and setup.demonstration is None else None,
        w_expert=case.w_expert,
        expert=case.expert,
        true_mu=case.true_mu,
    )
    try:
        try:
            _learn(setup, case, report, watch, executor, on_iteration)
        except RecordingError as error:
            if not report.iterations:
                raise
            report.failed_write, report.recording = error, None
        report.recovered_mu = case.forward(report.w).mu if report.w_expert is not None else None
    except KeyboardInterrupt as interrupt:
        if not report.iterations:
            raise
        report.was_interrupted = True
        notes = getattr(interrupt, "__notes__", [])  # of a recording that could not be written
        if notes:
            report.failed_write, report.recording = RecordingError(notes[0]), None
    report.seconds = watch.finish()
    return report


def _learn(
    setup: Setup,
    case: Case,
    report: Report,
    watch: Stopwatch,
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
                expert=case.expert,
                centre=setup.centre,
                mode=setup.mode,
                seed=report.seed,
                w_expert=case.w_expert,
            )
            recorder = stack.enter_context(Recorder(setup.record, experiment, case.world))
            report.recording = str(setup.record)
        forward = TimedForward(case.forward)
        steps = cpirl(
            forward,
            case.expert,
            centre=setup.centre,
            mode=setup.mode,  # type: ignore[arg-type]
            max_solves=setup.max_solves,
            min_weight=case.min_weight,
            rng=np.random.default_rng(setup.seed),
            measure=case.measure,
            executor=executor,
            probe=PROBE,
        )
        start = time.perf_counter()
        for it in steps:
            spent = time.perf_counter() - start
            solving = spent if it.rule is Rule.PROBE else min(spent, forward.seconds)
            forward.seconds = 0.0
            watch.seconds["forward"] += solving
            watch.seconds["centre"] += spent - solving
            report.iterations.append(it)
            on_iteration(it, report)
            if recorder is not None:
                with watch.part("recording"):
                    recorder.iteration(it, case.motion(it.response.policy, it.w))
            start = time.perf_counter()
        if recorder is not None and case.world is not None:
            with watch.part("recording"):
                best = _nearest(report)
                recorder.finale(case.motion(best.response.policy, best.w))


def _nearest(report: Report) -> Iteration:
    """The query nearest to the recovered weights."""
    return min(report.iterations, key=lambda it: float(np.abs(it.w - report.w).sum()))
