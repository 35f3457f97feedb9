"""What a recovery is about: the setup, the expert, and the solver that the learner gets.

The learner's side receives :attr:`Subject.expert` and :attr:`Case.forward` only. Hidden weights
stay beside them, for scoring and for pictures.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from walking_irl.centres import centre_rule
from walking_irl.cpirl import MODES
from walking_irl.domains import load
from walking_irl.errors import InvalidInputError
from walking_irl.types import Array, Expert, Response, Rollout

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
        archive: Where to keep every answer of the solver, so that the run can be resumed, or None.
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
    archive: Path | None = None

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


@dataclass(frozen=True)
class Subject:
    """Who is to be explained.

    Attributes:
        expert: What the learner receives.
        policy: The expert's own policy; for pictures.
        w_expert: Hidden weights, shape (K,), or None where nobody knows them; for scoring.
        true_mu: Features of the policy without noise, shape (K,), or None; for scoring.
        trajectories: What was recorded of the expert.
    """

    expert: Expert
    policy: Any
    w_expert: Array | None = None
    true_mu: Array | None = None
    trajectories: tuple[Rollout, ...] = ()


@dataclass
class Case:
    """A subject, the learner's tools, and what a recording shows.

    Attributes:
        domain: The domain.
        subject: Who is to be explained.
        forward: The learner's forward solver.
        measure: Measures a policy as the expert was measured, or None.
        min_weight: The learner's lower bound of every weight.
        world: What a recording shows beside the polyhedron, or None.
        motion: Maps a policy, and the weights it is the best for, to what the world shows of it.
        watch: Hands the learner's solver a function of its iteration and cost.
    """

    domain: Any
    subject: Subject
    forward: Callable[[Array], Response]
    measure: Any = None
    min_weight: float = 0.0
    world: Any = None
    motion: Callable[[Any, Array], Any] = field(default=lambda policy, w: None)
    watch: Callable[[Callable[[int, float], None]], None] = field(default=lambda f: None)


def prepare(setup: Setup, executor: Executor | None) -> Case:
    """Make the expert: solve for its policy, record it; or read the demonstration.

    Raises:
        InvalidInputError: If the setup asks for what there is not.
        FallError: If a recorded expert falls.
    """
    domain = load(setup.domain)
    if setup.domain.startswith("humanoid"):
        from walking_irl.humanoid_case import humanoid_subject

        return case_of(setup, humanoid_subject(domain, setup, executor), executor)
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
    return case_of(setup, Subject(expert, expert.demonstration, w_E, expert.mu), executor)


def case_of(setup: Setup, subject: Subject, executor: Executor | None) -> Case:
    """The learner's tools for a subject that is known, and what a recording shows."""
    domain = load(setup.domain)
    if setup.domain.startswith("humanoid"):
        from walking_irl.humanoid_case import humanoid_case

        return humanoid_case(domain, setup, subject, executor)
    case = Case(domain, subject, domain.forward)
    if setup.record is not None:
        from walking_irl.recording.worlds import world_of

        w = subject.w_expert
        case.world, case.motion = world_of(setup.domain, domain, subject.policy, w)
    return case


def _given(setup: Setup, n: int) -> Array:
    w = np.asarray(setup.weights, dtype=float)
    if w.shape != (n,):
        raise InvalidInputError(f"{setup.domain} has {n} objectives, got {w.size} weights")
    if not np.isfinite(w).all() or (w < 0).any() or w.sum() <= 0:
        raise InvalidInputError(f"weights must be finite, >= 0 and not all zero, got {w.tolist()}")
    return np.asarray(w / w.sum())
