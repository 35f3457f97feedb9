"""Tables 7.11 and 7.12: the walking humanoid, optimal and sub-optimal experts."""

from __future__ import annotations

from dataclasses import dataclass, replace

from walking_irl.experiments.rows import (
    SOLVER_NOTES,
    baseline_rows,
    centre_rows,
    dominance_rows,
)
from walking_irl.experiments.runner import Row, Runner
from walking_irl.experiments.table import Table
from walking_irl.experiments.tasks import Task

NOTES = (
    *SOLVER_NOTES,
    "The baselines' queries are mixed with 5 % equal weights: the gait of a vanishing weight is "
    "ill-defined. CPIRL's weights are at least .005, as in the main job.",
    "Every learner's solver starts from the demonstrated gait, and again from the best gait it "
    "knows where it ends worse than that.",
    "Experts are known exactly. The 3-D body has the rows of the analytic centre only: its "
    "solves take twice as long.",
)
SETTINGS = {"humanoid-planar": "planar, 14 joints", "humanoid": "3-D, 25 joints"}


@dataclass(frozen=True)
class Config:
    """Settings.

    Attributes:
        bodies: The first has all rows, others those of the analytic centre only.
        share: 1 % of |J_E|, as for the walking paths (thesis, section 7.3).
        max_solves: Budget of every method; a solve takes 1 to 4 seconds.
        seeds: Hidden experts per cell.
    """

    bodies: tuple[str, ...] = ("humanoid-planar", "humanoid")
    share: float = 0.01
    max_solves: int = 15
    seeds: int = 3


def _task(config: Config, domain: str, criterion: str) -> tuple[str, Task]:
    task = Task(domain, criterion=criterion, share=config.share, max_solves=config.max_solves)
    return SETTINGS[domain], task


def table_7_11(config: Config, runner: Runner) -> Table:
    """Centres and algorithms, optimal expert."""
    first, *others = config.bodies
    setting, task = _task(config, first, "return")
    rows = centre_rows(setting, task)
    rows += baseline_rows(setting, task, (config.max_solves,), is_finite=False)
    for body in others:
        rows += centre_rows(*_task(config, body, "return"), centres=("ac",))
    title = "humanoid, within 1 % of J_E, centres and algorithms"
    return runner.table("7.11", title, rows, config.seeds, NOTES)


def table_7_12(config: Config, runner: Runner) -> Table:
    """Centres and algorithms, sub-optimal expert."""
    first, *others = config.bodies
    setting, task = _task(config, first, "dominance")
    rows = dominance_rows(setting, task)
    rows += baseline_rows(setting, task, (config.max_solves,), is_finite=False)
    for body in others:
        setting, task = _task(config, body, "dominance")
        for label, arguments in (
            ("CPIRL-AC level, single policy", {"centre": "ac"}),
            ("CPIRL-AC level + Newton, single policy", {"centre": "ac", "has_newton": True}),
        ):
            rows.append(Row(setting, label, replace(task, arguments=arguments)))
    title = "humanoid, sub-optimal expert, mu >= mu_E, centres and algorithms"
    return runner.table("7.12", title, rows, config.seeds, NOTES)
