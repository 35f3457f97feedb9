"""``walking-irl recover --method NAME``: a recovery by another method than CPIRL."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from walking_irl.cli import DONE, INTERRUPTED
from walking_irl.cli.earlier import keep_earlier
from walking_irl.cli.side_by_side import workers_for
from walking_irl.domains import load
from walking_irl.errors import (
    FallError,
    InvalidInputError,
    RecordingError,
    SolverError,
    WalkingIRLError,
)
from walking_irl.files import check_ending, check_outputs, write_json
from walking_irl.run.setup import HORIZON, TRAJECTORIES, Setup
from walking_irl.workers import interrupts_answered, interrupts_kept

if TYPE_CHECKING:
    from walking_irl.run.by_method import MethodReport

CPIRL_ONLY = ("centre", "mode", "max_solves", "expert_gap", "min_weight")
"""Settings of a recovery that are CPIRL's own."""


def add_arguments(p: argparse.ArgumentParser) -> None:
    """Arguments that choose another method."""
    group = p.add_argument_group("another method", "they list themselves: walking-irl methods")
    group.add_argument("--method", metavar="NAME", help="explain the expert by it")
    group.add_argument(
        "--trajectories",
        type=int,
        metavar="N",
        help=f"demonstrations in finite worlds ({TRAJECTORIES} where a method reads actions)",
    )
    group.add_argument("--horizon", type=int, help=f"steps of each ({HORIZON})")


def refuse_alone(args: argparse.Namespace) -> None:
    """Complain about arguments that need ``--method``.

    Raises:
        InvalidInputError: If one is given without it.
    """
    for name in ("trajectories", "horizon"):
        if getattr(args, name) is not None:
            raise InvalidInputError(f"--{name} goes with --method")


def run(args: argparse.Namespace, given: dict[str, Any], console: Console) -> int:
    """The recovery; ``given`` are the arguments of its setup."""
    from walking_irl.run.by_method import recover_by  # all methods: not for every recovery

    own = [f"--{name.replace('_', '-')}" for name in CPIRL_ONLY if hasattr(args, name)]
    own += ["--resume"] if args.resume is not None else []
    own += ["--checkpoint"] if args.checkpoint is not None else []
    own += ["--archive"] if args.archive is not None else []
    if own:
        raise InvalidInputError(f"{', '.join(own)}: CPIRL only, leave out with --method")
    setup = Setup(**given)
    domain = load(setup.domain)
    default = Path(f"{domain.defaults.files or setup.domain}-{args.method}.rrd")
    record = None if args.no_record else args.record or default
    check_ending(record, ".rrd")
    check_outputs([args.json, record], inputs=[setup.demonstration])
    with workers_for(domain) as executor:
        report = recover_by(
            args.method,
            setup,
            n_trajectories=args.trajectories,
            horizon=args.horizon,
            executor=executor,
        )
    if args.record is None:
        keep_earlier([record], console)
    report, trouble = _recorded(report, record)
    if args.json is not None:
        write_json(args.json, report.to_json())
    show(report, console)
    if isinstance(trouble, WalkingIRLError):
        raise trouble
    return DONE if trouble is None else INTERRUPTED


def _recorded(
    report: MethodReport, path: Path | None
) -> tuple[MethodReport, KeyboardInterrupt | WalkingIRLError | None]:
    """The report with its recording, and what cut that short: the result is not lost with it."""
    if path is None:
        return report, None
    from walking_irl.run.method_film import record_report

    try:
        with interrupts_kept():
            record_report(report, path)
    except RecordingError as error:
        return report, error
    except (KeyboardInterrupt, SolverError, FallError) as trouble:  # written as far as it came
        interrupts_answered()
        notes = getattr(trouble, "__notes__", [])  # of a recording that could not be written
        if notes:
            return report, RecordingError(notes[0])
        return replace(report, recording=str(path)), trouble
    return replace(report, recording=str(path)), None


def show(report: MethodReport, console: Console) -> None:
    """Print the table of weights, where there are some, and the figures below it."""
    w, truth, intervals = report.weights, report.problem.w_expert, report.intervals
    if w is not None:
        table = Table("objective", title=f"{report.problem.domain.question} By {report.method}")
        columns = [("ground truth", truth), ("recovered", w), ("interval", intervals)]
        for name, values in columns:
            if values is not None:
                table.add_column(name, justify="right")
        for j, objective in enumerate(report.problem.objectives):
            cells = [_cell(values[j]) for _, values in columns if values is not None]
            table.add_row(objective.name, *cells)
        console.print(table)
        if report.found.space != "simplex":
            console.print("weights are scaled to sum |w| = 1; the method bounds no signs")
    else:
        console.print("no weights: this method answers with a policy or a reward for each state")
    console.print(f"ended: {report.found.status.value}")
    seen = f"{report.n_trajectories} trajectories" if report.n_trajectories else "itself"
    console.print(f"the expert is known by {seen}")
    if report.relative_loss is not None:
        console.print(
            "loss of the recovered policy, ground-truth weights: "
            f"{100 * report.relative_loss:.5f} %"
        )
    solves = report.found.info.get("solves")
    counted = "" if solves is None else f"{solves} forward solve{'s' * (solves != 1)}, "
    console.print(f"{counted}{report.seconds:.2f} s")
    if report.recording is not None:
        console.print(f"recording {escape(report.recording)}: walking-irl view {report.recording}")
    for note in report.found.notes:
        console.print(escape(note))


def _cell(value: Any) -> str:
    if getattr(value, "ndim", 0):
        return f"{value[0]:.4f} .. {value[1]:.4f}"
    return f"{value:.4f}"
