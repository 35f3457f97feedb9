"""Runs the tasks of a table, in parallel and resumably: each outcome is kept in a JSON file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Protocol

from walking_irl.experiments.table import COLUMNS, Table, machine, summary
from walking_irl.experiments.tasks import Task
from walking_irl.files import write_file
from walking_irl.versions import versions

Progress = Callable[[str, int, int], None]
"""Called with the table's name, tasks done, tasks in all."""


NOTES = (
    "Solves end with the first success, or with the method's own end or budget.",
    "Time in queries is all but the forward solves; for CPIRL it includes the weight intervals of "
    "every iteration, which no baseline computes.",
    "|dw| is that of CPIRL's estimate after the last solve (its next centre or Newton step); where "
    "there is no estimate, that of the last query.",
    "n/a in a column: the method has no such figure (signed weights are no estimate on the "
    "simplex; only CPIRL bounds weights; LPAL solves one program and no forward problem).",
)


@cache
def code_digest() -> str:
    """Digest of this package's sources: a cell is one of this code, or is run again."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parents[1].rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


class Job(Protocol):
    """A picklable piece of work for one seed; equal jobs have equal results but for the clock.

    One that takes much longer than others of its table says so by ``cost``, in seconds as a rough
    guess: the longest begin first, so that no core waits for them at the end.
    """

    def key(self) -> dict[str, Any]:
        """What is done, as JSON types; no two kinds of jobs may have equal keys."""
        ...

    def run(self) -> dict[str, Any]:
        """Do it: the outcome as JSON types."""
        ...


def run_job(job: Job) -> dict[str, Any]:
    """Do a job, in whatever process this is."""
    return job.run()


@dataclass(frozen=True)
class Row:
    """One row: its labels and the task to repeat over seeds; or why there is none."""

    setting: str
    method: str
    task: Task | None
    reason: str = ""


@dataclass(frozen=True)
class Runner:
    """Where and how tasks run.

    Attributes:
        executor: Runs seeds side by side; None runs them here, one after the other.
        cache: Folder of finished outcomes, or None.
        progress: Told of every finished task, or None.
    """

    executor: Executor | None = None
    cache: Path | None = None
    progress: Progress | None = None

    def table(
        self, name: str, title: str, rows: Sequence[Row], seeds: int, notes: Sequence[str] = ()
    ) -> Table:
        """Run every row over ``seeds`` seeds and summarise it."""
        tasks = [replace(r.task, seed=s) for r in rows if r.task for s in range(seeds)]
        outcomes = self.outcomes(name, tasks)
        lines, start = [], 0
        reasons = []
        for row in rows:
            if row.task is None:
                lines.append((row.setting, row.method, *["n/a"] * (len(COLUMNS) - 2)))
                reasons.append(f"n/a for {row.method} ({row.setting}): {row.reason}")
                continue
            part = outcomes[start : start + seeds]
            lines.append(summary(row.setting, row.method, part))
            errors = [o["error"] for o in part if o["error"]]
            if errors:
                label = f"{row.method} ({row.setting})"
                reasons.append(f"{label} failed on {len(errors)} seeds, first: {errors[0]}")
            start += seeds
        raw = tuple({**t.key(), **o} for t, o in zip(tasks, outcomes, strict=True))
        header = {"seeds": seeds, **machine()}
        return Table(name, title, COLUMNS, tuple(lines), (*NOTES, *notes, *reasons), header, raw)

    def outcomes(self, name: str, tasks: Sequence[Job]) -> list[dict[str, Any]]:
        """Outcome of each job, from the cache where it is there."""
        found = [self._cached(task) for task in tasks]
        missing = [i for i, outcome in enumerate(found) if outcome is None]
        n_done = len(tasks) - len(missing)
        for i, outcome in self._run(tasks, missing):
            found[i] = outcome
            self._keep(tasks[i], outcome)
            n_done += 1
            if self.progress is not None:
                self.progress(name, n_done, len(tasks))
        return [outcome for outcome in found if outcome is not None]

    def _run(self, tasks: Sequence[Job], missing: Sequence[int]) -> Any:
        if self.executor is None:
            return ((i, run_job(tasks[i])) for i in missing)
        longest_first = sorted(missing, key=lambda i: -getattr(tasks[i], "cost", 0.0))
        futures = {self.executor.submit(run_job, tasks[i]): i for i in longest_first}
        return ((futures[f], f.result()) for f in as_completed(futures))

    def _path(self, task: Job) -> Path | None:
        if self.cache is None:
            return None
        text = json.dumps([code_digest(), versions(), machine(), task.key()], sort_keys=True)
        return self.cache / f"{hashlib.sha256(text.encode()).hexdigest()[:24]}.json"

    def _cached(self, task: Job) -> dict[str, Any] | None:
        path = self._path(task)
        if path is None or not path.exists():
            return None
        try:
            outcome: dict[str, Any] = json.loads(path.read_text())
        except ValueError:  # damaged: it is run again
            return None
        return outcome

    def _keep(self, task: Job, outcome: dict[str, Any]) -> None:
        path = self._path(task)
        if path is None:
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, json.dumps(outcome).encode())
