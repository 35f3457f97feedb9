"""The humanoid's side of a session: experts, demonstrations from files, what a recording shows."""

from __future__ import annotations

from concurrent.futures import Executor

import numpy as np

from walking_irl.domains.humanoid.closed_loop.trials import Trials
from walking_irl.domains.humanoid.demonstrations import demonstrated
from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.domains.humanoid.gait.gait import Gait, cycle_motion
from walking_irl.domains.humanoid.learner import check_weights
from walking_irl.domains.humanoid.population import POPULATIONS
from walking_irl.errors import InvalidInputError
from walking_irl.run.case import Case, Setup, Subject
from walking_irl.types import Rollout

THREADS = 2
"""Threads of one learner's solve: solves follow one another, so the cores would idle."""
MIN_WEIGHT = 0.005
"""The learner's lower bound of every weight; the gait of a vanishing weight is ill-defined."""


def humanoid_subject(domain: Humanoid, setup: Setup, executor: Executor | None) -> Subject:
    """The expert that a setup asks for."""
    if setup.demonstration is not None:
        shown = demonstrated(setup.demonstration, domain.spec)
        return Subject(shown.expert, shown.gait, trajectories=shown.rollouts)
    rng = np.random.default_rng(setup.seed)
    if setup.population not in POPULATIONS:
        choices = ", ".join(POPULATIONS)
        raise InvalidInputError(f"unknown population {setup.population!r}; choose from {choices}")
    w_E = POPULATIONS[setup.population](rng, domain.spec.stack.reference_weights)
    if setup.weights is not None:
        w_E = check_weights(np.asarray(setup.weights), domain.spec)
    if setup.expert == "suboptimal":
        made = domain.demonstrate_poorly(w_E, rng, executor)
        return Subject(made.expert, made.gait, w_E, made.expert.mu)
    made = domain.demonstrate(w_E, rng, _trials(setup, False), executor)
    return Subject(made.expert, made.gait, w_E, -made.optimum.total_costs, made.rollouts)


def humanoid_case(
    domain: Humanoid, setup: Setup, subject: Subject, executor: Executor | None
) -> Case:
    """The learner's tools for an expert that is known."""
    is_exact = subject.expert.covariance is None
    case = Case(
        domain,
        subject,
        domain.learner(subject.expert, THREADS),
        measure=domain.remeasure(_trials(setup, is_exact), setup.seed, executor),
        min_weight=MIN_WEIGHT,
    )
    case.watch = lambda f: setattr(case.forward, "on_step", f)
    if setup.record is not None:
        from walking_irl.recording.views.gait import WalkerView

        case.world = WalkerView(domain.walker.model, one_cycle(domain, subject.policy))
        case.motion = lambda policy, w: one_cycle(domain, policy)
    return case


def _trials(setup: Setup, is_exact: bool) -> Trials:
    """How the expert is recorded; a gait that is given and a spoilt walk are known exactly."""
    return Trials(0 if is_exact else setup.rollouts, setup.noise, setup.disturbance)


def one_cycle(domain: Humanoid, gait: Gait) -> Rollout:
    """A gait's whole cycle, ready to be shown."""
    from walking_irl.recording.views.motion import periodic_rollout

    q, v, a = cycle_motion(gait, domain.walker.mirror)
    return periodic_rollout(q, v, a, gait.timestep, 2 * gait.step_length)
