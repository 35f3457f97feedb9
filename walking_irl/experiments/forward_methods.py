"""Table 2.1: the forward methods measured on a gridworld and on the LQR."""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.lqr import LQR
from walking_irl.domains.mdp.gridworld import Gridworld
from walking_irl.errors import SolverError
from walking_irl.experiments import forward_grid, forward_lqr
from walking_irl.experiments.picture import Loss, loss_chart
from walking_irl.experiments.runner import Runner
from walking_irl.experiments.table import Table, machine
from walking_irl.rl.registry import FINITE, LINEAR_QUADRATIC, METHODS
from walking_irl.rl.tabular import loss

COLUMNS = (
    "world",
    "method",
    "needs",
    "transitions",
    "evaluations",
    "loss",
    "CPU [s]",
    "guarantee",
)
CAPTION = "loss, median over seeds, from the smallest to the largest; 0.0001 and less look alike"
NOTES = (
    "Loss on the gridworld: share of the way from the best policy (0) to a uniformly random one "
    "(1), by exact evaluation. Loss on the LQR: relative to the best gains' cost. Median over "
    "seeds, smallest to largest in brackets; every seed draws other weights.",
    "Transitions are what a method samples; methods that read the model sample none, and searches "
    "evaluate policies exactly.",
    "Every set-up was fixed on weights of other seeds; see walking_irl/experiments/forward_*.py.",
    "On the gridworld values have 49 radial basis functions (per action for LSPI), policies of "
    "gradients 37 features per action and of searches 17: 148 and 68 parameters.",
)
TOO_MANY = (
    "approximate value iteration maximises over every combination of gains on a grid, and on this "
    "LQR there are too many"
)


@dataclass(frozen=True)
class Config:
    """Settings.

    Attributes:
        axes: Sizes of the LQR.
        methods: Names of the registry of forward methods.
        seeds: Weights per cell.
    """

    axes: tuple[int, ...] = (3, 8)
    methods: tuple[str, ...] = tuple(METHODS)
    seeds: int = 3


@dataclass(frozen=True)
class ForwardJob:
    """One forward method on one world with weights of one seed.

    Attributes:
        method: Name in the registry of forward methods.
        axes: Of the LQR; 0 for the gridworld.
        seed: Of weights and samples.
    """

    method: str
    axes: int
    seed: int

    def key(self) -> dict[str, Any]:
        """The job as JSON types."""
        return {"kind": "forward method", **asdict(self)}

    @property
    def cost(self) -> float:
        """Seconds that it takes, roughly: searches and gradients evaluate thousands of policies."""
        return 0.0 if self.axes or "model" in METHODS[self.method].needs else 5.0

    def run(self) -> dict[str, Any]:
        """Loss, transitions, evaluations and seconds; or the error that ended it."""
        rng = np.random.default_rng([self.seed, 21])
        try:
            return self._grid(rng) if self.axes == 0 else self._lqr(rng)
        except SolverError as problem:  # one seed that fails must not lose the table
            return {"error": str(problem)}

    def _grid(self, rng: np.random.Generator) -> dict[str, Any]:
        mdp = Gridworld(16, 3).mdp
        w = rng.dirichlet(np.full(mdp.n_objectives, 0.3))  # a few regions matter
        start = time.process_time()
        solved = forward_grid.SOLVERS[self.method](mdp, w, rng)
        seconds = time.process_time() - start
        return _outcome(loss(mdp, mdp.reward(w), solved.policy), solved, seconds)

    def _lqr(self, rng: np.random.Generator) -> dict[str, Any]:
        problem = LQR(self.axes)
        w = rng.dirichlet(np.ones(self.axes))
        start = time.process_time()
        solved = forward_lqr.SOLVERS[self.method](problem, w, rng)
        seconds = time.process_time() - start
        best = float(w @ problem.evaluate(problem.gains(w)))
        lost = (best - float(w @ problem.evaluate(solved.gains))) / abs(best)
        return _outcome(lost, solved, seconds)


def _outcome(
    lost: float, solved: forward_grid.Solved | forward_lqr.Solved, seconds: float
) -> dict[str, Any]:
    return {
        "loss": max(0.0, lost),  # rounding
        "transitions": solved.samples,
        "evaluations": solved.evaluations,
        "seconds": seconds,
        "error": None,
    }


def table_2_1(config: Config, runner: Runner) -> Table:
    """Every forward method on every world where it can run."""
    cells, jobs, notes = [], [], list(NOTES)
    for axes in (0, *config.axes):
        for name in config.methods:
            method = METHODS[name]
            if (LINEAR_QUADRATIC if axes else FINITE) not in method.worlds:
                continue
            reason = _why_not(name, method.extra, axes)
            if reason:
                notes.append(f"n/a for {name} ({_world(axes)}): {reason}")
            else:
                jobs += [ForwardJob(name, axes, s) for s in range(config.seeds)]
            cells.append((axes, name, reason))
    outcomes = iter(runner.outcomes("2.1", jobs))
    rows, bars, raw = [], [], []
    for axes, name, reason in cells:
        part = [] if reason else [next(outcomes) for _ in range(config.seeds)]
        rows.append(_row(axes, name, part))
        losses = [o["loss"] for o in part if not o["error"]]
        if losses:
            middle = float(np.median(losses))
            bars.append(Loss(_world(axes), name, middle, min(losses), max(losses)))
        raw += [{"world": _world(axes), "method": name, "seed": s, **o} for s, o in enumerate(part)]
        errors = [o["error"] for o in part if o["error"]]
        if errors:
            notes.append(f"{name} failed on {len(errors)} seeds, first: {errors[0]}")
    title = "forward methods on a gridworld (16 x 16, K = 9) and on the LQR"
    header = {"seeds": config.seeds, **machine()}
    chart = loss_chart(f"Table 2.1: {title}", bars, CAPTION)
    return Table("2.1", title, COLUMNS, tuple(rows), tuple(notes), header, tuple(raw), chart)


def _world(axes: int) -> str:
    return f"LQR, {axes} axes" if axes else "gridworld"


def _why_not(name: str, extra: str, axes: int) -> str:
    """Why a method cannot run on a world, or nothing."""
    if extra and importlib.util.find_spec(extra) is None:
        return f"it needs the package {extra}: pip install 'walking-irl[methods]'"
    if axes and name.startswith("approximate") and not forward_lqr.can_enumerate(LQR(axes)):
        return TOO_MANY
    return ""


def _row(axes: int, name: str, outcomes: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    method = METHODS[name]
    found = [o for o in outcomes if not o["error"]]
    measured = ["n/a"] * 4
    if found:
        measured = [
            _count([o["transitions"] for o in found]),
            _count([o["evaluations"] for o in found]),
            _spread(np.array([o["loss"] for o in found])),
            f"{np.median([o['seconds'] for o in found]):.2g}",
        ]
    return (_world(axes), name, method.needs, *measured, method.guarantee)


def _count(values: Sequence[int]) -> str:
    return f"{int(np.median(values))}" if any(values) else "-"


def _spread(values: Array) -> str:
    middle = f"{_short(float(np.median(values)))}"
    if len(values) == 1:
        return middle
    return f"{middle} ({_short(float(values.min()))}..{_short(float(values.max()))})"


def _short(value: float) -> str:
    """Two digits; what is below rounding counts as 0."""
    return "0" if value < 1e-12 else f"{value:.2g}"
