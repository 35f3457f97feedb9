"""What a recovery found, as one record: for the terminal, for JSON, for a recording."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.summary import Summary, summarise
from walking_irl.errors import InvalidInputError, WalkingIRLError
from walking_irl.run.problem import Problem
from walking_irl.types import Certainty, Expert, Iteration, Objective, Rule, Status
from walking_irl.versions import versions

INTERRUPTED = "interrupted"


@dataclass
class Report:
    """Outcome of one recovery; ground-truth weights are known to it, never to the learner.

    Attributes:
        problem: What it worked on.
        iterations: All that CPIRL yielded.
        recovered_mu: Of the best policy for the recovered weights, for scoring; or None.
        seconds: Wall time by part [s].
        recording: Path of the recording, if there is one.
        checkpoint: Path of the file that the run can be resumed from, if there is one.
        was_interrupted: Whether Ctrl-C ended it.
        failure: Why a solver ended it, or nothing.
        failed_write: Why the recording or the checkpoint could not be written, or None.
    """

    problem: Problem
    iterations: list[Iteration] = field(default_factory=list)
    recovered_mu: Array | None = None
    seconds: dict[str, float] = field(default_factory=dict)
    recording: str | None = None
    checkpoint: str | None = None
    was_interrupted: bool = False
    failure: str = ""
    failed_write: WalkingIRLError | None = None

    @property
    def expert(self) -> Expert:
        """What the learner was told of the expert."""
        return self.problem.expert

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """The domain's objectives."""
        return self.problem.objectives

    @property
    def w_expert(self) -> Array | None:
        """Ground-truth weights, shape (K,), or None where nobody knows them."""
        return self.problem.w_expert

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
    def summary(self) -> Summary:
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
        return INTERRUPTED if self.was_interrupted else self.summary.ending

    @property
    def ending(self) -> Status:
        """Why CPIRL yielded its last iteration."""
        return self.last.status

    @property
    def is_success(self) -> bool:
        """Whether the run answers what the expert walks for."""
        return not self.was_interrupted and not self.failure and self.ending.is_success

    @property
    def contains_expert(self) -> bool | None:
        """Whether the ground-truth weights lie inside the intervals."""
        if self.w_expert is None:
            return None
        lower, upper = self.last.intervals.T
        return bool(np.all((self.w_expert >= lower - 1e-9) & (self.w_expert <= upper + 1e-9)))

    @property
    def l1_error(self) -> float | None:
        """Sum of the weights' absolute errors."""
        return None if self.w_expert is None else float(np.abs(self.w - self.w_expert).sum())

    def relative_loss(self, mu: Array | None) -> float | None:
        """(J_E - J) / |J_E| of a policy under the ground-truth weights; the recording's loss."""
        truth = self.problem.demonstration.truth
        return None if truth is None or mu is None else truth.relative_loss(mu)

    @property
    def beaten_by(self) -> float | None:
        """By how much the best policy that the learner found beats the expert's own, relative.

        Under the ground-truth weights; at least 0. An expert that is meant to be optimal had missed
        that policy.
        """
        found = [it.response.mu for it in self.iterations]
        losses = [self.relative_loss(mu) for mu in (*found, self.recovered_mu) if mu is not None]
        gains = [-loss for loss in losses if loss is not None]
        return max(0.0, *gains) if gains else None

    @property
    def solves_to_1pct(self) -> int | None:
        """Forward solves until some policy found lost less than 1 % under the true weights."""
        for it in self.iterations:
            loss = self.relative_loss(it.response.mu)
            if loss is not None and loss < 0.01:
                return it.k + 1
        return None

    def to_json(self) -> dict[str, Any]:
        """Everything as plain JSON types."""
        setup, last = self.problem.setup, self.last
        return {
            "domain": setup.domain,
            "objectives": [o.name for o in self.objectives],
            "centre": setup.centre,
            "mode": setup.mode,
            "seed": setup.drawn_from,
            "w_expert": None if self.w_expert is None else self.w_expert.tolist(),
            "w": self.w.tolist(),
            "intervals": last.intervals.tolist(),
            "contains_expert": self.contains_expert,
            "l1_error": self.l1_error,
            "relative_loss": self.relative_loss(self.recovered_mu),
            "expert_beaten_by": self.beaten_by,
            "expert_gap": setup.expert_gap,
            "n_samples": self.expert.n_samples,
            "regret": last.best_regret,
            "certificate": last.certificate,
            "forward_solves": sum(it.rule is not Rule.PROBE for it in self.iterations),
            "probe_solves": sum(it.rule is Rule.PROBE for it in self.iterations),
            "solves_to_1pct": self.solves_to_1pct,
            "status": self.status,
            "summary": _summary(self.summary),
            "seconds": self.seconds,
            "history": [_entry(it) for it in self.iterations],
            "recording": self.recording,
            "checkpoint": self.checkpoint,
            "versions": versions(),
        }


def progress_line(it: Iteration, report: Report) -> str:
    """One line on an iteration, for a terminal."""
    solver = it.response.info.get("iterations")
    detail = f", {solver} solver iterations" if solver else ""
    rule = f"{it.rule.name.lower():6s}"
    scale = abs(float(it.w @ report.expert.mu))
    return (
        f"  {it.k + 1:3d} {rule}  regret {100 * it.regret / scale:9.5f} %  "
        f"certificate {it.certificate:.1e}  widest interval {it.widest:.4f}{detail}"
    )


def _summary(r: Summary) -> dict[str, Any]:
    return {
        "rule": r.rule,
        "bracket": list(r.bracket),
        "how_sure": r.how_sure,
        "half_widths": None if r.certainty is None else _parts(r.certainty),
        "physical_intervals": r.physical_intervals.tolist(),
        "volume_ratio": r.volume_ratio,
        "condition_number": r.condition_number,
        "weakest": r.weakest,
        "gauge": r.gauge,
        "noise": r.noise.tolist(),
    }


def _parts(certainty: Certainty) -> dict[str, Any]:
    """Half widths by cause; other levels of confidence scale the standard errors."""
    return {
        "from_noise": certainty.from_noise.tolist(),
        "from_gap": certainty.from_gap.tolist(),
        "from_solver": certainty.from_solver.tolist(),
        "standard_errors": certainty.standard_errors.tolist(),
        "gap": certainty.gap,
        "gap_source": certainty.source.value,
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
