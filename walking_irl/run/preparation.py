"""From a setup to its case: makes the expert, or reads it, and hands the learner its tools."""

from __future__ import annotations

from concurrent.futures import Executor

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains import load
from walking_irl.errors import InvalidInputError
from walking_irl.run.case import Case, Setup, Subject

WALKERS_ONLY = ("population", "rollouts", "noise", "disturbance")
"""Settings of a recorded humanoid."""


def prepare(setup: Setup, executor: Executor | None) -> Case:
    """Make the expert: solve for its policy, record it; or read the demonstration.

    Raises:
        InvalidInputError: If the setup asks for what there is not.
        FallError: If a recorded expert falls.
    """
    domain = load(setup.domain)
    if setup.domain.startswith("humanoid"):
        from walking_irl.run.humanoid_case import humanoid_subject

        return case_of(setup, humanoid_subject(domain, setup, executor), executor)
    if setup.demonstration is not None:
        raise InvalidInputError(f"domain {setup.domain} takes no demonstration files")
    usual = Setup()
    unknown = [name for name in WALKERS_ONLY if getattr(setup, name) != getattr(usual, name)]
    if unknown:
        raise InvalidInputError(
            f"domain {setup.domain} takes no {', '.join(unknown)}: its experts are known exactly"
        )
    rng = np.random.default_rng(setup.seed)
    K = len(domain.objectives)
    w_E = _given(setup, K) if setup.weights else rng.dirichlet(np.ones(K))
    if setup.expert == "optimal":
        expert = domain.expert(w_E, rng)
    elif hasattr(domain, "suboptimal_expert"):
        expert = domain.suboptimal_expert(w_E, rng)
    else:
        raise InvalidInputError(f"domain {setup.domain} has no suboptimal expert")
    return case_of(setup, Subject(expert, expert.demonstration, w_E, expert.mu), executor)


def case_of(setup: Setup, subject: Subject, executor: Executor | None) -> Case:
    """The learner's tools for a subject that is known, and what a recording shows."""
    domain = load(setup.domain)
    if setup.domain.startswith("humanoid"):
        from walking_irl.run.humanoid_case import humanoid_case

        return humanoid_case(domain, setup, subject, executor)
    case = Case(domain, subject, domain.forward)
    if setup.record is not None:
        from walking_irl.recording.views.registry import world_of

        w = subject.w_expert
        case.world, case.motion = world_of(setup.domain, domain, subject.policy, w)
    return case


def _given(setup: Setup, n: int) -> Array:
    w = np.asarray(setup.weights, dtype=float)
    if w.shape != (n,):
        raise InvalidInputError(f"{setup.domain} has {n} objectives, got {w.size} weights")
    if not np.isfinite(w).all() or (w < 0).any() or not w.any():
        raise InvalidInputError(f"weights must be finite, >= 0 and not all zero, got {w.tolist()}")
    w = w / w.max()  # against overflow
    return np.asarray(w / w.sum())
