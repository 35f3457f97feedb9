"""``walking-irl methods``: all inverse methods, where they run and what they guarantee."""

from __future__ import annotations

import argparse
from typing import Any

from rich.console import Console
from rich.table import Table

from walking_irl.cli import DONE

LONGEST_WORD = 12


def add_parser(commands: Any) -> argparse.ArgumentParser:
    """The command's parser."""
    p: argparse.ArgumentParser = commands.add_parser(
        "methods", help="list the methods that recover --method knows (table 3.1)"
    )
    return p


def run(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl methods``."""
    from walking_irl.baselines.registry import METHODS

    table = Table()
    table.add_column("method", no_wrap=True)
    for name in ("needs", "answers with", "guarantee", "worlds"):
        table.add_column(name, overflow="fold", min_width=LONGEST_WORD)
    for m in METHODS.values():
        reward = "linear" if m.is_linear else "any"
        needs = m.needs.value + (", model" if m.needs_model else "")
        worlds = ", ".join(m.worlds)
        table.add_row(
            m.name,
            needs,
            f"{m.answer} ({reward} reward); {_count(m.solves)} solves",
            m.guarantee,
            worlds,
        )
    console.print(table)
    console.print("solves: forward problems; model: the transition probabilities")
    console.print("measured losses: walking-irl tables 3.1; to run one: recover --method NAME")
    return DONE


def _count(solves: str) -> str:
    return "no" if solves == "none" else solves
