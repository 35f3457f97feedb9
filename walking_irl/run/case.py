"""What a recovery is about: the setup, the expert, and the solver that the learner gets.

The learner's side receives :attr:`Subject.expert` and :attr:`Case.forward` only. Hidden weights
stay beside them, for scoring and for pictures.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.geometry.centres import centre_rule
from walking_irl.types import MODES, Expert, Response, Rollout

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
        if not 0 <= self.seed < 2**63:
            raise InvalidInputError(f"seed must be a whole number in [0, 2^63), got {self.seed}")
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
