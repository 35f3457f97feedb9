"""``walking-irl recover``: one recovery, its progress and its result in the terminal."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from rich.console import Console

from walking_irl.cli import DONE, FAILED, INTERRUPTED, by_method, walk
from walking_irl.cli.earlier import keep_earlier
from walking_irl.cli.side_by_side import workers_for
from walking_irl.cli.terminal import Terminal, show_report
from walking_irl.cli.weights import parse_weights
from walking_irl.domains import DOMAINS, load
from walking_irl.domains.contract import EXPERTS, Domain, Option
from walking_irl.errors import InvalidInputError, WalkingIRLError
from walking_irl.files import check_ending, check_outputs, write_file, write_json
from walking_irl.geometry.centres import CENTRES
from walking_irl.run import session
from walking_irl.run.checkpoint import Checkpoint, load_checkpoint
from walking_irl.run.report import Report
from walking_irl.run.setup import Setup
from walking_irl.types import MODES
from walking_irl.workers import interrupts_held, interrupts_kept

ALSO_WHEN_RESUMED = ("record", "checkpoint", "max_solves")
"""What a resumed run may be told anew."""


def add_parser(commands: Any) -> argparse.ArgumentParser:
    """The command's parser; what has no default here has it in :class:`Setup` or the domain."""
    p: argparse.ArgumentParser = commands.add_parser(
        "recover", help="recover the weights of an expert, by default of a walking humanoid"
    )
    who = p.add_argument_group("who walks")
    _setting(who, "--domain", help=f"{', '.join(DOMAINS)} ({Setup.domain})")
    which = who.add_mutually_exclusive_group()
    _setting(which, "--seed", type=int, help=f"draws ground-truth weights ({Setup.seed})")
    _setting(which, "--weights", metavar="W1,W2,...", help="ground-truth weights of your own")
    _setting(which, "--demonstration", type=Path, metavar="FILE", help="a gait (.npz or .csv)")
    _setting(who, "--expert", help=f"{' or '.join(EXPERTS)}: known exactly ({Setup.expert})")
    how = p.add_argument_group(
        "how it is drawn and recorded", "each domain has its own of these, and its own defaults"
    )
    for name, option in known_options().items():
        _setting(how, _flag(name), dest=f"option_{name}", type=type(option.default),
                 metavar=name.upper(), help=option.meaning)  # fmt: skip
    how_found = p.add_argument_group("algorithm")
    _setting(how_found, "--centre", help=f"query point: {', '.join(CENTRES)} ({Setup.centre})")
    _setting(
        how_found,
        "--mode",
        help=f"{', '.join(MODES)}: the expert is optimal, is so to a tolerance, or need not be "
        f"({Setup.mode}; minimise for a suboptimal expert)",
    )
    _setting(
        how_found,
        "--max-solves",
        type=int,
        help="budget of forward solves (the domain's: walking-irl domains)",
    )
    _setting(
        how_found,
        "--expert-gap",
        type=float,
        metavar="G",
        help="your word that the expert is sub-optimal by at most this share of its return; 0: not "
        "at all (what the run measures)",
    )
    _setting(
        how_found,
        "--min-weight",
        type=float,
        metavar="W",
        help="least weight that is looked for, of a sum of 1 (the domain's)",
    )
    how_found.add_argument(
        "--resume", type=Path, metavar="FILE.npz", help="go on from a checkpoint, as it began"
    )
    by_method.add_arguments(p)
    walk.add_arguments(p)
    _add_outputs(p.add_argument_group("output"))
    return p


def _add_outputs(out: Any) -> None:
    out.add_argument(
        "--record",
        type=Path,
        metavar="FILE.rrd",
        help="where the recording goes (walking.rrd, or as domain and method are called; an "
        "earlier one is kept under a number); the expert's rollouts go beside it",
    )
    out.add_argument("--no-record", action="store_true", help="write no recording")
    out.add_argument(
        "--checkpoint",
        type=Path,
        metavar="FILE.npz",
        help="where the solver's answers go, to resume from (beside the recording)",
    )
    out.add_argument("--archive", type=Path, help=argparse.SUPPRESS)  # its name until 0.1
    out.add_argument("--json", type=Path, metavar="FILE.json", help="write all figures as JSON")
    out.add_argument(
        "--plot", type=Path, metavar="FILE.svg", help="draw how intervals close and regret falls"
    )
    out.add_argument("--quiet", action="store_true", help="print the result only")


def _setting(group: Any, flag: str, **about: Any) -> None:
    """An argument that is left out of the result where it is not given."""
    group.add_argument(flag, default=argparse.SUPPRESS, **about)


def _flag(name: str) -> str:
    return "--" + name.replace("_", "-")


def known_options() -> dict[str, Option]:
    """Options of all domains by name; each one's meaning says whose it is, and its values."""
    owners: dict[str, dict[tuple[Any, tuple[str, ...]], list[str]]] = {}
    found: dict[str, Option] = {}
    for domain, entry in DOMAINS.items():
        for name, option in entry.options.items():
            found.setdefault(name, option)
            values = (option.default, option.choices)
            owners.setdefault(name, {}).setdefault(values, []).append(domain)
    for name, option in found.items():
        whose = [
            f"{', '.join(domains)}{': ' if choices else ''}{' or '.join(choices)} ({default})"
            for (default, choices), domains in owners[name].items()
        ]
        found[name] = option._replace(meaning=f"{option.meaning}; {'; '.join(whose)}")
    return found


def run(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl recover``."""
    if args.plot is not None and (args.walk is not None or args.method is not None):
        raise InvalidInputError("--plot draws CPIRL's own runs; leave out --walk and --method")
    if args.walk is not None:
        return walk.run(args, _asked(args), console)
    walk.refuse_alone(args)
    if args.method is not None:
        return by_method.run(args, _asked(args), console)
    by_method.refuse_alone(args)
    _rename_archive(args, console)
    before = None if args.resume is None else load_checkpoint(args.resume)
    setup = _setup(args, None if before is None else before.setup)
    domain = load(setup.domain)
    rollouts = None
    if setup.record is not None and domain.has_trajectories:
        rollouts = setup.record.with_suffix(".npz")
    _check_files(setup, rollouts, args)
    if args.record is None and before is None:
        keep_earlier([setup.record, rollouts, setup.checkpoint], console)
    if not args.quiet:
        source = "solving for" if before is None else f"{args.resume} knows"
        console.print(f"{setup.domain}: {source} the expert ...")
    n_known = 0 if before is None else len(before.answers)
    terminal = Terminal(console, rollouts, n_known, args.quiet)
    report = _recovered(setup, before, terminal, domain)
    failure = _write(report, args) or report.failed_write
    show_report(report, console, terminal.rollouts_written)
    if failure is not None:
        raise failure
    if report.was_interrupted:
        return INTERRUPTED
    return DONE if report.is_success else FAILED


def _write(report: Report, args: argparse.Namespace) -> WalkingIRLError | None:
    """Files of results, before the terminal, whose reader may leave; what cannot be written."""
    try:
        with interrupts_held():
            if args.json is not None:
                write_json(args.json, report.to_json())
            if args.plot is not None:
                from walking_irl.experiments.recovery_picture import recovery_picture

                setup, names = report.problem.setup, [o.name for o in report.objectives]
                title = f"{report.problem.domain.question} ({setup.domain})"
                picture = recovery_picture(title, names, report.iterations, report.w_expert)
                write_file(args.plot, picture.encode())
    except InvalidInputError as error:
        return error
    return None


def _recovered(
    setup: Setup, before: Checkpoint | None, terminal: Terminal, domain: Domain
) -> Report:
    """The run; Ctrl-C while its workers end comes too late to take its result away."""
    report = None
    try:
        with interrupts_kept(), workers_for(domain) as executor, terminal:
            report = session.run(
                setup,
                resumed=before,
                executor=executor,
                on_expert=terminal.expert,
                on_iteration=terminal.iteration,
                on_step=terminal.step,
            )
    except KeyboardInterrupt:
        if report is None:
            raise
    return report


def _rename_archive(args: argparse.Namespace, console: Console) -> None:
    if args.archive is None:
        return
    if args.checkpoint is not None:
        raise InvalidInputError("--archive is the old name of --checkpoint; give one of them")
    args.checkpoint = args.archive
    if not args.quiet:
        console.print("--archive is called --checkpoint now; the old name leaves with version 0.3")


def _check_files(setup: Setup, rollouts: Path | None, args: argparse.Namespace) -> None:
    check_ending(setup.record, ".rrd")
    check_ending(setup.checkpoint, ".npz")
    check_ending(args.plot, ".svg")
    outputs = [setup.record, rollouts, args.json, args.plot]
    check_outputs([*outputs, setup.checkpoint], inputs=[setup.demonstration])
    if args.resume is not None:  # its checkpoint goes on in the same file
        check_outputs(outputs, inputs=[args.resume])


def _asked(args: argparse.Namespace) -> dict[str, Any]:
    """Arguments of a setup as far as they are given, files of results left aside."""
    given: dict[str, Any] = {
        f.name: getattr(args, f.name) for f in fields(Setup) if hasattr(args, f.name)
    }
    given = {k: v for k, v in given.items() if k not in ("record", "checkpoint")}
    if args.checkpoint is not None:
        given["checkpoint"] = args.checkpoint
    if "weights" in given:
        given["weights"] = parse_weights(given["weights"])
    given["options"] = {
        name: getattr(args, f"option_{name}")
        for name in known_options()
        if hasattr(args, f"option_{name}")
    }
    return given


def _setup(args: argparse.Namespace, before: Setup | None) -> Setup:
    """The setup of a new run, or of one that goes on with what it began with."""
    given = _asked(args)
    options = given.pop("options")
    name = before.domain if before is not None else given.get("domain", Setup.domain)
    default = Path(f"{load(name).defaults.files or name}.rrd")
    given["record"] = None if args.no_record else args.record or default
    if before is not None:
        return _resumed(given, options, before, args)
    if given.get("expert") == "suboptimal":
        given.setdefault("mode", "minimise")
    if args.checkpoint is None and given["record"] is not None:
        given["checkpoint"] = given["record"].with_suffix(".checkpoint.npz")
    return Setup(**given, options=options)


def _resumed(
    given: dict[str, Any], options: Mapping[str, Any], before: Setup, args: argparse.Namespace
) -> Setup:
    other = {*given, *options} - set(ALSO_WHEN_RESUMED)
    if other:
        flags = " and ".join(map(_flag, sorted(other)))
        raise InvalidInputError(f"a resumed run keeps its settings; leave out {flags}")
    return replace(before, **{**given, "checkpoint": args.checkpoint or args.resume})
