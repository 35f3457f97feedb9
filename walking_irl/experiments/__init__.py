"""Experiments: the thesis's tables 2.1, 3.1, 7.1 to 7.10 and figure 7.1, and the humanoid's."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any

from walking_irl.errors import InvalidInputError
from walking_irl.experiments import (
    forward_methods,
    gridworld,
    humanoid,
    inverse_optimal_control,
    irl_continuous,
    irl_methods,
    lqr,
    walking_path,
)
from walking_irl.experiments.runner import Progress, Runner
from walking_irl.experiments.table import Table

__all__ = ["TABLES", "run", "run_tables"]

TABLES: dict[str, tuple[Callable[[Any, Runner], Table], Any]] = {
    "2.1": (forward_methods.table_2_1, forward_methods.Config()),
    "3.1a": (irl_methods.table_3_1a, irl_methods.Listing()),
    "3.1b": (irl_methods.table_3_1b, irl_methods.Config()),
    "3.1c": (irl_continuous.table_3_1c, irl_continuous.Config()),
    "7.1": (gridworld.table_7_1, gridworld.Config()),
    "fig7.1": (gridworld.figure_7_1, gridworld.Config()),
    "7.2": (gridworld.table_7_2, gridworld.Config()),
    "7.3": (lqr.table_7_3, lqr.Config()),
    "7.4": (lqr.table_7_4, lqr.Config()),
    "7.5": (lqr.table_7_5, lqr.Config()),
    "7.6": (lqr.table_7_6, lqr.Config()),
    "7.7": (walking_path.table_7_7, walking_path.Config()),
    "7.8": (walking_path.table_7_8, walking_path.Config()),
    "7.9": (walking_path.table_7_9, walking_path.Config()),
    "7.10": (walking_path.table_7_10, walking_path.Config()),
    "7.11": (humanoid.table_7_11, humanoid.Config()),
    "7.12": (humanoid.table_7_12, humanoid.Config()),
    "7.13": (inverse_optimal_control.table_7_13, inverse_optimal_control.Config()),
}
"""What makes each table, and its default settings."""
GROUPS = {"3.1": ("3.1a", "3.1b", "3.1c")}
"""Names that stand for several tables."""


def run(
    name: str,
    config: Any = None,
    executor: Executor | None = None,
    *,
    cache: Path | None = None,
    progress: Progress | None = None,
) -> Table:
    """One table with given or default settings.

    Raises:
        InvalidInputError: If there is no such table.
    """
    if name not in TABLES:
        raise InvalidInputError(f"unknown table {name!r}; choose from {', '.join(TABLES)} or all")
    make, default = TABLES[name]
    return make(config if config is not None else default, Runner(executor, cache, progress))


def run_tables(
    names: Sequence[str],
    *,
    seeds: int | None = None,
    out: Path,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> list[Path]:
    """Write tables as Markdown, CSV, JSON and SVG; finished cells are kept in ``out/cells``.

    Args:
        names: Names of :data:`TABLES` or :data:`GROUPS`, or "all".
        seeds: Hidden experts per cell, instead of each table's default.
        out: Folder for the results; made if it is missing.
        executor: Runs seeds side by side, e.g. a process pool.
        progress: Called with the table's name, tasks done and tasks in all.

    Returns:
        Paths of the files written, table by table.

    Raises:
        InvalidInputError: If a name is unknown or ``seeds`` below 1.
    """
    given = [part for name in names for part in GROUPS.get(name, (name,))]
    chosen = list(TABLES) if "all" in given else list(dict.fromkeys(given))
    for name in given:
        if name not in (*TABLES, "all"):
            choices = f"{', '.join(TABLES)} or all"
            raise InvalidInputError(f"unknown table {name!r}; choose from {choices}")
    if seeds is not None and seeds < 1:
        raise InvalidInputError(f"seeds must be at least 1, got {seeds}")
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInputError(f"cannot write to {out}: {error.strerror or error}") from error
    paths: list[Path] = []
    for name in chosen:
        config = TABLES[name][1]
        config = config if seeds is None else replace(config, seeds=seeds)
        table = run(name, config, executor, cache=out / "cells", progress=progress)
        paths += table.write(out)
    return paths
