"""``walking-irl tables``: the experiments, as files."""

from __future__ import annotations

import argparse

from rich.console import Console
from rich.markup import escape

from walking_irl.cli import DONE, INTERRUPTED
from walking_irl.run.session import workers


def run(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl tables``."""
    from walking_irl.experiments import run_tables

    def progress(name: str, done: int, total: int) -> None:
        if not args.quiet:
            console.print(f"table {name}: {done} of {total} runs")

    try:
        with workers() as executor:
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
