"""``walking-irl recover``: one recovery, its progress and its result in the terminal."""

from __future__ import annotations

import argparse
import io
from dataclasses import fields, replace
from pathlib import Path
from typing import Self

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

from walking_irl.cli import DONE, FAILED, INTERRUPTED
from walking_irl.cli.weights import parse_weights, show_weights
from walking_irl.cpirl.summary import Summary, noise_level, per_unit, volume_left
from walking_irl.domains import load
from walking_irl.errors import InvalidInputError
from walking_irl.files import check_ending, check_outputs, write_file
from walking_irl.run import session
from walking_irl.run.case import Case, Setup
from walking_irl.run.checkpoint import load_run
from walking_irl.run.report import Report, write_json
from walking_irl.types import Iteration, Rollout, Rule


def run(args: argparse.Namespace, console: Console) -> int:
    """``walking-irl recover``."""
    saved = None if args.resume is None else load_run(args.resume)
    setup = _setup(args, None if saved is None else saved.setup)
    check_ending(setup.record, ".rrd")
    check_ending(setup.archive, ".npz")
    walks = None
    if setup.record is not None and setup.domain.startswith("humanoid"):
        walks = setup.record.with_suffix(".npz")
    outputs = [setup.record, walks, setup.archive, args.json]
    check_outputs(outputs, inputs=[setup.demonstration])
    if args.resume is not None:  # its archive goes on in the same file
        check_outputs([setup.record, walks, args.json], inputs=[args.resume])
    load(setup.domain)
    if not args.quiet:
        source = "solving for" if saved is None else f"{args.resume} knows"
        console.print(f"{setup.domain}: {source} the expert ...")
    terminal = _Terminal(setup, console, walks, len(saved.answers) if saved else 0, args.quiet)
    with session.workers() as executor, terminal:
        report = session.run(
            setup,
            saved=saved,
            executor=executor,
            on_expert=terminal.expert,
            on_iteration=terminal.iteration,
        )
    failure = report.failed_write
    if args.json is not None:  # before the terminal, whose reader may leave
        try:
            write_json(args.json, report.to_json())
        except InvalidInputError as error:
            failure = failure or error
    show_report(report, console, terminal.walks_written)
    if failure is not None:
        raise failure
    if report.was_interrupted:
        return INTERRUPTED
    return DONE if report.is_success else FAILED


class _Terminal:
    """What a person sees while a recovery runs, and the expert's walks on disk."""

    def __init__(
        self, setup: Setup, console: Console, walks: Path | None, n_known: int, is_quiet: bool
    ) -> None:
        self.setup, self.console, self.n_known, self.is_quiet = setup, console, n_known, is_quiet
        self.walks = walks
        self.walks_written: Path | None = None
        self.progress = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}"),
            BarColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=console,
            transient=True,
            disable=is_quiet or not console.is_terminal,
        )
        self.task = self.progress.add_task("solving for the expert", total=None)

    def __enter__(self) -> Self:
        self.progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.progress.stop()

    def expert(self, case: Case) -> None:
        """The expert is known."""
        total = self.setup.max_solves + 2 * len(case.domain.objectives)
        self.progress.update(self.task, total=total, completed=0, description="first solve")
        case.watch(lambda i, cost: self._say(f"solver iteration {i}, J {cost:.5f}"))
        subject = case.subject
        if self.walks is not None and subject.trajectories:
            save_walks(self.walks, subject.trajectories, case.domain.walker.joints)
            self.walks_written = self.walks
        if self.is_quiet:
            return
        if self.setup.weights is not None and subject.w_expert is not None:
            show_weights(subject.w_expert, self.console)
        n = subject.expert.n_samples
        known = f"{n} recorded walks" if n else "itself"
        again = f"; solves: {self.n_known} known from before" if self.n_known else ""
        self.console.print(f"expert ready, known by {known}; the learner starts{again}")

    def iteration(self, it: Iteration, report: Report) -> None:
        """One more forward solve is done."""
        self.progress.update(self.task, completed=it.k + 1)
        if it.rule is Rule.PROBE:
            self._say("probing the intervals")
        if not self.is_quiet:
            self.console.print(progress_line(it, report))

    def _say(self, what: str) -> None:
        self.progress.update(self.task, description=what)


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
    solver = it.response.info.get("iterations")
    detail = f", {solver} solver iterations" if solver else ""
    rule = f"{it.rule.name.lower():6s}"
    scale = abs(float(it.w @ report.expert.mu))
    return (
        f"  {it.k + 1:3d} {rule}  regret {100 * it.regret / scale:9.5f} %  "
        f"certificate {it.certificate:.1e}  widest interval {it.widest:.4f}{detail}"
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
    found = report.recovery
    console.print(f"certificate {found.certificate:.2e} (return that some mixture may lose)")
    _show_certainty(report, found, console)
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


def _show_certainty(report: Report, found: Summary, console: Console) -> None:
    """What the weights are, how sure they are, and what limits them."""
    low, high = found.bracket
    if high <= 0.0:
        console.print("no policy found beats the expert under these weights")
    else:
        span = f"{low:.1e} to {high:.1e}" if low > 0.0 else f"at most {high:.1e}"
        console.print(f"suboptimality of the expert: {span} (return, at its best weights)")
    console.print(f"weights: {found.rule}; {volume_left(found)} is left")
    if found.weakest is not None:
        console.print(
            f"least certain: {found.weakest} (condition number {found.condition_number:.0f})"
        )
    if found.gauge is not None:
        console.print(f"not identifiable: {found.gauge}")
    if any(o.scale != 1.0 for o in report.objectives):
        raw = zip(report.objectives, found.physical_intervals, strict=True)
        console.print(
            "intervals per raw unit of each cost: "
            + ", ".join(f"{o.name} {per_unit(bounds, o.unit)}" for o, bounds in raw)
        )
    console.print(f"features of the expert: {noise_level(report.expert)}")


def save_walks(path: Path, walks: tuple[Rollout, ...], joints: tuple[str, ...]) -> None:
    """Write trajectories: time (n, T), q, v (n, T, nv), u (n, T, nu), joint names."""
    arrays = {key: np.array([getattr(w, key) for w in walks]) for key in ("time", "q", "v", "u")}
    content = io.BytesIO()
    np.savez_compressed(content, joints=np.array(joints), **arrays)  # type: ignore[arg-type]
    write_file(path, content.getvalue())
