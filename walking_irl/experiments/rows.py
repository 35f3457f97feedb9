"""Rows that several tables have: CPIRL with each centre, and the baselines."""

from __future__ import annotations

from dataclasses import replace

from walking_irl.experiments.runner import Row
from walking_irl.experiments.tasks import Task

CENTRES = ("ac", "cg", "mvie", "cc")
SOLVER_NOTES = (
    "Projection and max-margin query w >= 0 only (one-sided distance): the solver needs it.",
    "MWAL is told the largest |mu - mu_E| over the corners of the simplex (K solves that are not "
    "counted) and T, its number of rounds, which sets the size of its steps.",
)
"""What the baselines are told where the solver takes weights of the simplex only."""


def centre_rows(setting: str, task: Task, centres: tuple[str, ...] = CENTRES) -> list[Row]:
    """CPIRL with each centre by cuts alone, and with Newton steps."""
    rows = [
        Row(setting, f"CPIRL-{c.upper()}", replace(task, arguments={"centre": c})) for c in centres
    ]
    newton = replace(task, arguments={"centre": "ac", "has_newton": True})
    return [*rows, Row(setting, "CPIRL-AC + Newton", newton)]


def dominance_rows(setting: str, task: Task, centres: tuple[str, ...] = CENTRES) -> list[Row]:
    """A dominating policy by levels, a dominating mixture, Algorithm 3; and with Newton steps."""
    rows = []
    for c in centres:
        level = replace(task, arguments={"centre": c})
        label = f"CPIRL-{c.upper()}"
        rows.append(Row(setting, f"{label} level, single policy", level))
        rows.append(Row(setting, f"{label} level, mixture", replace(level, scored="mixture")))
        rows.append(Row(setting, f"{label} Algorithm 3", replace(level, method="utopia")))
    newton = replace(task, arguments={"centre": "ac", "has_newton": True})
    return [*rows, Row(setting, "CPIRL-AC level + Newton, single policy", newton)]


def level_rows(setting: str, task: Task) -> list[Row]:
    """The analytic centre's levels: a dominating policy, and a dominating mixture."""
    level = replace(task, arguments={"centre": "ac"})
    return [
        Row(setting, "CPIRL-AC level, single policy", level),
        Row(setting, "CPIRL-AC level, mixture", replace(level, scored="mixture")),
    ]


def baseline_rows(
    setting: str, task: Task, mwal_rounds: tuple[int, ...], is_finite: bool
) -> list[Row]:
    """Rows of the baselines; mixture and last policy are scored apart."""
    jobs = [("mwal", f"MWAL T={T}", T) for T in mwal_rounds]
    jobs += [("projection", "Projection", task.max_solves)]
    jobs += [("max-margin", "Max-margin", task.max_solves)]
    rows = []
    for method, label, max_solves in jobs:
        for scored in ("mixture", "last"):
            job = replace(task, method=method, scored=scored, max_solves=max_solves, arguments={})
            rows.append(Row(setting, f"{label}, {scored}", job))
    lpal = replace(task, method="lpal", scored="mixture", arguments={}) if is_finite else None
    rows.append(Row(setting, "LPAL (one program)", lpal, "LPAL needs a finite MDP"))
    return rows
