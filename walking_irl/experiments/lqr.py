"""Tables 7.3 to 7.6: the linear-quadratic regulator, optimal and sub-optimal experts."""

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


@dataclass(frozen=True)
class Config:
    """Settings.

    Attributes:
        sizes: Numbers of axes, as in the authors' toolbox and beyond.
        share: 2 % of |J_E| (thesis, section 7.2).
        perturbation: Relative error of a sub-optimal expert's gains (the thesis's is unknown).
        least_advantage: By how much some policy must beat a sub-optimal expert in every feature,
            relative to its mean |feature|: about half of all perturbed experts are optimal for
            other weights, within this, and no single policy clearly dominates those.
        max_solves: Budget of CPIRL and of all baselines but MWAL.
        mwal_rounds: Numbers T of MWAL's rounds, fixed in advance, each a row.
        seeds: Hidden experts per cell.
    """

    sizes: tuple[int, ...] = (2, 3, 5, 8)
    share: float = 0.02
    perturbation: float = 0.25
    least_advantage: float = 0.002
    max_solves: int = 60
    mwal_rounds: tuple[int, ...] = (20, 200)
    seeds: int = 10


def _tasks(config: Config, criterion: str) -> list[tuple[str, Task]]:
    is_poor = criterion == "dominance"
    return [
        (
            f"n={n}",
            Task(
                "lqr",
                {"n_objectives": n, "perturbation": config.perturbation if is_poor else 0.0},
                criterion=criterion,
                share=config.share,
                max_solves=config.max_solves,
                least_advantage=config.least_advantage if is_poor else 0.0,
            ),
        )
        for n in config.sizes
    ]


def _every_draw(setting: str, task: Task) -> list[Row]:
    """The same for every expert drawn: those who are nearly optimal, too."""
    every = replace(task, least_advantage=0.0)
    return dominance_rows(f"{setting}, every draw", every, ("ac",))


def _with_draws(table: Table) -> Table:
    """The table, with a note on how many experts were drawn."""
    drawn = {}
    for run in table.raw:
        if run["least_advantage"] > 0.0:
            drawn[run["options"]["n_objectives"], run["seed"]] = run["drawn"]
    counts = [
        f"{sum(d for (m, _), d in drawn.items() if m == n)} for n={n}"
        for n in sorted({n for n, _ in drawn})
    ]
    note = f"Experts drawn until enough were clearly sub-optimal: {', '.join(counts)}."
    return replace(table, notes=(*table.notes, note))


def table_7_3(config: Config, runner: Runner) -> Table:
    """Centres, optimal expert."""
    rows = [row for job in _tasks(config, "return") for row in centre_rows(*job)]
    return runner.table("7.3", "LQR, within 2 % of J_E, centres", rows, config.seeds)


def table_7_4(config: Config, runner: Runner) -> Table:
    """Algorithms, optimal expert."""
    rows = []
    for setting, task in _tasks(config, "return"):
        rows.append(Row(setting, "CPIRL-AC", replace(task, arguments={"centre": "ac"})))
        rows += baseline_rows(setting, task, config.mwal_rounds, is_finite=False)
    return runner.table(
        "7.4", "LQR, within 2 % of J_E, algorithms", rows, config.seeds, SOLVER_NOTES
    )


def table_7_5(config: Config, runner: Runner) -> Table:
    """Centres, sub-optimal expert."""
    rows = []
    for setting, task in _tasks(config, "dominance"):
        rows += dominance_rows(setting, task)
        rows += _every_draw(setting, task)
    title = "LQR, sub-optimal expert, mu >= mu_E, centres"
    return _with_draws(runner.table("7.5", title, rows, config.seeds))


def table_7_6(config: Config, runner: Runner) -> Table:
    """Algorithms, sub-optimal expert."""
    rows = []
    for setting, task in _tasks(config, "dominance"):
        rows += level_rows(setting, task)
        rows += baseline_rows(setting, task, config.mwal_rounds, is_finite=False)
    title = "LQR, sub-optimal expert, mu >= mu_E, algorithms"
    return _with_draws(runner.table("7.6", title, rows, config.seeds, SOLVER_NOTES))
