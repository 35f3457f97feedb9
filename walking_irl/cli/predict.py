"""``walking-irl predict``: the gait that the same weights give at another speed, uphill, loaded."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from walking_irl.cli import DONE
from walking_irl.cli.one_gait import (
    add_png,
    add_save,
    add_walker,
    asked_walker,
    check_gait_files,
    write_gait_files,
)
from walking_irl.errors import InvalidInputError
from walking_irl.files import check_outputs, write_json
from walking_irl.workers import workers


def add_parser(commands: Any) -> argparse.ArgumentParser:
    """The command's parser."""
    p: argparse.ArgumentParser = commands.add_parser(
        "predict", help="the gait that the same weights give elsewhere"
    )
    add_walker(p)
    p.add_argument("--speed", type=float, metavar="M/S", help="of the walk (what the weights like)")
    p.add_argument(
        "--slope", type=float, default=0.0, metavar="DEG", help="of the ground, uphill positive"
    )
    p.add_argument("--load", type=float, default=0.0, metavar="KG", help="on the back")
    add_save(p)
    add_png(p)
    p.add_argument("--json", type=Path, metavar="FILE.json", help="write the figures")
    p.add_argument("--quiet", action="store_true", help="print nothing but errors")
    return p


def run(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl predict``."""
    from walking_irl.domains.humanoid.body.variants import Surroundings
    from walking_irl.domains.humanoid.prediction import predict

    check_gait_files(args)
    check_outputs([args.save, args.png, args.json])
    if args.speed is not None and not (np.isfinite(args.speed) and args.speed > 0):
        raise InvalidInputError(f"speed must be a positive number, got {args.speed}")
    around = Surroundings(args.slope, args.load)
    domain, w = asked_walker(args, console)
    with workers(copied=True) as executor:
        level = predict(domain.spec, w, Surroundings(), executor=executor)
        there = predict(domain.spec, w, around, args.speed, executor, level=level)
    write_gait_files(args, there.spec.walker, there.gait)
    content = {
        "objectives": [o.name for o in domain.objectives],
        "w": w.tolist(),
        "slope": args.slope,
        "load": args.load,
        "level": _figures(level, w),
        "there": _figures(there, w),
    }
    if args.json is not None:
        write_json(args.json, content)
    if not args.quiet:
        _show(content, console)
    return DONE


def _figures(found: Any, w: Any) -> dict[str, Any]:
    from walking_irl.domains.humanoid.gait.realism import figures

    return {
        **figures(found.spec.walker, found.gait),
        "half_period": found.gait.half_period,
        "cost": float(w @ found.total_costs),
        "total_costs": found.total_costs.tolist(),
        "price_of_time": found.price,
    }


def _show(content: dict[str, Any], console: Console) -> None:
    level, there = content["level"], content["there"]
    table = Table("figure", "level, unloaded", "there")
    for name, unit in (
        ("speed", "m/s"),
        ("step_length", "m"),
        ("cadence", "steps/min"),
        ("stance_fraction", "of the cycle"),
        ("cost_of_transport", "mechanical"),
        ("peak_vertical_force", "body weights"),
        ("cost", "under the weights"),
        ("price_of_time", "weight"),
    ):
        label = f"{name.replace('_', ' ')} [{unit}]"
        table.add_row(label, f"{level[name]:.4g}", f"{there[name]:.4g}", end_section=False)
    for k, name in enumerate(content["objectives"]):
        values = (f"{g['total_costs'][k]:.4f}" for g in (level, there))
        table.add_row(f"total cost: {name}", *values)
    for name, (low, high) in level["joint_ranges"].items():
        if name.endswith("_r"):
            a, b = there["joint_ranges"][name]
            label = f"range of {name[:-2].replace('_', ' ')} [degrees]"
            table.add_row(label, f"{low:.0f} .. {high:.0f}", f"{a:.0f} .. {b:.0f}")
    console.print(table, markup=False)
