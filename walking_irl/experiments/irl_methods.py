"""Tables 3.1a and 3.1b: the inverse methods, their properties and their losses."""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.registry import EVERYWHERE, METHODS
from walking_irl.errors import WalkingIRLError
from walking_irl.experiments.irl_cases import CASES
from walking_irl.experiments.irl_setups import LINES, Line, answer
from walking_irl.experiments.picture import Loss, loss_chart, marks_chart
from walking_irl.experiments.runner import Runner
from walking_irl.experiments.table import Table, machine
from walking_irl.rl.tabular import loss

PROPERTIES = (
    "method",
    "source",
    "needs",
    "model",
    "reward",
    "program",
    "forward solves",
    "answers with",
    "guarantee",
    "worlds",
)
NOTES = (
    "Loss: share of the way from the best policy (0) to a uniformly random one (1) under the true "
    "reward, from the true start distribution; means over seeds, each with another world or "
    "other weights. The chart's error bars are one standard error.",
    "Demonstrations: 5/20/100 trajectories of 50 steps; 8/32/128 of 8 steps on Objectworld. Soft "
    "experts act by the soft-optimal policy of 20 r, on Objectworld of r.",
    "Methods that match feature expectations copy a soft expert's mistakes; those that read the "
    "actions (likelihood, PolicyWalk, GPIRL) see through them. Linear methods stop short of a "
    "reward that is not linear (Objectworld: 60 binary features).",
    "cpirl uses feature expectations and their error bars alone, with mode 'minimise': from "
    "few demonstrations of a finite world it cannot compete with methods that read the actions. "
    "Its case is a well measured expert, expensive forward solves and certificates.",
    "ng-russell-1 and -2 see the expert's complete policy, which a soft expert has not.",
    "maxent, algorithm 1 follows what is no gradient where the world is stochastic; the path "
    "measure lets an agent choose the outcome of chance.",
)
CAPTION = "mean loss and standard error; with the largest number of demonstrations"


THINNED = {
    "gridworld": ("mmp-boost", "maxent, algorithm 1", "policywalk", "gpirl"),
    "Objectworld": ("mmp", "policywalk", "kelley", "cpirl", "cpirl-actions"),
}
FEW = {"Objectworld": ("mmp", "cpirl", "cpirl-actions")}
"""Rows whose cells take 3 to 20 seconds there: 60 binary features, 120 with their negatives."""


class Setting(NamedTuple):
    """A column of table 3.1b."""

    world: str
    is_soft: bool
    counts: tuple[int, ...]

    @property
    def label(self) -> str:
        """Heading."""
        return f"{self.world}, {'soft' if self.is_soft else 'hard'}"


@dataclass(frozen=True)
class Config:
    """Settings of table 3.1b.

    Attributes:
        settings: Columns: world, kind of expert, numbers of trajectories.
        lines: Labels of the rows.
        thinned: By world, rows that are run with the middle number of trajectories only, and not
            in columns that have only one.
        few: By world, rows that are run on the first ``few_seeds`` experts only.
        few_seeds: How many those are.
        seeds: Experts per cell.
    """

    settings: tuple[Setting, ...] = (
        Setting("random MDP", False, (5, 20, 100)),
        Setting("random MDP", True, (5, 20, 100)),
        Setting("gridworld", False, (5, 20, 100)),
        Setting("gridworld", True, (5, 20, 100)),
        Setting("Objectworld", False, (32,)),
        Setting("Objectworld", True, (8, 32, 128)),
    )
    lines: tuple[str, ...] = tuple(LINES)
    thinned: Mapping[str, tuple[str, ...]] = field(default_factory=lambda: dict(THINNED))
    few: Mapping[str, tuple[str, ...]] = field(default_factory=lambda: dict(FEW))
    few_seeds: int = 3
    seeds: int = 10


@dataclass(frozen=True)
class MethodJob:
    """One method on one case.

    Attributes:
        line: Label of the row.
        world: Key of the cases.
        is_soft: Whether the expert is.
        n: Number of trajectories.
        seed: Of world, expert and method.
    """

    line: str
    world: str
    is_soft: bool
    n: int
    seed: int

    def key(self) -> dict[str, Any]:
        """The job as JSON types."""
        return {"kind": "inverse method", **asdict(self)}

    @property
    def cost(self) -> float:
        """Seconds that it takes, roughly."""
        if self.line in FEW.get(self.world, ()):
            return 10.0
        return 2.0 if self.line in THINNED.get(self.world, ()) else 0.0

    def run(self) -> dict[str, Any]:
        """Loss, correlation of rewards, CPU seconds and solves; or the error that ended it."""
        case = CASES[self.world](self.is_soft, self.n, self.seed)
        rng = np.random.default_rng([self.seed, 41])
        start = time.process_time()
        try:
            found = answer(LINES[self.line], case, rng)
        except WalkingIRLError as problem:  # one seed that fails must not lose the table
            return {"error": str(problem)}
        seconds = time.process_time() - start
        return {
            "loss": max(0.0, loss(case.mdp, case.reward, found.policy)),
            "correlation": _correlation(found.reward, case.reward),
            "seconds": seconds,
            "solves": found.info.get("solves"),
            "error": None,
        }


def _correlation(found: Array | None, true: Array) -> float | None:
    """Of two rewards over states; None where there is none or it is constant."""
    if found is None or np.ptp(found) <= 1e-12 * max(1.0, float(np.abs(found).max())):
        return None
    return float(np.corrcoef(found, true)[0, 1])


@dataclass(frozen=True)
class Listing:
    """Settings of table 3.1a: there is nothing to set, and nothing is drawn.

    Attributes:
        seeds: Without effect.
    """

    seeds: int = 1


def table_3_1a(config: Listing, runner: Runner) -> Table:
    """Properties of the methods, from their registry."""
    rows = []
    for m in METHODS.values():
        model = "yes" if m.needs_model else "no"
        reward = "linear" if m.is_linear else "any"
        rest = (m.program, m.solves, m.answer, m.guarantee, ", ".join(m.worlds))
        rows.append((m.name, m.source, m.needs.value, model, reward, *rest))
    title = "inverse methods and their properties"
    marks = [(m.name, [world in m.worlds for world in EVERYWHERE]) for m in METHODS.values()]
    chart = marks_chart(f"Table 3.1a: {title}", EVERYWHERE, marks, "where each method runs")
    notes = ("model: whether it needs the transition probabilities, not only a solver.",)
    return Table("3.1a", title, PROPERTIES, tuple(rows), notes, machine(), chart=chart)


class Cell(NamedTuple):
    """One method on one setting with one number of trajectories."""

    line: str
    setting: Setting
    n: int

    def jobs(self, config: Config) -> list[MethodJob]:
        """One for each seed."""
        world, is_soft, _ = self.setting
        is_few = self.line in config.few.get(world, ())
        seeds = min(config.few_seeds, config.seeds) if is_few else config.seeds
        return [MethodJob(self.line, world, is_soft, self.n, s) for s in range(seeds)]


def table_3_1b(config: Config, runner: Runner) -> Table:
    """Losses of the methods on finite worlds."""
    cells = [
        Cell(label, setting, n)
        for label in config.lines
        for setting in config.settings
        for n in counts(LINES[label], setting, config.thinned.get(setting.world, ()))
    ]
    jobs = [job for cell in cells for job in cell.jobs(config)]
    outcomes = runner.outcomes("3.1b", jobs)
    rest = iter(outcomes)
    found = {cell: [next(rest) for _ in cell.jobs(config)] for cell in cells}
    rows = [_row(label, config, found) for label in config.lines]
    title = "inverse methods on finite worlds, loss"
    columns = ("method", *(_heading(s) for s in config.settings), "CPU [s]")
    raw = tuple({**job.key(), **o} for job, o in zip(jobs, outcomes, strict=True))
    chart = loss_chart(f"Table 3.1b: {title}", _bars(config, found), CAPTION)
    header = {"seeds": config.seeds, **machine()}
    notes = (*NOTES, *_gaps(config, found))
    return Table("3.1b", title, columns, tuple(rows), notes, header, raw, chart)


def counts(line: Line, setting: Setting, thinned: Sequence[str]) -> tuple[int, ...]:
    """Numbers of trajectories that a row is run with in a column; none where it cannot run."""
    if _missing(line) or (line.is_complete and setting.is_soft):
        return ()
    if line.is_complete or not line.method:
        return setting.counts[-1:]  # they see no trajectories
    if line.label in thinned:
        if len(setting.counts) == 1:
            return ()
        return (setting.counts[len(setting.counts) // 2],)
    return setting.counts


def _missing(line: Line) -> str:
    """What must be installed before a row can run, or nothing."""
    extra = METHODS[line.method].extra if line.method else ""
    if extra and importlib.util.find_spec("sklearn") is None:
        return f"it needs an optional package: pip install 'walking-irl[{extra}]'"
    return ""


def _heading(setting: Setting) -> str:
    return f"{setting.label} ({'/'.join(map(str, setting.counts))})"


def _row(label: str, config: Config, found: dict[Cell, list[dict[str, Any]]]) -> tuple[str, ...]:
    """Mean losses by setting, and the range of CPU seconds."""
    texts, seconds = [], []
    for setting in config.settings:
        own = [found[c] for c in found if c.line == label and c.setting == setting]
        texts.append("/".join(_mean(part) for part in own) or "n/a")
        seconds += [o["seconds"] for part in own for o in part if not o["error"]]
    cost = f"{min(seconds):.2g}..{max(seconds):.2g}" if seconds else "n/a"
    return (label, *texts, cost)


def _mean(outcomes: Sequence[dict[str, Any]]) -> str:
    losses = [o["loss"] for o in outcomes if not o["error"]]
    return f"{np.mean(losses):.3f}" if losses else "n/a"


def _bars(config: Config, found: dict[Cell, list[dict[str, Any]]]) -> list[Loss]:
    """Loss with the most demonstrations that a row was run with, setting by setting."""
    bars = []
    for setting in config.settings:
        last = {c.line: part for c, part in found.items() if c.setting == setting}
        for label, part in last.items():
            losses = np.array([o["loss"] for o in part if not o["error"]])
            if losses.size:
                error = losses.std(ddof=1) / np.sqrt(losses.size) if losses.size > 1 else 0.0
                mean = float(losses.mean())
                bars.append(Loss(setting.label, label, mean, mean - error, mean + error))
    return bars


def _gaps(config: Config, found: dict[Cell, list[dict[str, Any]]]) -> Iterator[str]:
    """Why cells are empty, thinned or incomplete."""
    for world in dict.fromkeys(s.world for s in config.settings):
        thinned = [label for label in config.thinned.get(world, ()) if label in config.lines]
        few = [label for label in config.few.get(world, ()) if label in config.lines]
        if thinned:
            yield (
                f"{world}: {', '.join(thinned)} with the middle number of trajectories only, and "
                "not where there is only one (n/a)."
            )
        if few:
            seeds = min(config.few_seeds, config.seeds)
            yield f"{world}: {', '.join(few)} on the first {seeds} seeds only (3 to 20 s a cell)."
    for label in config.lines:
        if reason := _missing(LINES[label]):
            yield f"n/a for {label}: {reason}"
        errors = [o["error"] for c in found if c.line == label for o in found[c] if o["error"]]
        if errors:
            yield f"{label} failed on {len(errors)} cases, first: {errors[0]}"
