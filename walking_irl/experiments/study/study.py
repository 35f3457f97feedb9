"""A study: what is asked of it, and how it runs."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from walking_irl.domains import load
from walking_irl.domains.contract import settings
from walking_irl.errors import InvalidInputError
from walking_irl.experiments.runner import Progress, Runner
from walking_irl.experiments.study.expert import FILES, ExpertJob
from walking_irl.experiments.study.result import Result
from walking_irl.run.setup import Setup


@dataclass(frozen=True)
class Study:
    """Which experts are recovered, and how.

    Attributes:
        setup: Of the first one; the others have the seeds that follow.
        experts: How many.

    Raises:
        InvalidInputError: If there is none, the setup names files or weights, or its domain takes
            no such options.
    """

    setup: Setup = field(default_factory=Setup)
    experts: int = 100

    def __post_init__(self) -> None:
        if self.experts < 1:
            raise InvalidInputError(f"experts must be at least 1, got {self.experts}")
        given = [name for name in FILES if getattr(self.setup, name) is not None]
        if given:
            raise InvalidInputError(
                f"a study draws its experts and writes its own files; leave out {', '.join(given)}"
            )
        domain = load(self.setup.domain)
        settings(domain.options, self.setup.options, f"domain {self.setup.domain}")

    @property
    def jobs(self) -> list[ExpertJob]:
        """One for each expert, in the order of their seeds."""
        first = self.setup.seed
        return [ExpertJob(replace(self.setup, seed=first + i)) for i in range(self.experts)]


def run_study(
    study: Study,
    *,
    cells: Path | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Result:
    """Recover every expert of a study; those that are done already are not recovered again.

    Args:
        study: What to do.
        cells: Folder of one small JSON file for each expert that is done, or None.
        executor: Runs experts side by side, e.g. a process pool.
        progress: Called with "study", experts done and experts in all.

    Raises:
        InvalidInputError: If every expert fails for one reason.
    """
    outcomes = Runner(executor, cells, progress).outcomes("study", study.jobs)
    _refuse_one_failure(outcomes)
    return Result(study.setup, tuple(outcomes))


def _refuse_one_failure(outcomes: Sequence[dict[str, Any]]) -> None:
    """Complain where nothing was recovered for a reason that has nothing to do with a seed."""
    reasons = {o["error"] for o in outcomes if "w" not in o}
    if len(reasons) == 1 and not any("w" in o for o in outcomes):
        raise InvalidInputError(f"no expert could be recovered: {reasons.pop()}")
