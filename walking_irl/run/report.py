"""What a recovery found, as one record: for the terminal, for JSON, for a recording."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.summary import Summary, summarise
from walking_irl.errors import InvalidInputError, WalkingIRLError
from walking_irl.files import write_file
from walking_irl.types import Expert, Iteration, Objective, Rule, Status
from walking_irl.versions import versions

SUCCESS = (
    Status.MATCHED,
    Status.CONVERGED,
    Status.GAP_CLOSED,
    Status.DOMINATED,
    Status.MIXTURE_DOMINATES,
)
"""Endings that answer the question; any other leaves exit code 1."""
INTERRUPTED = "interrupted"


@dataclass
class Report:
    """Outcome of one recovery; hidden weights are known to it, never to the learner.

    Attributes:
        domain: Name of the domain.
        objectives: Its objectives.
        centre: Key of the centre.
        mode: Mode of CPIRL.
        seed: Seed, or None where weights were given.
        w_expert: Hidden weights, shape (K,), or None for a demonstration of unknown weights.
        iterations: All that CPIRL yielded.
        expert: What the learner was told of the expert.
        true_mu: Of the expert's optimal policy without noise, for scoring; or None.
        recovered_mu: Of the best policy for the recovered weights, for scoring; or None.
        seconds: Wall time by part [s].
        recording: Path of the recording, if there is one.
        was_interrupted: Whether Ctrl-C ended it.
        failure: Why a solver ended it, or nothing.
        archive: Path of the file that the run can be resumed from, if there is one.
        failed_write: Why the recording or that file could not be written, or None.
    """

    domain: str
    objectives: tuple[Objective, ...]
    centre: str
    mode: str
    seed: int | None
    w_expert: Array | None
    expert: Expert
    true_mu: Array | None = None
    iterations: list[Iteration] = field(default_factory=list)
    recovered_mu: Array | None = None
    seconds: dict[str, float] = field(default_factory=dict)
    recording: str | None = None
    was_interrupted: bool = False
    failure: str = ""
    archive: str | None = None
    failed_write: WalkingIRLError | None = None

    @property
    def last(self) -> Iteration:
        """The newest iteration.

        Raises:
            InvalidInputError: If there is none.
        """
        if not self.iterations:
            raise InvalidInputError("the run ended before its first forward solve")
        return self.iterations[-1]

    @property
    def recovery(self) -> Summary:
        """What was found, how sure it is, and what limits it."""
        return summarise(self.iterations, self.expert, self.objectives)

    @property
    def w(self) -> Array:
        """Recovered weights, shape (K,)."""
        return self.last.estimate

    @property
    def status(self) -> str:
        """Why the run ended, in one sentence."""
        if self.failure:
            return f"a forward solve failed: {self.failure}"
        return INTERRUPTED if self.was_interrupted else self.ending.value

    @property
    def ending(self) -> Status:
        """Why CPIRL yielded its last iteration."""
        return self.last.status

    @property
    def is_success(self) -> bool:
        """Whether the run answers what the expert walks for."""
        return not self.was_interrupted and not self.failure and self.ending in SUCCESS

    @property
    def contains_expert(self) -> bool | None:
        """Whether the hidden weights lie inside the intervals."""
        if self.w_expert is None:
            return None
        lower, upper = self.last.intervals.T
        return bool(np.all((self.w_expert >= lower - 1e-9) & (self.w_expert <= upper + 1e-9)))

    @property
    def l1_error(self) -> float | None:
        """Sum of the weights' absolute errors."""
        return None if self.w_expert is None else float(np.abs(self.w - self.w_expert).sum())

    def relative_loss(self, mu: Array | None) -> float | None:
        """(J_E - J) / |J_E| of a policy under the hidden weights."""
        if self.w_expert is None or self.true_mu is None or mu is None:
            return None
        J_E = float(self.w_expert @ self.true_mu)
        return (J_E - float(self.w_expert @ mu)) / abs(J_E)

    @property
    def solves_to_1pct(self) -> int | None:
        """Forward solves until some policy found lost less than 1 % under the hidden weights."""
        for it in self.iterations:
            loss = self.relative_loss(it.response.mu)
            if loss is not None and loss < 0.01:
                return it.k + 1
        return None

    def to_json(self) -> dict[str, Any]:
        """Everything as plain JSON types."""
        last = self.last
        return {
            "domain": self.domain,
            "objectives": [o.name for o in self.objectives],
            "centre": self.centre,
            "mode": self.mode,
            "seed": self.seed,
            "w_expert": None if self.w_expert is None else self.w_expert.tolist(),
            "w": self.w.tolist(),
            "intervals": last.intervals.tolist(),
            "contains_expert": self.contains_expert,
            "l1_error": self.l1_error,
            "relative_loss": self.relative_loss(self.recovered_mu),
            "regret": last.best_regret,
            "certificate": last.certificate,
            "forward_solves": sum(it.rule is not Rule.PROBE for it in self.iterations),
            "probe_solves": sum(it.rule is Rule.PROBE for it in self.iterations),
            "solves_to_1pct": self.solves_to_1pct,
            "status": self.status,
            "summary": _summary(self.recovery),
            "seconds": self.seconds,
            "history": [_entry(it) for it in self.iterations],
            "recording": self.recording,
            "archive": self.archive,
            "versions": versions(),
        }


def _summary(r: Summary) -> dict[str, Any]:
    return {
        "rule": r.rule,
        "bracket": list(r.bracket),
        "physical_intervals": r.physical_intervals.tolist(),
        "volume_ratio": r.volume_ratio,
        "condition_number": r.condition_number,
        "weakest": r.weakest,
        "gauge": r.gauge,
        "noise": r.noise.tolist(),
    }


def _entry(it: Iteration) -> dict[str, Any]:
    return {
        "k": it.k,
        "rule": it.rule.name.lower(),
        "w": it.w.tolist(),
        "mu": it.response.mu.tolist(),
        "regret": it.regret,
        "certificate": it.certificate,
        "intervals": it.intervals.tolist(),
        "estimate": it.estimate.tolist(),
        "solver": {k: v for k, v in it.response.info.items() if isinstance(v, int | float | str)},
    }


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write JSON; numbers that are not finite become null.

    Raises:
        InvalidInputError: If the file cannot be written.
    """
    write_file(path, (json.dumps(to_plain(content), indent=1, allow_nan=False) + "\n").encode())


def to_plain(value: Any) -> Any:
    """A value as JSON types; numbers that are not finite become None."""
    if isinstance(value, dict):
        return {str(k): to_plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [to_plain(v) for v in value]
    if isinstance(value, np.ndarray | np.generic):
        return to_plain(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value
