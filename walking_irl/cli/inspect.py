"""``walking-irl inspect``: what a recording holds."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from walking_irl.cpirl.summary import per_unit
from walking_irl.files import check_outputs, write_json


def add_parser(commands: Any) -> argparse.ArgumentParser:
    """The command's parser."""
    p: argparse.ArgumentParser = commands.add_parser("inspect", help="print what a recording holds")
    p.add_argument("file", type=Path, metavar="FILE.rrd")
    p.add_argument("--json", type=Path, metavar="FILE.json", help="write it as JSON, too")
    return p


def run(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl inspect``."""
    from walking_irl.recording.reader import inspect_recording

    check_outputs([args.json], inputs=[args.file])
    content = inspect_recording(args.file)
    if args.json is not None:
        write_json(args.json, content)
    if content["objectives"]:
        console.print(_table_of_recording(content))
    for key in (
        *("domain", "method", "seed", "centre", "mode", "status", "ending", "rule", "certificate"),
        *(
            "bracket",
            "how_sure",
            "volume_ratio",
            "condition_number",
            "weakest",
            "gauge",
            "noise",
            "loss",
        ),
    ):
        if content[key] is not None:
            console.print(f"{key.replace('_', ' ')}: {escape(_short(content[key]))}")
    if content["iterations"] is not None:
        console.print(f"iterations: {content['iterations']}")
    console.print(f"frames: {content['frames']}")
    console.print(f"timelines: {', '.join(content['timelines'])}")
    console.print(f"{len(content['entities'])} entities:")
    for entity in content["entities"]:
        console.print(f"  {escape(entity)}")
    return 0


def _table_of_recording(content: dict[str, Any]) -> Table:
    """Weights by objective, as far as they are known; one motion alone has its weights only."""
    truth, found, bounds = content["w_expert"], content["w"], content["intervals"]
    physical, is_run = content["physical_intervals"], content["iterations"] is not None
    columns: dict[str, list[str]] = {"objective": [str(name) for name in content["objectives"]]}
    if is_run:
        known = truth or ["unknown"] * len(columns["objective"])
        columns["ground truth"] = [w if isinstance(w, str) else f"{w:.4f}" for w in known]
    if found is not None:
        columns["recovered" if is_run else "weight"] = [f"{w:.4f}" for w in found]
    if bounds is not None:
        columns["interval"] = [f"{low:.4f} .. {high:.4f}" for low, high in bounds]
    if physical is not None:
        pairs = zip(physical, content["units"], strict=True)
        columns["per raw unit"] = [
            per_unit(bound, unit).replace(" per ", "\nper ") for bound, unit in pairs
        ]
    table = Table(*columns)
    for row in zip(*columns.values(), strict=True):
        table.add_row(*row)
    return table


def _short(value: Any) -> str:
    """A value of a recording, with few digits."""
    if isinstance(value, list):
        return ", ".join(_short(v) for v in value)
    return f"{value:.3g}" if isinstance(value, float) else str(value)
