"""The recording of what a method found: weights and, where the domain has a view, a policy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.registry import METHODS
from walking_irl.recording.method import Found
from walking_irl.recording.method_recorder import MethodRecorder
from walking_irl.recording.views.registry import World, world_of
from walking_irl.run.by_method import MethodReport, scaled
from walking_irl.run.film import experiment_of


def record_report(report: MethodReport, path: Path) -> None:
    """Write the recording of a method's answer; also after Ctrl-C, as far as it came.

    Raises:
        RecordingError: If it cannot be written.
    """
    problem = report.problem
    world = world_of(problem.domain, problem.demonstration)
    view = None if world is None else world.view
    with MethodRecorder(path, experiment_of(problem), found_of(report), view) as recorder:
        if world is None:
            recorder.play(None)
        else:
            recorder.play(_answer(report, world), _entries(report, world))


def found_of(report: MethodReport) -> Found:
    """What a report says, as far as a recording shows it."""
    found, method = report.found, METHODS[report.method]
    has_weights = report.weights is not None or found.w is None
    return Found(
        method=report.method,
        source=method.source,
        guarantee=method.guarantee,
        seen=f"{report.n_trajectories} trajectories" if report.n_trajectories else "the expert",
        ending=found.status.value,
        status=found.status.name.lower(),
        w=report.weights,
        is_signed=_is_signed(report),
        intervals=report.intervals,
        samples=report.samples,
        objective=found.objective,
        iterates=None if found.iterates is None or not has_weights else scaled(found.iterates),
        loss=report.relative_loss,
        notes=found.notes,
    )


def _is_signed(report: MethodReport) -> bool:
    known = (report.weights, report.samples, report.found.iterates)
    return any(w is not None and float(np.min(w)) < -1e-9 for w in known)


def _answer(report: MethodReport, world: World) -> Any:
    """What the world shows of the policy found; where there are weights alone, of their best."""
    found, w = report.found, report.weights
    policy = found.policy
    if _is_lottery(report):
        policy = policy[int(np.argmax(found.info["mixture"]))]
    if policy is None:
        if w is None or w.min() < report.problem.min_weight:
            return None
        policy = report.problem.learner.forward(w).policy
    return world.motion(policy, None, _seen(report, found.reward))


def _entries(report: MethodReport, world: World) -> Callable[[int], Any] | None:
    """What it shows of each entry of the log: the lottery's policies one by one."""
    if not _is_lottery(report):
        return None
    policies = report.found.policy
    return lambda k: world.motion(policies[k])


def _is_lottery(report: MethodReport) -> bool:
    return "mixture" in report.found.info and isinstance(report.found.policy, tuple)


def _seen(report: MethodReport, reward: Array | None) -> Array | None:
    """A reward over the span of the true one: scale and offset change no policy."""
    truth = report.problem.demonstration.truth
    if reward is None or truth is None:
        return reward
    true = report.problem.domain.mdp.reward(truth.w)  # type: ignore[attr-defined]
    share = (reward - reward.min()) / max(float(np.ptp(reward)), 1e-300)
    seen: Array = true.min() + share * np.ptp(true)
    return seen
