"""What a person sees of a recovery: its progress, then the table of weights and the figures."""

from __future__ import annotations

from pathlib import Path
from typing import Self

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

from walking_irl.cli.weights import show_weights
from walking_irl.cpirl.summary import (
    Summary,
    estimate_name,
    noise_level,
    per_unit,
    volume_left,
)
from walking_irl.files import write_arrays
from walking_irl.run.problem import Problem
from walking_irl.run.report import Report, progress_line
from walking_irl.types import Iteration, Rule

NO_GAIN = 1e-6
"""Share of the return by which a solver may beat another by chance."""


class Terminal:
    """What a person sees while a recovery runs, and the expert's rollouts on disk.

    Args:
        console: The terminal.
        rollouts: Where the expert's rollouts go, or None.
        n_known: Solves that are known from before.
        is_quiet: Whether only the result is shown.
    """

    def __init__(
        self, console: Console, rollouts: Path | None, n_known: int, is_quiet: bool
    ) -> None:
        self.console, self.n_known, self.is_quiet = console, n_known, is_quiet
        self.rollouts = rollouts
        self.rollouts_written: Path | None = None
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

    def expert(self, problem: Problem) -> None:
        """The expert is known."""
        total = problem.max_solves + 2 * len(problem.objectives)
        self.progress.update(self.task, total=total, completed=0, description="first solve")
        recorded = problem.demonstration.trajectories
        if self.rollouts is not None and recorded:
            write_arrays(self.rollouts, problem.domain.pack_trajectories(recorded))
            self.rollouts_written = self.rollouts
        if self.is_quiet:
            return
        if problem.setup.weights is not None and problem.w_expert is not None:
            show_weights(problem.w_expert, self.console)
        n = problem.expert.n_samples
        known = f"{n} recorded rollouts" if n else "itself"
        again = f"; solves: {self.n_known} known from before" if self.n_known else ""
        self.console.print(f"expert ready, known by {known}; the learner starts{again}")

    def step(self, i: int, cost: float) -> None:
        """One more iteration of the learner's solver is done."""
        self._say(f"solver iteration {i}, J {cost:.5f}")

    def iteration(self, it: Iteration, report: Report) -> None:
        """One more forward solve is done."""
        self.progress.update(self.task, completed=it.k + 1)
        if it.rule is Rule.PROBE:
            self._say("probing the intervals")
        if not self.is_quiet:
            self.console.print(progress_line(it, report))

    def _say(self, what: str) -> None:
        self.progress.update(self.task, description=what)


def show_report(report: Report, console: Console, rollouts: Path | None) -> None:
    """Print the table of weights and the figures below it."""
    console.print(_weights_table(report))
    out = report.to_json()
    console.print(f"ended: {report.status}")
    found = report.summary
    console.print(f"certificate {found.certificate:.2e} (return that some mixture may lose)")
    _show_certainty(report, found, console)
    if report.l1_error is not None:
        inside = "inside" if report.contains_expert else "NOT inside"
        console.print(
            f"L1 error {report.l1_error:.5f}; ground-truth weights {inside} the intervals"
        )
    _show_loss(report, console)
    seconds = ", ".join(f"{k} {v:.1f}" for k, v in report.seconds.items())
    console.print(f"{out['forward_solves']} forward solves + {out['probe_solves']} probes")
    console.print(f"seconds: {seconds}")
    if report.recording is not None:
        console.print(f"recording {escape(report.recording)}: walking-irl view {report.recording}")
    if rollouts is not None:
        console.print(f"the expert's rollouts: {escape(str(rollouts))}")
    if report.checkpoint is not None and not report.is_success:
        path = escape(report.checkpoint)
        console.print(f"to go on from here: walking-irl recover --resume {path} --max-solves N")


def _show_loss(report: Report, console: Console) -> None:
    """What the recovered policy loses, and whether the learner knows a better one than the expert.

    Both under the ground-truth weights.
    """
    loss, gain = report.relative_loss(report.recovered_mu), report.beaten_by
    if loss is not None:
        console.print(
            f"loss of the recovered policy, ground-truth weights: {100 * max(loss, 0.0):.5f} %"
        )
    if gain is not None and gain > NO_GAIN:
        console.print(
            f"a policy that the learner found is {100 * gain:.2g} % better than the expert's own "
            "under the ground-truth weights: the expert is not optimal for them"
        )


def _weights_table(report: Report) -> Table:
    table = Table(title=report.problem.domain.question)
    table.add_column("objective")
    truth = report.w_expert
    if truth is not None:
        table.add_column("ground truth", justify="right")
    table.add_column(estimate_name(report.summary), justify="right")
    table.add_column("interval", justify="right")
    for j, objective in enumerate(report.objectives):
        low, high = report.last.intervals[j]
        cells = [objective.name, *([] if truth is None else [f"{truth[j]:.4f}"])]
        table.add_row(*cells, f"{report.w[j]:.4f}", f"{low:.4f} .. {high:.4f}")
    return table


def _show_certainty(report: Report, found: Summary, console: Console) -> None:
    """What the weights are, how sure they are, and what limits them."""
    low, high = found.bracket
    if high <= 0.0:
        console.print("no policy found beats the expert under these weights")
    else:
        span = f"{low:.1e} to {high:.1e}" if low > 0.0 else f"at most {high:.1e}"
        console.print(f"suboptimality of the expert: {span} (return, at its best weights)")
    console.print(f"half widths: {found.how_sure}")
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
