"""Tables of results: rows of plain values, written as Markdown, CSV, JSON and a picture."""

from __future__ import annotations

import csv
import io
import os
import platform
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.experiments.picture import solves_chart, steps_chart
from walking_irl.files import write_file, write_json
from walking_irl.versions import versions

COLUMNS = (
    "setting",
    "method",
    "time total [s]",
    "time in queries [s]",
    "solves",
    "success",
    "final |dw|",
    "final t_k",
    "final interval width",
)

ABBREVIATIONS = {
    "AC": "analytic centre",
    "CG": "centre of gravity",
    "MVIE": "centre of the largest inscribed ellipsoid",
    "CC": "Chebyshev centre",
    "MWAL": "multiplicative weights for apprenticeship learning (Syed and Schapire)",
    "LPAL": "linear program for apprenticeship learning (Syed, Bowling and Schapire)",
    "LQR": "linear-quadratic regulator",
    "MDP": "Markov decision process",
}


@dataclass(frozen=True)
class Table:
    """One table of the thesis.

    Attributes:
        name: "7.1" and so on.
        title: What is compared, and the criterion.
        columns: Headings.
        rows: Cells, already text; "n/a" carries its reason in ``notes``.
        notes: Sentences below the table.
        header: Seeds, versions and machine.
        raw: Outcomes behind the rows, for JSON.
        chart: The picture as SVG, where the columns are not the common ones.
    """

    name: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    header: dict[str, Any] = field(default_factory=dict)
    raw: tuple[dict[str, Any], ...] = ()
    chart: str = ""

    def to_markdown(self) -> str:
        """The table with its header and notes."""
        lines = [f"## Table {self.name}: {self.title}", ""]
        lines += [f"- {key}: {value}" for key, value in self.header.items()] + [""]
        lines += [_markdown(self.columns), "|" + " --- |" * len(self.columns)]
        lines += [_markdown(row) for row in self.rows]
        notes = [*self.notes, *spelt_out([self.title, *(c for row in self.rows for c in row)])]
        return "\n".join([*lines, "", *(f"- {note}" for note in notes), ""])

    def to_csv(self) -> str:
        """Columns and rows only."""
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows([self.columns, *self.rows])
        return text.getvalue()

    def picture(self) -> str:
        """The table's main figures as SVG."""
        if self.chart:
            return self.chart
        title = f"Table {self.name}: {self.title}"
        if self.columns != COLUMNS:
            return steps_chart(self.title, [row[:3] for row in self.rows])
        return solves_chart(title, [(*row[:2], *row[4:6]) for row in self.rows])

    def write(self, folder: Path) -> list[Path]:
        """Write ``table_<name>.md``, ``.csv``, ``.json`` and ``.svg``; returns their paths."""
        stem = folder / f"table_{self.name.replace('.', '_')}"
        paths = [stem.with_suffix(s) for s in (".md", ".csv", ".json", ".svg")]
        write_file(paths[0], self.to_markdown().encode())
        write_file(paths[1], self.to_csv().encode())
        content = {k: getattr(self, k) for k in ("name", "title", "columns", "rows", "notes")}
        write_json(paths[2], {**content, "header": self.header, "outcomes": list(self.raw)})
        write_file(paths[3], self.picture().encode())
        return paths


def spelt_out(texts: Sequence[str]) -> list[str]:
    """One note on the abbreviations in some texts, or none.

    >>> spelt_out(["CPIRL-AC, level"])
    ['AC: analytic centre']
    """
    words = set(re.findall(r"\w+", " ".join(texts)))
    known = [f"{short}: {long}" for short, long in ABBREVIATIONS.items() if short in words]
    return ["; ".join(known)] if known else []


def _markdown(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def machine() -> dict[str, Any]:
    """Versions and machine, for a table's header."""
    found = {k: v for k, v in versions().items() if k in ("walking-irl", "numpy", "scipy")}
    return {
        "versions": ", ".join(f"{k} {v}" for k, v in found.items()),
        "machine": f"{platform.machine()}, {os.cpu_count()} cores, Python "
        f"{platform.python_version()}",
    }


def summary(setting: str, method: str, outcomes: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    """One row of the common columns: means over seeds, solves with their standard error."""
    solves = np.array([o["solves"] for o in outcomes], dtype=float)
    error = solves.std(ddof=1) / np.sqrt(len(solves)) if len(solves) > 1 else float("nan")
    return (
        setting,
        method,
        _mean(outcomes, "seconds", ".3f"),
        _mean(outcomes, "query_seconds", ".3f"),
        _solves(solves, error),
        f"{sum(o['success'] for o in outcomes)}/{len(outcomes)}",
        _mean(outcomes, "dw", ".3f"),
        _mean(outcomes, "certificate", ".2e"),
        _mean(outcomes, "width", ".3f"),
    )


def _solves(solves: Array, error: float) -> str:
    if not solves.any():
        return "n/a"
    return f"{solves.mean():.1f} +- {error:.1f}" if len(solves) > 1 else f"{solves.mean():.1f}"


def _mean(outcomes: Sequence[dict[str, Any]], key: str, form: str) -> str:
    values = [o[key] for o in outcomes if o[key] is not None]
    return format(float(np.mean(values)), form) if values else "n/a"
