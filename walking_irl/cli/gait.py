"""``walking-irl gait``: the best gait under given weights, as figures, picture and files."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from walking_irl.arrays import Array
from walking_irl.cli.one_gait import (
    add_png,
    add_save,
    add_walker,
    asked_walker,
    check_gait_files,
    write_gait_files,
)
from walking_irl.errors import InvalidInputError
from walking_irl.files import check_ending, check_outputs, write_file, write_json
from walking_irl.workers import workers


def add_parser(commands: Any) -> argparse.ArgumentParser:
    """The command's parser."""
    p: argparse.ArgumentParser = commands.add_parser(
        "gait", help="solve for the best gait under given weights"
    )
    add_walker(p)
    p.add_argument(
        "--seconds",
        type=float,
        default=10.0,
        help="length of the closed-loop rollout (%(default)s)",
    )
    add_save(p)
    p.add_argument("--record", type=Path, metavar="FILE.rrd", help="record the rollout")
    add_png(p)
    p.add_argument("--video", type=Path, metavar="FILE.gif", help="draw it as a moving picture")
    p.add_argument("--plot", type=Path, metavar="FILE.svg", help="draw its curves on the norms")
    p.add_argument("--json", type=Path, metavar="FILE.json", help="write the gait's figures")
    p.add_argument("--quiet", action="store_true", help="print nothing but errors")
    return p


def run(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl gait``."""
    from walking_irl.domains.humanoid.gait.realism import figures

    check_gait_files(args)
    check_ending(args.record, ".rrd")
    check_ending(args.plot, ".svg")
    check_ending(args.video, ".gif")
    check_outputs([args.save, args.record, args.png, args.video, args.plot, args.json])
    if not (np.isfinite(args.seconds) and args.seconds > 0):
        raise InvalidInputError(f"seconds must be a positive number, got {args.seconds}")
    domain, w = asked_walker(args, console)
    with workers(copied=True) as executor:
        response = domain.forward(w, executor)
    found = response.policy
    content = {
        "objectives": [o.name for o in domain.objectives],
        "w": w.tolist(),
        "mu": response.mu.tolist(),
        **figures(domain.walker, found),
        "solver": dict(response.info),
    }
    write_gait_files(args, domain.walker, found)
    if args.video is not None:
        from walking_irl.domains.humanoid.gait.video import gif

        write_file(args.video, gif(domain.walker, found))
    if args.plot is not None:
        write_file(args.plot, _curves(args.domain, domain.walker, found).encode())
    if args.record is not None:
        _record_walk(args.record, domain, found, args.seconds, w)
    if args.json is not None:
        write_json(args.json, content)
    if not args.quiet:
        _show_gait(content, console)
    return 0


def _curves(name: str, walker: Any, found: Any) -> str:
    """The gait's curves on the band of adults."""
    from walking_irl.domains.humanoid.gait.curve_picture import curves_picture
    from walking_irl.domains.humanoid.gait.curves import gait_curves
    from walking_irl.domains.humanoid.gait.norm_curves import norm_set
    from walking_irl.domains.humanoid.gait.realism import gait_cycle, leg_length

    walks = {f"gait, {found.speed:.2f} m/s": gait_curves(gait_cycle(walker, found))}
    norms = norm_set("adults", found.speed, leg_length(walker))
    note = "adults at self-selected speed, mean and 1 s.d."
    return curves_picture(f"Best gait of the {name}", walks, norms, note)


def _record_walk(path: Path, domain: Any, found: Any, seconds: float, w: Array) -> None:
    """Closed-loop walk of a gait at half the knot timestep, as a recording."""
    from walking_irl.domains.humanoid.closed_loop.policy import tracking_policy
    from walking_irl.domains.humanoid.closed_loop.rollout import rollout
    from walking_irl.recording import record_motion
    from walking_irl.recording.views.gait import WalkerView

    policy = tracking_policy(domain.walker, found, substeps=2)
    walked = rollout(domain.walker, policy, seconds=seconds)
    view, names = WalkerView(domain.walker.model), [o.name for o in domain.objectives]
    weights = dict(zip(names, w.tolist(), strict=True))
    rows = [f"| {name} | {v:.4f} |" for name, v in weights.items()]
    pace = f"{found.speed:.2f} m/s, {60 / found.half_period:.0f} steps per minute"
    text = "\n".join([f"{pace}\n", "| objective | weight |", "|---|---|", *rows])
    record_motion(
        path, view, walked, title=domain.name, text=text, weights=weights, plots=view.plots()
    )


def _show_gait(content: dict[str, Any], console: Console) -> None:
    table = Table("figure", "value")
    for name, unit in (
        ("speed", "m/s"),
        ("step_length", "m"),
        ("cadence", "steps/min"),
        ("stance_fraction", "of the cycle"),
        ("cost_of_transport", "mechanical"),
        ("peak_vertical_force", "body weights"),
        ("max_root_residual", "body weights"),
        ("realism", "of 1"),
    ):
        table.add_row(name.replace("_", " "), f"{content[name]:.4g} {unit}")
    for name, value in zip(content["objectives"], content["mu"], strict=True):
        table.add_row(f"mu {name}", f"{value:.5f}")
    for group, value in content["groups"].items():
        table.add_row(f"realism: {group.replace('_', ' ')}", f"{value:.3f}")
    met = content["bands"]
    table.add_row("bands met", f"{sum(met.values())} of {len(met)}")
    for name, norm in content["norms"].items():
        table.add_row(f"within 1 s.d. of {name}", f"{100 * norm['mean']:.0f} % of the cycle")
        for curve, share in norm["curves"].items():
            table.add_row(f"  {curve.replace('_', ' ')}", f"{100 * share:.0f} %")
    console.print(table)
