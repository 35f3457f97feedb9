"""``walking-irl tables``: the experiments, as files."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape

from walking_irl.cli import DONE, INTERRUPTED
from walking_irl.cli.side_by_side import add_scheduler, side_by_side
from walking_irl.workers import interrupts_kept


def add_parser(commands: Any) -> argparse.ArgumentParser:
    """The command's parser."""
    p: argparse.ArgumentParser = commands.add_parser(
        "tables", help="regenerate the thesis's tables and more"
    )
    p.add_argument(
        "names", nargs="+", metavar="TABLE", help="2.1, 3.1, 7.1 ... 7.13, fig7.1, or all"
    )
    p.add_argument("--seeds", type=int, help="experts per cell")
    add_scheduler(p)
    p.add_argument("--out", type=Path, default=Path("tables"), help="folder (%(default)s)")
    p.add_argument("--quiet", action="store_true", help="print the files' names only")
    return p


def run(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl tables``."""
    from walking_irl.experiments import run_tables

    def progress(name: str, done: int, total: int) -> None:
        if not args.quiet:
            console.print(f"table {name}: {done} of {total} runs")

    try:
        with interrupts_kept(), side_by_side(args.scheduler) as executor:
            paths = run_tables(
                args.names, seeds=args.seeds, out=args.out, executor=executor, progress=progress
            )
    except KeyboardInterrupt:
        console.print(
            f"interrupted; finished runs are kept in {escape(str(args.out / 'cells'))}: the same "
            "command goes on from there"
        )
        return INTERRUPTED
    for path in paths:
        console.print(escape(str(path)))
    return DONE
