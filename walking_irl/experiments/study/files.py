"""A study's result as Markdown, CSV, JSON and a picture."""

from __future__ import annotations

import csv
import io
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from walking_irl.experiments.runner import code_digest
from walking_irl.experiments.study.command import flags_of
from walking_irl.experiments.study.coverage import Share
from walking_irl.experiments.study.picture import calibration_picture
from walking_irl.experiments.study.result import Result
from walking_irl.experiments.table import machine
from walking_irl.files import write_file, write_json

NOTES = (
    "Inside: the ground-truth weight lies in its interval; those of an expert are to hold all its "
    "weights at once at 95 %. An expert that could not be "
    "recovered counts among the experts, as not inside.",
    "Shares have 95 % intervals by Clopper and Pearson; where the weights of all experts are taken "
    "together, an expert counts once, for its weights share their errors.",
    "Nominal levels are those of one weight: the part of a half width that comes from noise is "
    "scaled by the quantiles of Student's t; that of an expert's possible sub-optimality, and so "
    "all of an exact expert's, is the same at every level.",
    "Beyond half: truths farther from the recovered weight than half of the half width, on their "
    "side. Next to none would mean that intervals are wider than they need be.",
    "Vouched for: without the part from sub-optimality, as --expert-gap 0 has it.",
    "CPU seconds are those of one process, its expert included; machines differ.",
)
NOTHING = "n/a"
"""A figure of no values."""


def write_study(result: Result, folder: Path) -> list[Path]:
    """Write ``study.md``, ``.csv``, ``.json`` and ``.svg``; returns their paths.

    Raises:
        InvalidInputError: If a file cannot be written.
    """
    paths = [folder / f"study{ending}" for ending in (".md", ".csv", ".json", ".svg")]
    write_file(paths[0], to_markdown(result).encode())
    write_file(paths[1], to_csv(result).encode())
    write_json(paths[2], to_json(result))
    write_file(paths[3], calibration_picture(result).encode())
    return paths


def study_command(result: Result) -> str:
    """The command that runs the study again."""
    words = ["walking-irl", "study", *flags_of(result.setup), "--experts", str(result.n)]
    return shlex.join([*words, "--seed", str(result.setup.seed)])


def figures(result: Result) -> list[tuple[str, str]]:
    """The main figures, in words; those that this study has."""
    n_inside, experts = int(result.scored.inside.all(axis=1).sum()), in_words(result.experts_inside)
    spread = {name: _spread(values) for name, values in result.spreads.items()}
    lines = [
        ("experts with every weight inside", f"{n_inside} of {result.n}: {experts}"),
        ("weights inside", in_words(result.weights_inside)),
        ("truths beyond half of the half width", in_words(result.beyond_half)),
        ("experts inside, if each is vouched for", in_words(result.inside_if_vouched)),
        ("truths beyond half, if so", in_words(result.beyond_half_if_vouched)),
        ("runs that end with an answer", in_words(result.successes)),
        *((f"{name}: median, 90 %, largest", text) for name, text in spread.items()),
    ]
    return [(name, text) for name, text in lines if text != NOTHING]


def in_words(share: Share) -> str:
    """A share and its interval.

    >>> in_words(Share(0.97, 0.9148, 0.9938))
    '97.0 % (91.5 - 99.4)'
    """
    if share.value != share.value:
        return NOTHING
    return f"{100 * share.value:.1f} % ({100 * share.low:.1f} - {100 * share.high:.1f})"


def to_markdown(result: Result) -> str:
    """The tables with a header and notes."""
    first = result.setup.seed
    title = f"Study: {result.n} experts of {result.setup.domain}"
    about = {
        "command": f"`{study_command(result)}`",
        "seeds": f"{first} to {first + result.n - 1}",
        **machine(),
        "code": code_digest()[:12],
    }
    weights = [
        (w.objective, in_words(w.inside), _spread(w.errors), _spread(w.half_widths),
         in_words(w.beyond_half))
        for w in result.weights
    ]  # fmt: skip
    parts = [
        [f"## {title}", "", *(f"- {key}: {value}" for key, value in about.items())],
        _table(("figure", "value"), figures(result)),
        _table(("objective", "inside", "error", "half width", "beyond half"), weights),
        _table(
            ("nominal level", "measured"),
            [(f"{100 * level:g} %", in_words(s)) for level, s in result.calibration.items()],
        ),
        _table(("ending", "experts", "e.g."), [(e, str(n), t) for e, n, t in result.endings]),
        _table(
            ("worst", "why", "repeat it"),
            [(f"seed {w.seed}", w.what, f"`{w.command}`") for w in result.worst],
        ),
        [f"- {note}" for note in NOTES],
    ]
    return "\n\n".join("\n".join(part) for part in parts) + "\n"


def to_csv(result: Result) -> str:
    """One row for each expert: its weights, what was recovered of them, and how the run ended."""
    common = ("seed", "ending", "solves", "probes", "l1_error", "loss", "seconds", "cpu_seconds")
    names = [f"{what} {o}" for o in result.objectives for what in ("true", "w", "low", "high")]
    rows: list[list[Any]] = [[*common, "error", *names]]
    for o in result.outcomes:
        row = [o.get(name) for name in (*common, "error")]
        for j in range(len(result.objectives) if "w" in o else 0):
            row += [o["w_expert"][j], o["w"][j], *o["intervals"][j]]
        rows.append(row)
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def to_json(result: Result) -> dict[str, Any]:
    """All figures, and the outcomes behind them."""
    return {
        "command": study_command(result),
        "experts": result.n,
        "seed": result.setup.seed,
        **machine(),
        "code": code_digest(),
        "experts_inside": result.experts_inside._asdict(),
        "weights_inside": result.weights_inside._asdict(),
        "beyond_half": result.beyond_half._asdict(),
        "experts_inside_if_vouched": result.inside_if_vouched._asdict(),
        "beyond_half_if_vouched": result.beyond_half_if_vouched._asdict(),
        "successes": result.successes._asdict(),
        "quantiles": {"levels": [0.5, 0.9, 1.0], **result.spreads},
        "weights": [
            {k: v._asdict() if isinstance(v, Share) else v for k, v in w._asdict().items()}
            for w in result.weights
        ],
        "calibration": {str(level): s._asdict() for level, s in result.calibration.items()},
        "endings": [dict(zip(("ending", "n", "example"), e, strict=True)) for e in result.endings],
        "worst": [w._asdict() for w in result.worst],
        "outcomes": list(result.outcomes),
    }


def _spread(values: Sequence[float]) -> str:
    return ", ".join(f"{v:.3g}" for v in values) if values else NOTHING


def _table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    lines = [columns, ["---"] * len(columns), *rows]
    return ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in lines]
