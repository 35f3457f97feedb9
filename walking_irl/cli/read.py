"""``walking-irl read``: what a recording of a person's walk says, or one sentence why not."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from walking_irl.cli import DONE
from walking_irl.errors import InvalidInputError
from walking_irl.files import check_ending, check_outputs, write_file, write_json

if TYPE_CHECKING:
    from walking_irl.domains.humanoid.recorded.person import Options


def add_parser(commands: Any) -> argparse.ArgumentParser:
    """The command's parser."""
    p: argparse.ArgumentParser = commands.add_parser(
        "read", help="understand recordings of a person's walk"
    )
    p.add_argument(
        "files",
        nargs="+",
        type=Path,
        metavar="FILE",
        help="joint angles (.mot, .sto, .csv, .npz), several trials of one person are averaged; "
        "ground reaction forces (.mot) of the same walks",
    )
    add_options(p)
    p.add_argument("--save", type=Path, metavar="FILE.npz|FILE.csv", help="write the mean cycle")
    p.add_argument(
        "--plot", type=Path, metavar="FILE.svg", help="draw the curves on norms and the model"
    )
    p.add_argument("--json", type=Path, metavar="FILE.json", help="write what was understood")
    p.add_argument("--quiet", action="store_true", help="print nothing but errors")
    return p


def add_options(p: Any) -> None:
    """What the user knows better than the files."""
    p.add_argument("--from", dest="start", type=float, metavar="S", help="leave out what is before")
    p.add_argument("--to", dest="stop", type=float, metavar="S", help="leave out what is after")
    p.add_argument("--height", type=float, metavar="M", help="of the person, where it is known")
    p.add_argument("--belt", type=float, metavar="M/S", help="speed of the treadmill")
    p.add_argument("--cycle-time", type=float, metavar="S", help="for tables in percent of a cycle")
    p.add_argument("--convention", choices=("opensim", "clinical"), help="whose signs (by names)")


FLAGS = {
    "start": "--from",
    "stop": "--to",
    "height": "--height",
    "belt": "--belt",
    "cycle_time": "--cycle-time",
    "convention": "--convention",
}
"""Of these options, by the names of :class:`~.recorded.person.Options`."""


def options_of(args: argparse.Namespace) -> Options:
    """These options.

    Raises:
        InvalidInputError: If one is no number.
    """
    from walking_irl.domains.humanoid.recorded.person import Options

    for name, flag in FLAGS.items():
        value = getattr(args, name)
        if isinstance(value, float) and not np.isfinite(value):
            raise InvalidInputError(f"{flag[2:]} must be a number, got {value}")
    return Options(**{name: getattr(args, name) for name in FLAGS})


def run(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl read``."""
    from walking_irl.domains.humanoid.body.load import load_walker
    from walking_irl.domains.humanoid.gait.curves import likeness
    from walking_irl.domains.humanoid.gait.files import save_gait
    from walking_irl.domains.humanoid.gait.realism import leg_length
    from walking_irl.domains.humanoid.recorded.person_curves import person_curves
    from walking_irl.domains.humanoid.recorded.reader import read_person

    check_ending(args.save, ".npz", ".csv")
    check_ending(args.plot, ".svg")
    check_outputs([args.save, args.plot, args.json], inputs=args.files)
    options = options_of(args)
    walker = load_walker()
    person = read_person(args.files, walker, options)
    if args.save is not None:
        save_gait(args.save, person.gait, walker)
    curves = person_curves(person, walker)
    norms = likeness(curves, person.gait.speed, leg_length(walker))
    if args.plot is not None:
        write_file(args.plot, _picture(person, curves, walker).encode())
    if args.json is not None:
        write_json(args.json, {**to_json(person), "norms": norms})
    if not args.quiet:
        _show(person, norms, console)
    return DONE


def _picture(person: Any, curves: Any, walker: Any) -> str:
    """The person, the model's reference gait, and the band of adults."""
    from walking_irl.domains.humanoid.gait.curve_picture import curves_picture
    from walking_irl.domains.humanoid.gait.curves import gait_curves
    from walking_irl.domains.humanoid.gait.library import load_gaits
    from walking_irl.domains.humanoid.gait.norm_curves import norm_set
    from walking_irl.domains.humanoid.gait.realism import gait_cycle, leg_length

    reference = load_gaits()["reference"]
    walks = {
        f"recorded, {person.speed:.2f} m/s": curves,
        f"model, {reference.speed:.2f} m/s": gait_curves(gait_cycle(walker, reference)),
    }
    names = ", ".join(p.name for p in person.sources)
    norms = norm_set("adults", person.gait.speed, leg_length(walker))
    return curves_picture(names, walks, norms, "adults at self-selected speed, mean and 1 s.d.")


def to_json(person: Any) -> dict[str, Any]:
    """What was understood of a person's walk, as plain JSON types."""
    names = (
        *("format", "convention", "unit", "rate", "seconds", "gaps", "heading", "belt", "scale"),
        *("steps", "cycles", "half_period", "step_length", "speed", "cadence", "residual"),
        *("asymmetry", "pelvis_offset", "trunk_offset"),
    )
    gait = person.gait
    return {
        "sources": [str(p) for p in person.sources],
        **{name: getattr(person, name) for name in names},
        "missing": list(person.missing),
        "notes": list(person.notes),
        "model": {
            "speed": gait.speed,
            "step_length": gait.step_length,
            "half_period": gait.half_period,
        },
        "force": None if person.force is None else person.force.tolist(),
    }


def _show(person: Any, norms: dict[str, Any], console: Console) -> None:
    table = Table("figure", "value")
    rows = (
        ("file", f"{person.format}, {person.rate:.0f} Hz, {person.unit}, {person.convention}"),
        ("used", f"{person.seconds:.2f} s, {person.steps:.1f} steps, {person.cycles} cycles"),
        ("direction", f"{person.heading:.0f} degrees in the laboratory"),
        ("treadmill", f"{person.belt:.2f} m/s" if person.belt else "no"),
        ("size", f"the model's legs are {person.scale:.3f} of the person's"),
        ("speed", f"{person.speed:.3f} m/s"),
        ("cadence", f"{person.cadence:.1f} steps/min"),
        ("step length", f"{person.step_length:.3f} m"),
        ("residual", f"{person.residual:.2f} degrees about the cycle"),
        ("asymmetry", f"{person.asymmetry:.2f} degrees between the sides"),
        ("taken out", f"{person.pelvis_offset:.1f} degrees of pelvic tilt, "
         f"{person.trunk_offset:.1f} of lean"),
        ("forces", "none" if person.force is None else
         f"vertical peak {person.force[:, 2].max():.2f} body weights"),
        ("missing", ", ".join(person.missing) or "nothing"),
    )  # fmt: skip
    for name, value in rows:
        table.add_row(name, escape(value))
    for name, norm in norms.items():
        table.add_row(f"within 1 s.d. of {name}", f"{100 * norm['mean']:.0f} % of the cycle")
    console.print(table)
    for note in person.notes:
        console.print(f"note: {escape(note)}")
