"""What the commands do; each takes parsed arguments and a console, and returns an exit code."""

from __future__ import annotations

import argparse
import io
import os
import sys
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.progress import (
    BarColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from walking_irl.case import Case, Setup
from walking_irl.domains import DOMAINS, load
from walking_irl.errors import InvalidInputError
from walking_irl.output import check_ending, check_outputs, write_file
from walking_irl.report import Report, write_json
from walking_irl.saved_run import load_run
from walking_irl.session import run, workers
from walking_irl.types import Array, Iteration, Rollout, Rule

INTERRUPTED = 130
SCREENS = ("DISPLAY", "WAYLAND_DISPLAY")


def parse_weights(text: str) -> tuple[float, ...]:
    """Weights from the command line.

    >>> parse_weights("1,2.5")
    (1.0, 2.5)
    """
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError as error:
        raise InvalidInputError(
            f"weights must be numbers separated by commas, got {text!r}"
        ) from error


def show_weights(w: Array, console: Console) -> None:
    """Say how weights were understood."""
    console.print("weights normalised to sum 1: " + ", ".join(f"{v:.4f}" for v in w))


def recover(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl recover``."""
    saved = None if args.resume is None else load_run(args.resume)
    setup = _setup(args, None if saved is None else saved.setup)
    check_ending(setup.record, ".rrd")
    check_ending(setup.archive, ".npz")
    walks = None if setup.record is None else setup.record.with_suffix(".npz")
    check_outputs([setup.record, walks, setup.archive, args.json])
    load(setup.domain)

    written: list[Path] = []

    progress = Progress(
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
        transient=True,
        disable=args.quiet or not console.is_terminal,
    )
    task = progress.add_task("solving for the expert", total=None)

    def on_expert(case: Case) -> None:
        total = setup.max_solves + 2 * len(case.domain.objectives)
        progress.update(task, total=total, completed=0, description="first solve")
        case.watch(
            lambda i, cost: progress.update(task, description=f"solver iteration {i}, J {cost:.5f}")
        )
        if walks is not None and case.subject.trajectories:
            save_walks(walks, case.subject.trajectories, case.domain.walker.joints)
            written.append(walks)
        if not args.quiet:
            subject = case.subject
            if setup.weights is not None and subject.w_expert is not None:
                show_weights(subject.w_expert, console)
            n = subject.expert.n_samples
            known = f"{n} recorded walks" if n else "itself"
            again = "" if saved is None else f"; solves: {len(saved.answers)} known from before"
            console.print(f"expert ready, known by {known}; the learner starts{again}")

    def on_iteration(it: Iteration, report: Report) -> None:
        progress.update(task, completed=it.k + 1)
        if it.rule is Rule.PROBE:
            progress.update(task, description="probing the intervals")
        if not args.quiet:
            console.print(progress_line(it, report))

    if not args.quiet:
        source = "solving for" if saved is None else f"{args.resume} knows"
        console.print(f"{setup.domain}: {source} the expert ...")
    with workers() as executor, progress:
        report = run(
            setup,
            saved=saved,
            executor=executor,
            on_expert=on_expert,
            on_iteration=on_iteration,
        )
    show_report(report, console, written[0] if written else None)
    if args.json is not None:
        write_json(args.json, report.to_json())
    if report.failed_write is not None:
        raise report.failed_write
    if report.was_interrupted:
        return INTERRUPTED
    return 0 if report.is_success else 1


def _setup(args: argparse.Namespace, before: Setup | None) -> Setup:
    """The setup of a new run, or of one that goes on with what it began with."""
    given = {f.name: getattr(args, f.name) for f in fields(Setup) if hasattr(args, f.name)}
    given["record"] = None if args.no_record else args.record
    if before is None:
        if "weights" in given:
            given["weights"] = parse_weights(given["weights"])
        if given.get("expert") == "suboptimal":
            given.setdefault("mode", "minimise")
        if args.archive is None and given["record"] is not None:
            given["archive"] = given["record"].with_suffix(".archive.npz")
        return Setup(**given)
    other = given.keys() - {"record", "archive", "max_solves"}
    if other:
        options = " and ".join("--" + name.replace("_", "-") for name in sorted(other))
        raise InvalidInputError(f"a resumed run keeps its settings; leave out {options}")
    given["archive"] = args.archive or args.resume
    return replace(before, **given)


def progress_line(it: Iteration, report: Report) -> str:
    """One line on an iteration."""
    width = float(np.diff(it.intervals).max())
    solver = it.response.info.get("iterations")
    detail = f", {solver} solver iterations" if solver else ""
    rule = f"{it.rule.name.lower():6s}"
    scale = abs(float(it.w @ report.expert.mu))
    return (
        f"  {it.k + 1:3d} {rule}  regret {100 * it.regret / scale:9.5f} %  "
        f"certificate {it.certificate:.1e}  widest interval {width:.4f}{detail}"
    )


def show_report(report: Report, console: Console, walks: Path | None) -> None:
    """Print the table of weights and the figures below it."""
    table = Table(
        title=f"What the {report.domain} walks for" if "humanoid" in report.domain else None
    )
    table.add_column("objective")
    hidden = report.w_expert
    if hidden is not None:
        table.add_column("hidden", justify="right")
    table.add_column("recovered", justify="right")
    table.add_column("interval", justify="right")
    for j, objective in enumerate(report.objectives):
        low, high = report.last.intervals[j]
        cells = [objective.name, *([] if hidden is None else [f"{hidden[j]:.4f}"])]
        table.add_row(*cells, f"{report.w[j]:.4f}", f"{low:.4f} .. {high:.4f}")
    console.print(table)
    out = report.to_json()
    console.print(f"ended: {report.status}")
    console.print(f"certificate {report.last.certificate:.2e} (return that some mixture may lose)")
    found = report.recovery
    low, high = found.bracket
    span = f"{low:.1e} to {high:.1e}" if low > 0.0 else f"at most {high:.1e}"
    console.print(f"the expert is suboptimal by {span} (return, under its most favourable weights)")
    if found.weakest is not None:
        console.print(
            f"least certain: {found.weakest} (condition number {found.condition_number:.0f})"
        )
    if found.gauge is not None:
        console.print(f"not identifiable: {found.gauge}")
    if report.l1_error is not None:
        inside = "inside" if report.contains_expert else "NOT inside"
        console.print(f"L1 error {report.l1_error:.5f}; hidden weights {inside} the intervals")
    loss = report.relative_loss(report.recovered_mu)
    if loss is not None:
        console.print(f"loss of the recovered policy under the hidden weights {100 * loss:.5f} %")
    seconds = ", ".join(f"{k} {v:.1f}" for k, v in report.seconds.items())
    console.print(f"{out['forward_solves']} forward solves + {out['probe_solves']} probes")
    console.print(f"seconds: {seconds}")
    if report.recording is not None:
        console.print(f"recording {escape(report.recording)}: walking-irl view {report.recording}")
    if walks is not None:
        console.print(f"the expert's walks: {escape(str(walks))}")
    if report.archive is not None and not report.is_success:
        path = escape(report.archive)
        console.print(f"to go on from here: walking-irl recover --resume {path} --max-solves N")


def save_walks(path: Path, walks: tuple[Rollout, ...], joints: tuple[str, ...]) -> None:
    """Write trajectories: time (n, T), q, v (n, T, nv), u (n, T, nu), joint names."""
    arrays = {key: np.array([getattr(w, key) for w in walks]) for key in ("time", "q", "v", "u")}
    content = io.BytesIO()
    np.savez_compressed(content, joints=np.array(joints), **arrays)  # type: ignore[arg-type]
    write_file(path, content.getvalue())


def gait(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl gait``."""
    from walking_irl.domains.humanoid.domain import Humanoid
    from walking_irl.domains.humanoid.files import save_gait
    from walking_irl.domains.humanoid.forward import check_weights
    from walking_irl.domains.humanoid.realism import figures

    check_ending(args.save, ".npz", ".csv")
    check_ending(args.record, ".rrd")
    check_ending(args.png, ".png")
    check_outputs([args.save, args.record, args.png, args.json])
    if not (np.isfinite(args.seconds) and args.seconds > 0):
        raise InvalidInputError(f"seconds must be a positive number, got {args.seconds}")
    domain = load(args.domain)
    if not isinstance(domain, Humanoid):
        raise InvalidInputError(f"gait needs humanoid or humanoid-planar, got {args.domain!r}")
    given = parse_weights(args.weights)
    w = check_weights(np.array(given))
    if not args.quiet:
        show_weights(w, console)
    with workers() as executor:
        response = domain.forward(w, executor)
    found = response.policy
    content = {
        "objectives": [o.name for o in domain.objectives],
        "w": w.tolist(),
        "mu": response.mu.tolist(),
        **figures(domain.walker, found),
        "solver": dict(response.info),
    }
    if args.save is not None:
        save_gait(args.save, found, domain.walker)
    if args.png is not None:
        from walking_irl.domains.humanoid.render import strip

        write_file(args.png, png(strip(domain.walker, found)))
    if args.record is not None:
        _record_walk(args.record, domain, found, args.seconds, w)
    if args.json is not None:
        write_json(args.json, content)
    if not args.quiet:
        _show_gait(content, console)
    return 0


def png(picture: Any) -> bytes:
    """A picture (height, width, 3) as the content of a PNG file."""
    from PIL import Image

    content = io.BytesIO()
    Image.fromarray(picture).save(content, format="PNG", optimize=True)
    return content.getvalue()


def _record_walk(path: Path, domain: Any, found: Any, seconds: float, w: Array) -> None:
    """Closed-loop walk of a gait at half the knot timestep, as a recording."""
    from walking_irl.domains.humanoid.policy import tracking_policy
    from walking_irl.domains.humanoid.rollout import rollout
    from walking_irl.recording import record_motion
    from walking_irl.recording.gait_view import WalkerView

    policy = tracking_policy(domain.walker, found, substeps=2)
    walked = rollout(domain.walker, policy, seconds=seconds)
    rows = [f"| {o.name} | {v:.4f} |" for o, v in zip(domain.objectives, w, strict=True)]
    text = "\n".join(["| objective | weight |", "|---|---|", *rows])
    record_motion(path, WalkerView(domain.walker.model), walked, title=domain.name, text=text)


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
    console.print(table)


def tables(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl tables``."""
    from walking_irl.experiments import run_tables

    def progress(name: str, done: int, total: int) -> None:
        if not args.quiet:
            console.print(f"table {name}: {done} of {total} runs")

    with workers() as executor:
        paths = run_tables(
            args.names, seeds=args.seeds, out=args.out, executor=executor, progress=progress
        )
    for path in paths:
        console.print(escape(str(path)))
    return 0


def inspect(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl inspect``."""
    from walking_irl.recording.reader import inspect_recording

    check_outputs([args.json])
    content = inspect_recording(args.file)
    if args.json is not None:
        write_json(args.json, content)
    console.print(_table_of_recording(content))
    for key in (
        *("domain", "seed", "centre", "mode", "status", "ending", "rule", "certificate"),
        *("bracket", "volume_ratio", "condition_number", "weakest", "gauge", "noise"),
    ):
        if content[key] is not None:
            console.print(f"{key.replace('_', ' ')}: {escape(_short(content[key]))}")
    console.print(f"iterations: {content['iterations']}, frames: {content['frames']}")
    console.print(f"timelines: {', '.join(content['timelines'])}")
    console.print(f"{len(content['entities'])} entities:")
    for entity in content["entities"]:
        console.print(f"  {escape(entity)}")
    return 0


def _table_of_recording(content: dict[str, Any]) -> Table:
    from walking_irl.recording.summary import per_unit

    table = Table("objective", "hidden", "recovered", "interval", "per raw unit")
    hidden, found, bounds = content["w_expert"], content["w"], content["intervals"]
    for j, name in enumerate(content["objectives"] or []):
        table.add_row(
            str(name),
            "unknown" if hidden is None else f"{hidden[j]:.4f}",
            "-" if found is None else f"{found[j]:.4f}",
            "-" if bounds is None else f"{bounds[j][0]:.4f} .. {bounds[j][1]:.4f}",
            "-"
            if content["physical_intervals"] is None
            else per_unit(content["physical_intervals"][j], content["units"][j]).replace(
                " per ", "\nper "
            ),
        )
    return table


def _short(value: Any) -> str:
    """A value of a recording, with few digits."""
    if isinstance(value, list):
        return ", ".join(_short(v) for v in value)
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def view(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl view``."""
    from walking_irl.recording.screenshot import open_viewer, save_screenshot

    if args.png is None:
        if sys.platform.startswith("linux") and not any(map(os.environ.get, SCREENS)):
            raise InvalidInputError(
                "there is no screen for the viewer; render a picture with --png FILE.png, or copy "
                "the file to a machine with a screen"
            )
        open_viewer(args.file)
        console.print("the viewer is opening; move the frame slider to play")
    else:
        check_ending(args.png, ".png")
        check_outputs([args.png])
        save_screenshot(args.file, args.png, frame=args.frame)
        console.print(f"wrote {escape(str(args.png))}")
    return 0


def domains(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl domains``."""
    table = Table("domain", "world", "objectives", "solved by")
    for name, entry in DOMAINS.items():
        objectives = ", ".join(o.name for o in entry.make().objectives)
        table.add_row(name, entry.world, objectives, entry.solver)
    console.print(table)
    return 0
