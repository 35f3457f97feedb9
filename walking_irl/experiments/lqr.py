"""Tables 7.3 to 7.6: the linear-quadratic regulator, optimal and sub-optimal experts."""

from __future__ import annotations

from dataclasses import dataclass, replace

from walking_irl.experiments.gridworld import CENTRES, rivals
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
        max_solves: Budget of CPIRL and of all rivals but MWAL.
        mwal_rounds: T of MWAL, fixed in advance.
        seeds: Hidden experts per cell.
    """

    sizes: tuple[int, ...] = (2, 3, 5, 8)
    share: float = 0.02
    perturbation: float = 0.25
    max_solves: int = 60
    mwal_rounds: int = 200
    seeds: int = 10


def _tasks(config: Config, criterion: str) -> list[tuple[str, Task]]:
    spread = config.perturbation if criterion == "dominance" else 0.0
    return [
        (
            f"n={n}",
            Task(
                "lqr",
                {"n_objectives": n, "perturbation": spread},
                criterion=criterion,
                share=config.share,
                max_solves=config.max_solves,
            ),
        )
        for n in config.sizes
    ]


def centre_rows(setting: str, task: Task, centres: tuple[str, ...] = CENTRES) -> list[Row]:
    """CPIRL with each centre by cuts alone, and with Newton steps."""
    rows = [
        Row(setting, f"CPIRL-{c.upper()}", replace(task, arguments={"centre": c})) for c in centres
    ]
    newton = replace(task, arguments={"centre": "ac", "has_newton": True})
    return [*rows, Row(setting, "CPIRL-AC + Newton", newton)]


def dominance_rows(setting: str, task: Task, centres: tuple[str, ...] = CENTRES) -> list[Row]:
    """A single dominating policy by levels and by Algorithm 3; a dominating mixture."""
    rows = []
    for c in centres:
        level = replace(task, arguments={"centre": c})
        label = f"CPIRL-{c.upper()}"
        rows.append(Row(setting, f"{label} level, single policy", level))
        rows.append(Row(setting, f"{label} level, mixture", replace(level, scored="mixture")))
        rows.append(Row(setting, f"{label} Algorithm 3", replace(level, method="utopia")))
    return rows


def table_7_3(config: Config, runner: Runner) -> Table:
    """Centres, optimal expert."""
    rows = [row for job in _tasks(config, "return") for row in centre_rows(*job)]
    return runner.table("7.3", "LQR, within 2 % of J_E, centres", rows, config.seeds)


def table_7_4(config: Config, runner: Runner) -> Table:
    """Algorithms, optimal expert."""
    rows = []
    for setting, task in _tasks(config, "return"):
        rows.append(Row(setting, "CPIRL-AC", replace(task, arguments={"centre": "ac"})))
        rows += rivals(setting, task, config.mwal_rounds, is_finite=False)
    return runner.table("7.4", "LQR, within 2 % of J_E, algorithms", rows, config.seeds, NOTES)


def table_7_5(config: Config, runner: Runner) -> Table:
    """Centres, sub-optimal expert."""
    rows = [row for job in _tasks(config, "dominance") for row in dominance_rows(*job)]
    return runner.table("7.5", "LQR, sub-optimal expert, mu >= mu_E, centres", rows, config.seeds)


def table_7_6(config: Config, runner: Runner) -> Table:
    """Algorithms, sub-optimal expert."""
    rows = []
    for setting, task in _tasks(config, "dominance"):
        level = replace(task, arguments={"centre": "ac"})
        rows.append(Row(setting, "CPIRL-AC level, single policy", level))
        rows.append(Row(setting, "CPIRL-AC level, mixture", replace(level, scored="mixture")))
        rows += rivals(setting, task, config.mwal_rounds, is_finite=False)
    title = "LQR, sub-optimal expert, mu >= mu_E, algorithms"
    return runner.table("7.6", title, rows, config.seeds, NOTES)


NOTES = (
    "Projection and max-margin query w >= 0 only (one-sided distance): the solver needs it.",
    "MWAL's span is twice the largest |mu - mu_E| over the corners of the simplex.",
)
