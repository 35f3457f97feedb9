"""What a recovery was asked to do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from walking_irl.domains.contract import EXPERTS
from walking_irl.errors import InvalidInputError
from walking_irl.geometry.centres import centre_rule
from walking_irl.types import MODES

TRAJECTORIES = 100
"""Demonstrations of methods that read actions, unless a user asks for another number."""
HORIZON = 50
"""Steps of each."""


@dataclass(frozen=True)
class Setup:
    """What to recover and how; the defaults are the main job.

    Attributes:
        domain: Name of the domain.
        centre: Key of the centre.
        mode: Mode of CPIRL.
        seed: Draws ground-truth weights and disturbances.
        weights: Ground-truth weights instead of drawn ones, or None.
        expert: "optimal", or "suboptimal": then known exactly.
        options: Values by name of the domain's options: how weights are drawn, what is recorded.
        demonstration: A file that holds the expert instead of a synthetic one, or None.
        expert_gap: How sub-optimal the expert may be, relative to its return, on the user's word;
            None for what its domain grants and the run measures.
        min_weight: The learner's lower bound of every weight; None for the domain's.
        max_solves: Budget of forward solves, probes left aside; None for the domain's.
        record: Where to write the recording, or None.
        checkpoint: Where to keep every answer of the solver, to resume from, or None.
    """

    domain: str = "humanoid"
    centre: str = "ac"
    mode: str = "optimal"
    seed: int = 0
    weights: tuple[float, ...] | None = None
    expert: str = "optimal"
    options: Mapping[str, Any] = field(default_factory=dict)
    demonstration: Path | None = None
    expert_gap: float | None = None
    min_weight: float | None = None
    max_solves: int | None = None
    record: Path | None = None
    checkpoint: Path | None = None

    def __post_init__(self) -> None:
        centre_rule(self.centre)
        for what, value, choices in (
            ("mode", self.mode, MODES),
            ("expert", self.expert, EXPERTS),
        ):
            if value not in choices:
                raise InvalidInputError(
                    f"unknown {what} {value!r}; choose from {', '.join(choices)}"
                )
        if not 0 <= self.seed < 2**63:
            raise InvalidInputError(f"seed must be a whole number in [0, 2^63), got {self.seed}")
        for name, most in (("expert_gap", 1.0), ("min_weight", 1.0)):
            value = getattr(self, name)
            if value is not None and not 0.0 <= value < most:
                flag = name.replace("_", "-")
                raise InvalidInputError(f"{flag} must lie in [0, {most:g}), got {value}")
        if self.max_solves is not None and self.max_solves < 1:
            raise InvalidInputError(f"max-solves must be at least 1, got {self.max_solves}")

    @property
    def drawn_from(self) -> int | None:
        """Seed of the ground-truth weights, or None where they were given or nobody knows them."""
        is_drawn = self.weights is None and self.demonstration is None
        return self.seed if is_drawn else None
