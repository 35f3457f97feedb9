"""One expert of a study: its recovery as a job, and all that is kept of it."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, replace
from typing import Any

from walking_irl.errors import WalkingIRLError
from walking_irl.run import session
from walking_irl.run.report import Report
from walking_irl.run.setup import Setup
from walking_irl.types import Certainty, Rule
from walking_irl.workers import interrupts_kept

FILES = ("record", "checkpoint", "demonstration", "weights")
"""Fields of a setup that an expert of a study has not."""
PARTS = ("noise", "gap", "solver")
"""Of a half width: from noise, from the expert's possible sub-optimality, from the solver."""
FAILED = "failed"
"""Ending of an expert that could not be made, or whose learner failed at once."""


@dataclass(frozen=True)
class ExpertJob:
    """A picklable recovery; equal jobs have equal outcomes but for the clock.

    Attributes:
        setup: What to recover; its seed draws the ground-truth weights.
    """

    setup: Setup

    def key(self) -> dict[str, Any]:
        """The job as JSON types."""
        asked = asdict(replace(self.setup, options=dict(self.setup.options)))
        return {"study": {name: asked[name] for name in asked if name not in FILES}}

    def run(self) -> dict[str, Any]:
        """Recover it in this process; a failure is an outcome.

        Raises:
            MemoryError: If there is too little; another run may have enough.
            OSError: If the system fails.
        """
        start, cpu = time.perf_counter(), time.process_time()
        try:
            with interrupts_kept():
                found = outcome_of(session.run(self.setup))
        except (MemoryError, OSError):
            raise
        except WalkingIRLError as problem:
            found = {"ending": FAILED, "status": str(problem), "error": str(problem)}
        except Exception as problem:  # one expert that fails must not lose a study
            told = f"{type(problem).__name__}: {problem}"
            found = {"ending": FAILED, "status": told, "error": told}
        return {
            "seed": self.setup.seed,
            **found,
            "seconds": time.perf_counter() - start,
            "cpu_seconds": time.process_time() - cpu,
        }


def outcome_of(report: Report) -> dict[str, Any]:
    """What a study keeps of a recovery of known ground-truth weights, as JSON types."""
    assert report.w_expert is not None  # a study's experts are synthetic
    last, least = report.last, report.problem.domain.defaults.min_weight
    return {
        "objectives": [o.name for o in report.objectives],
        "w_expert": report.w_expert.tolist(),
        "w": report.w.tolist(),
        "intervals": last.intervals.tolist(),
        "least": least,
        "n_samples": report.expert.n_samples,
        "parts": _parts(report.summary.certainty),
        "l1_error": report.l1_error,
        "loss": report.relative_loss(report.recovered_mu),
        "bracket": list(report.summary.bracket),
        "is_success": report.is_success,
        "ending": report.ending.name.lower(),
        "status": report.status,
        "solves": sum(it.rule is not Rule.PROBE for it in report.iterations),
        "probes": sum(it.rule is Rule.PROBE for it in report.iterations),
        "error": report.failure or None,
    }


def _parts(certainty: Certainty | None) -> dict[str, list[float]] | None:
    """Half widths by cause; None where a run has no model of its regret."""
    if certainty is None:
        return None
    return {part: getattr(certainty, f"from_{part}").tolist() for part in PARTS}
