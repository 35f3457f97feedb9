"""Pages that come from the package itself: commands, domains, objectives and result tables.

Written into ``docs/_generated`` whenever the pages are built, so that they cannot disagree with the
version that they describe. Needs nothing but the package; ``python docs/generate.py`` writes them
for a look.
"""

from __future__ import annotations

import argparse
import os
import re
from pathlib import Path

import numpy as np

DOCS = Path(__file__).parent
TARGET = DOCS / "_generated"
COLUMNS = "96"
BODY = "humanoid-planar"
"""Whose gaits are compared."""


def write_all() -> None:
    """Write every page whose content has changed."""
    (TARGET / "parts").mkdir(parents=True, exist_ok=True)
    pages = {
        "commands.md": commands(),
        "parts/domains.md": domains(),
        "parts/tables.md": tables(),
        **objectives(),
    }
    for name, text in pages.items():
        path = TARGET / name
        if not path.exists() or path.read_text() != text:
            path.write_text(text)


def commands() -> str:
    """Help texts of all commands, as the parsers print them."""
    from walking_irl.cli.main import build_parser

    os.environ["COLUMNS"] = COLUMNS
    parser = build_parser()
    (actions,) = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    parts = ["# Command line\n", _help(parser)]
    for name, sub in actions.choices.items():
        parts += [f"## walking-irl {name}\n", _help(sub)]
    return "\n".join(parts)


def _help(parser: argparse.ArgumentParser) -> str:
    return f"```text\n{parser.format_help().rstrip()}\n```\n"


def domains() -> str:
    """A table of the registry, and each domain's objectives."""
    from walking_irl.domains import DOMAINS, load

    rows = ["| name | world | solver |", "|---|---|---|"]
    rows += [f"| `{name}` | {e.world} | {e.solver} |" for name, e in DOMAINS.items()]
    parts = ["\n".join(rows)]
    for name in DOMAINS:
        lines = [f"## {name}\n", "| objective | unit | scale | what it is |", "|---|---|---|---|"]
        lines += [
            f"| {o.name} | {_cell(o.unit)} | {o.scale:g} | {_cell(o.meaning)} |"
            for o in load(name).objectives
        ]
        parts.append("\n".join(lines))
    return "\n\n".join(parts) + "\n"


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def tables() -> str:
    """The result tables that lie in ``docs/tables``, in the order of their numbers."""
    paths = sorted((DOCS / "tables").glob("*.md"), key=_number)
    parts = []
    for path in paths:
        text = path.read_text()
        if path.with_suffix(".svg").exists():
            text += f"\n![{text.splitlines()[0].lstrip('# ')}](../../tables/{path.stem}.svg)\n"
        parts.append(text)
    return "\n".join(parts)


def _number(path: Path) -> tuple[int, ...]:
    return tuple(map(int, re.findall(r"\d+", path.stem)))


def objectives() -> dict[str, str]:
    """One page per objective of the humanoid: what it is, and what three times more of it does."""
    from walking_irl.domains.humanoid.costs.defaults import OBJECTIVES, REFERENCE_WEIGHTS

    pages = {}
    for i, o in enumerate(OBJECTIVES):
        lines = [
            f"# {o.name.capitalize()}\n",
            f"{o.meaning}\n",
            "| | |",
            "|---|---|",
            f"| residual, squared and summed over the body | `{_cell(o.formula)}` |",
            f"| unit of the raw cost | {_cell(o.unit)} |",
            f"| raw value that counts as one | {o.scale:g} |",
            f"| share in the reference weights | {REFERENCE_WEIGHTS[i]:.3f} |\n",
            "## What more of it does\n",
            "The planar walker's best gait for the reference weights, and for three times the "
            f"weight of {o.name} (weights sum to one, so the others shrink):\n",
            _compared(f"{o.name} x3"),
            f"![Six frames of either gait](objective_{o.name}.png)\n",
            "*Above the reference, below the same weights with three times as much of "
            f"{o.name}; frames at the same shares of the gait cycle.*\n",
        ]
        pages[f"objective_{o.name}.md"] = "\n".join(lines)
        _picture(f"{o.name} x3", TARGET / f"objective_{o.name}.png")
    return pages


def _compared(name: str) -> str:
    """Speed, cadence, step and costs of a shipped gait beside the reference."""
    from walking_irl.domains.humanoid.costs.defaults import OBJECTIVES
    from walking_irl.domains.humanoid.gait.library import load_library

    library = load_library(BODY)
    both = [library["reference"], library[name]]
    rows = ["| | reference | more of it | change |", "|---|---|---|---|"]

    def row(label: str, values: list[float], form: str) -> str:
        change = 100 * (values[1] / values[0] - 1)
        return f"| {label} | {values[0]:{form}} | {values[1]:{form}} | {change:+.0f} % |"

    rows.append(row("speed [m/s]", [s.gait.speed for s in both], ".2f"))
    rows.append(row("steps per minute", [60 / s.gait.half_period for s in both], ".0f"))
    rows.append(row("step length [m]", [s.gait.step_length for s in both], ".2f"))
    for i, o in enumerate(OBJECTIVES):
        rows.append(
            row(f"cost per metre: {o.name}", [float(s.total_costs[i]) for s in both], ".3f")
        )
    return "\n".join(rows) + "\n"


def _picture(name: str, path: Path) -> None:
    """Six frames of the reference gait above six of another; drawn once."""
    if path.exists():
        return
    from walking_irl.domains.humanoid.body.load import load_walker
    from walking_irl.domains.humanoid.gait.gait import whole_cycle
    from walking_irl.domains.humanoid.gait.library import load_library
    from walking_irl.domains.humanoid.gait.pictures import SIDE, photograph, write_png

    walker, rows = load_walker(BODY), []
    for key in ("reference", name):
        q = whole_cycle(load_library(BODY)[key].gait, walker.mirror)
        chosen = [(q[i], SIDE) for i in np.linspace(0, len(q), 6, endpoint=False).astype(int)]
        rows.append(np.hstack(photograph(walker, chosen, height=300, width=160)))
    write_png(np.vstack(rows), path)


if __name__ == "__main__":
    write_all()
