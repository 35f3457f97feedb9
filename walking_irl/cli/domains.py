"""``walking-irl domains``: the worlds, their objectives and what solves them."""

from __future__ import annotations

import argparse

from rich.console import Console
from rich.table import Table

from walking_irl.domains import DOMAINS


def run(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl domains``."""
    table = Table("domain", "world", "objectives", "solved by")
    for name, entry in DOMAINS.items():
        objectives = ", ".join(o.name for o in entry.make().objectives)
        table.add_row(name, entry.world, objectives, entry.solver)
    console.print(table)
    return 0
