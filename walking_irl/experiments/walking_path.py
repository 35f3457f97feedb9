"""Tables 7.7 to 7.10: human walking paths, optimal and sub-optimal experts."""

from __future__ import annotations

from dataclasses import dataclass, replace

from walking_irl.experiments.rows import (
    SOLVER_NOTES,
    baseline_rows,
    centre_rows,
    dominance_rows,
    level_rows,
)
from walking_irl.experiments.runner import Row, Runner
from walking_irl.experiments.table import Table
from walking_irl.experiments.tasks import Task

NOTES = (
    *SOLVER_NOTES,
    "The baselines' queries are mixed with 5 % equal weights: where a term costs nothing, "
    "accelerations stick to their bounds.",
)


@dataclass(frozen=True)
class Config:
    """Settings.

    Attributes:
        n_intervals: N of the path model; 20 costs a third of 40 and moves J by 1e-3.
        share: 1 % of |J_E| (thesis, section 7.3).
        max_solves: Budget of CPIRL and of all baselines but MWAL.
        mwal_rounds: Numbers T of MWAL's rounds, fixed in advance, each a row; small, for a solve
            takes a third of a second.
        seeds: Hidden experts per cell.
    """

    n_intervals: int = 20
    share: float = 0.01
    max_solves: int = 20
    mwal_rounds: tuple[int, ...] = (10, 30)
    seeds: int = 3


def _task(config: Config, criterion: str) -> tuple[str, Task]:
    task = Task(
        "walking-path",
        {"n_intervals": config.n_intervals},
        criterion=criterion,
        share=config.share,
        max_solves=config.max_solves,
    )
    return f"4 goals, N={config.n_intervals}", task


def table_7_7(config: Config, runner: Runner) -> Table:
    """Centres, optimal expert."""
    rows = centre_rows(*_task(config, "return"))
    return runner.table("7.7", "walking path, within 1 % of J_E, centres", rows, config.seeds)


def table_7_8(config: Config, runner: Runner) -> Table:
    """Algorithms, optimal expert."""
    setting, task = _task(config, "return")
    rows = [Row(setting, "CPIRL-AC", replace(task, arguments={"centre": "ac"}))]
    rows += baseline_rows(setting, task, config.mwal_rounds, is_finite=False)
    title = "walking path, within 1 % of J_E, algorithms"
    return runner.table("7.8", title, rows, config.seeds, NOTES)


def table_7_9(config: Config, runner: Runner) -> Table:
    """Centres, sub-optimal expert."""
    rows = dominance_rows(*_task(config, "dominance"))
    title = "walking path, sub-optimal expert, mu >= mu_E, centres"
    return runner.table("7.9", title, rows, config.seeds)


def table_7_10(config: Config, runner: Runner) -> Table:
    """Algorithms, sub-optimal expert."""
    setting, task = _task(config, "dominance")
    rows = level_rows(setting, task)
    rows += baseline_rows(setting, task, config.mwal_rounds, is_finite=False)
    title = "walking path, sub-optimal expert, mu >= mu_E, algorithms"
    return runner.table("7.10", title, rows, config.seeds, NOTES)
