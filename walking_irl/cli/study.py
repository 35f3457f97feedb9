"""``walking-irl study``: many experts of one kind, recovered, and how often intervals are right."""

from __future__ import annotations

import argparse
from dataclasses import fields
from pathlib import Path
from typing import Any, get_type_hints

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from walking_irl.cli import DONE, INTERRUPTED
from walking_irl.cli.counted import Counted
from walking_irl.cli.recover import known_options
from walking_irl.cli.side_by_side import add_scheduler, side_by_side
from walking_irl.domains import DOMAINS
from walking_irl.domains.contract import EXPERTS
from walking_irl.errors import InvalidInputError
from walking_irl.geometry.centres import CENTRES
from walking_irl.run.setup import Setup
from walking_irl.types import MODES
from walking_irl.workers import interrupts_kept

MEANINGS = {
    "domain": f"{', '.join(DOMAINS)} ({Setup.domain})",
    "centre": f"query point: {', '.join(CENTRES)} ({Setup.centre})",
    "mode": f"{', '.join(MODES)} ({Setup.mode}; minimise for suboptimal experts)",
    "seed": f"of the first expert; the others have those that follow ({Setup.seed})",
    "expert": f"{' or '.join(EXPERTS)}: known exactly ({Setup.expert})",
    "max_solves": "budget of forward solves an expert (the domain's)",
}
"""What a study says of the settings that it shares with ``recover``."""
EXPERT_FILES = ("weights", "options", "demonstration", "record", "checkpoint")
"""Fields of a setup that a study has no flag for."""


def add_parser(commands: Any) -> argparse.ArgumentParser:
    """The command's parser; settings are those of ``recover``, by the same names."""
    p: argparse.ArgumentParser = commands.add_parser(
        "study", help="recover many experts: how often are the intervals right, how wide are they?"
    )
    p.add_argument("--experts", type=int, default=100, help="how many (%(default)s)")
    who = p.add_argument_group("who walks, and how it is recovered", "as recover has them")
    hints = get_type_hints(Setup)
    for field in fields(Setup):
        if field.name not in EXPERT_FILES:
            kind = next(t for t in (int, float, str) if t in _kinds(hints[field.name]))
            who.add_argument(
                _flag(field.name),
                type=kind,
                default=argparse.SUPPRESS,
                help=MEANINGS.get(field.name, "see walking-irl recover --help"),
            )
    for name, option in known_options().items():
        who.add_argument(
            _flag(name),
            dest=f"option_{name}",
            type=type(option.default),
            metavar=name.upper(),
            default=argparse.SUPPRESS,
            help=option.meaning,
        )
    out = p.add_argument_group("where it runs, and output")
    add_scheduler(out)
    out.add_argument("--out", type=Path, default=Path("study"), help="folder (%(default)s)")
    out.add_argument("--quiet", action="store_true", help="print the files' names only")
    return p


def run(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl study``."""
    from walking_irl.experiments.study import Study, run_study
    from walking_irl.experiments.study.files import write_study

    study = Study(_setup(args), args.experts)
    _make(args.out)
    cells = args.out / "cells"
    with Counted(console, "experts", args.quiet) as progress:
        try:
            with interrupts_kept(), side_by_side(args.scheduler) as executor:
                result = run_study(study, cells=cells, executor=executor, progress=progress)
        except KeyboardInterrupt:
            console.print(
                f"interrupted; finished experts are kept in {escape(str(cells))}: the same command "
                "goes on from there"
            )
            return INTERRUPTED
    paths = write_study(result, args.out)
    if not args.quiet:
        _show(result, console)
    for path in paths:
        console.print(escape(str(path)))
    return DONE


def _setup(args: argparse.Namespace) -> Setup:
    names = [f.name for f in fields(Setup)]
    given = {name: getattr(args, name) for name in names if hasattr(args, name)}
    if given.get("expert") == "suboptimal":
        given.setdefault("mode", "minimise")
    options = {
        name: getattr(args, f"option_{name}")
        for name in known_options()
        if hasattr(args, f"option_{name}")
    }
    return Setup(**given, options=options)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInputError(f"cannot write to {folder}: {error.strerror or error}") from error


def _show(result: Any, console: Console) -> None:
    from walking_irl.experiments.study.files import figures

    table = Table(title=f"{result.n} experts of {result.setup.domain}")
    table.add_column("figure")
    table.add_column("value", justify="right")
    for name, value in figures(result):
        table.add_row(name, value)
    console.print(table)
    for name, n, example in result.endings:
        console.print(f"{n} x {name}: {escape(example)}")
    for worst in result.worst:
        console.print(f"worst: seed {worst.seed}: {escape(worst.what)}")
        console.print(f"       {escape(worst.command)}")


def _kinds(hint: Any) -> tuple[Any, ...]:
    return getattr(hint, "__args__", None) or (hint,)


def _flag(name: str) -> str:
    return "--" + name.replace("_", "-")
