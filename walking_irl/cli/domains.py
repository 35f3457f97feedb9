"""``walking-irl domains``: the worlds, their objectives and what solves them."""

from __future__ import annotations

import argparse
from typing import Any

from rich.console import Console
from rich.table import Table

from walking_irl.domains import DOMAINS


def add_parser(commands: Any) -> argparse.ArgumentParser:
    """The command's parser."""
    p: argparse.ArgumentParser = commands.add_parser(
        "domains", help="list domains, their objectives, budgets and solvers"
    )
    return p


def run(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl domains``."""
    table = Table("domain", "world", "objectives", "solved by")
    for name, entry in DOMAINS.items():
        domain = entry.make()
        objectives = ", ".join(o.name for o in domain.objectives)
        budget = f"budget: {domain.defaults.max_solves} solves"
        table.add_row(f"{name}\n{budget}", entry.world, objectives, entry.solver)
    console.print(table)
    return 0
