"""Tables 7.1 and 7.2 and figure 7.1: the gridworld, J >= .99 J_E."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from walking_irl.experiments.rows import CENTRES, baseline_rows
from walking_irl.experiments.runner import Row, Runner
from walking_irl.experiments.table import Table, machine
from walking_irl.experiments.tasks import Task

Grid = tuple[int, int, float, str]

LARGE_CENTRES = ("ac", "mvie", "cc")
NO_SAMPLES = "hit-and-run in 63 dimensions is not accurate enough to be called a centre of gravity"
GAUGE = (
    "Macro-cells tile the grid: all features sum to a constant, weights are known only up to "
    "w -> a w + (1 - a)/K, and |dw| says little.",
)


@dataclass(frozen=True)
class Config:
    """Settings; the thesis's own grid sizes are unknown.

    Attributes:
        grids: (size, macro-cells along a side, discount, variant): K = 9 and 16 on the grids
            proposed in place of the thesis's; discount .9 as in its code, .99 from Abbeel & Ng
            2004, whose regions tile the grid ("macro").
        large: Further grids for the centres only.
        share: Relative loss that counts as success: 1 % (thesis, section 7.1).
        max_solves: Budget of CPIRL and of all baselines but MWAL.
        mwal_rounds: Numbers T of MWAL's rounds, fixed in advance (Syed & Schapire 2007), each a
            row.
        samples: Sample counts of the centre of gravity, 50 to 5000 (thesis, figure 7.1).
        seeds: Hidden experts per cell.
    """

    grids: tuple[Grid, ...] = (
        (16, 3, 0.9, "patches"),
        (16, 4, 0.9, "patches"),
        (32, 4, 0.99, "patches"),
        (16, 3, 0.9, "macro"),
    )
    large: tuple[Grid, ...] = ((64, 8, 0.99, "patches"),)
    share: float = 0.01
    max_solves: int = 60
    mwal_rounds: tuple[int, ...] = (20, 200)
    samples: tuple[int, ...] = (50, 100, 250, 500, 1000, 2500, 5000)
    seeds: int = 20


def _task(config: Config, size: int, cells: int, discount: float, variant: str) -> tuple[str, Task]:
    options = {"size": size, "cells": cells, "discount": discount, "variant": variant}
    task = Task("gridworld", options, share=config.share, max_solves=config.max_solves)
    tiles = ", macro-cells" if variant == "macro" else ""
    return f"{size}x{size}, K={cells**2}, gamma={discount:g}{tiles}", task


def table_7_1(config: Config, runner: Runner) -> Table:
    """Centres of CPIRL, and Kelley's cutting planes."""
    rows = []
    for grid in config.grids:
        setting, task = _task(config, *grid)
        for centre in CENTRES:
            method = replace(task, arguments={"centre": centre})
            rows.append(Row(setting, f"CPIRL-{centre.upper()}", method))
        rows.append(Row(setting, "Kelley LP, last", replace(task, method="kelley")))
    for grid in config.large:
        setting, task = _task(config, *grid)
        for centre in LARGE_CENTRES:
            method = replace(task, arguments={"centre": centre})
            rows.append(Row(setting, f"CPIRL-{centre.upper()}", method))
        rows.append(Row(setting, "CPIRL-CG", None, NO_SAMPLES))
    return runner.table("7.1", "gridworld, J >= .99 J_E, centres", rows, config.seeds, GAUGE)


def table_7_2(config: Config, runner: Runner) -> Table:
    """CPIRL's analytic centre beside the baselines."""
    rows = []
    for grid in config.grids:
        setting, task = _task(config, *grid)
        rows.append(Row(setting, "CPIRL-AC", replace(task, arguments={"centre": "ac"})))
        rows += baseline_rows(setting, task, config.mwal_rounds, is_finite=True)
    return runner.table("7.2", "gridworld, J >= .99 J_E, algorithms", rows, config.seeds, GAUGE)


def figure_7_1(config: Config, runner: Runner) -> Table:
    """Steps of the sampled centre of gravity against the number of samples."""
    setting, task = _task(config, *max(config.grids, key=lambda grid: grid[1]))
    lines, raw = [], []
    for n in config.samples:
        job = replace(task, method="samples", arguments={"n_samples": n})
        jobs = [replace(job, seed=s) for s in range(config.seeds)]
        outcomes: list[dict[str, Any]] = runner.outcomes("fig7.1", jobs)
        steps = np.array([o["solves"] for o in outcomes], dtype=float)
        spread = steps.std(ddof=1) if len(steps) > 1 else 0.0
        success = sum(o["success"] for o in outcomes)
        seconds = np.mean([o["query_seconds"] for o in outcomes])
        line = (str(n), f"{steps.mean():.2f}", f"{spread:.2f}", f"{success}/{len(steps)}")
        lines.append((*line, f"{seconds:.3f}"))
        raw += [{**j.key(), **o} for j, o in zip(jobs, outcomes, strict=True)]
    columns = ("samples", "steps, mean", "steps, s.d.", "success", "time in queries [s]")
    header = {"seeds": config.seeds, **machine()}
    title = f"steps of CPIRL-CG against samples, gridworld {setting}"
    return Table("fig7.1", title, columns, tuple(lines), (), header, tuple(raw))
