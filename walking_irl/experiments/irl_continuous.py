"""Table 3.1c: inverse methods where states are not finitely many, on the LQR and walking paths."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.girl import girl
from walking_irl.baselines.registry import run_method
from walking_irl.baselines.relative_entropy import reweight
from walking_irl.domains.lqr import LQR
from walking_irl.domains.path.walking_path import WalkingPath
from walking_irl.errors import WalkingIRLError
from walking_irl.experiments.forward_lqr import episodes
from walking_irl.experiments.picture import Loss, loss_chart
from walking_irl.experiments.runner import Runner
from walking_irl.experiments.table import Table, machine
from walking_irl.rl.gpomdp import gpomdp
from walking_irl.types import Expert, Response

COLUMNS = ("world", "method", "|dw|", "forward solves", "CPU [s]", "effective sample size")
STABLE = (-1.0, -0.1)
"""Gains that are drawn where policies are sampled."""
NOTES = (
    "|dw|: largest error of a weight, on the simplex; mean over seeds, each with other weights.",
    "Experts are known exactly, but for girl from episodes: its gradients are GPOMDP's with "
    "baselines, from as many episodes of 100 steps with unit noise on the controls.",
    "ng-russell-2 compares the expert's control with 30 others at each of 60 states, off by h |x|; "
    "its error is about h.",
    "relative-entropy weighs 2000 random gains; its figure is honest only beside the effective "
    "sample size. Posterior and MaxEnt run over the policies that CPIRL evaluated by cuts alone, "
    "and their solves are CPIRL's.",
    "Where exact gradients are at hand girl needs no forward solve at all; noise in them is what "
    "spoils it.",
)


class Found(NamedTuple):
    """Weights on the simplex, and what they took."""

    w: Array
    solves: int
    ess: float | None = None


Solve = Callable[[Any, Expert, np.random.Generator], Found]


def _by_registry(name: str, domain: Any, expert: Expert, rng: np.random.Generator) -> Found:
    solves = 0

    def forward(w: Array) -> Response:
        nonlocal solves
        solves += 1
        answer: Response = domain.forward(w)
        return answer

    world = SimpleNamespace(
        name=domain.name, forward=forward, policy_gradient=domain.policy_gradient
    )
    found = run_method(name, world, expert, rng=rng)
    assert found.w is not None
    ess = found.info.get("effective_sample_size")
    return Found(found.w, solves, None if ess is None else float(np.min(ess)))


def _girl_from_episodes(n: int, domain: LQR, expert: Expert, rng: np.random.Generator) -> Found:
    sampled = episodes(domain, expert.demonstration, spread=1.0, n=n, horizon=100, rng=rng)
    w = girl(gpomdp(sampled, domain.discount)).w
    assert w is not None
    return Found(w, 0)


def _ng_russell_2(h: float, domain: LQR, expert: Expert, rng: np.random.Generator) -> Found:
    """Advantages over inputs that are off by h |x|."""
    found = run_method("ng-russell-2", domain, expert, rng=rng, size=h)
    assert found.w is not None
    return Found(found.w, 0)


def _relative_entropy(n: int, domain: LQR, expert: Expert, rng: np.random.Generator) -> Found:
    F = np.array([domain.evaluate(rng.uniform(*STABLE, domain.n_objectives)) for _ in range(n)])
    found = reweight(F, expert.mu, ridge=1e-6)
    w = np.maximum(found.w, 0.0)
    return Found(w / max(w.sum(), 1e-300), 0, found.n_effective)


COMMON: dict[str, Solve] = {
    "cpirl": partial(_by_registry, "cpirl"),
    "girl, exact gradients": partial(_by_registry, "girl"),
    "policywalk on CPIRL's archive": partial(_by_registry, "policywalk"),
    "mce-matching on CPIRL's archive": partial(_by_registry, "mce-matching"),
}
ON_LQR: dict[str, Solve] = {
    **COMMON,
    "girl, 30 episodes": partial(_girl_from_episodes, 30),
    "girl, 300 episodes": partial(_girl_from_episodes, 300),
    "girl, 3000 episodes": partial(_girl_from_episodes, 3000),
    "ng-russell-2, h = 1": partial(_ng_russell_2, 1.0),
    "ng-russell-2, h = 0.1": partial(_ng_russell_2, 0.1),
    "relative-entropy, 2000 gains": partial(_relative_entropy, 2000),
}
WORLDS: dict[str, tuple[Callable[[], Any], dict[str, Solve]]] = {
    "LQR, 3 axes": (partial(LQR, 3), ON_LQR),
    "LQR, 5 axes": (partial(LQR, 5), ON_LQR),
    "walking path": (partial(WalkingPath, n_intervals=12), COMMON),
}


@dataclass(frozen=True)
class Config:
    """Settings.

    Attributes:
        worlds: Keys of the worlds.
        path_seeds: Experts on walking paths, whose solves take longer.
        seeds: Experts per cell.
    """

    worlds: tuple[str, ...] = tuple(WORLDS)
    path_seeds: int = 1
    seeds: int = 5

    def n_seeds(self, world: str) -> int:
        """Experts of a world."""
        return min(self.seeds, self.path_seeds) if world == "walking path" else self.seeds


@dataclass(frozen=True)
class ContinuousJob:
    """One method on one expert.

    Attributes:
        world: Key of the worlds.
        method: Key of the world's methods.
        seed: Of weights and samples.
    """

    world: str
    method: str
    seed: int

    def key(self) -> dict[str, Any]:
        """The job as JSON types."""
        return {"kind": "inverse method, continuous", **asdict(self)}

    @property
    def cost(self) -> float:
        """Seconds that it takes, roughly."""
        return 5.0 if self.world == "walking path" else 0.0

    def run(self) -> dict[str, Any]:
        """|dw|, forward solves and CPU seconds; or the error that ended it."""
        make, solvers = WORLDS[self.world]
        domain, rng = make(), np.random.default_rng([self.seed, 51])
        w_E = 0.9 * rng.dirichlet(np.ones(len(domain.objectives))) + 0.1 / len(domain.objectives)
        expert = domain.expert(w_E, rng)
        start = time.process_time()
        try:
            found = solvers[self.method](domain, expert, rng)
        except WalkingIRLError as problem:  # one seed that fails must not lose the table
            return {"error": str(problem)}
        return {
            "dw": float(np.abs(found.w - w_E).max()),
            "solves": found.solves,
            "ess": found.ess,
            "seconds": time.process_time() - start,
            "error": None,
        }


def table_3_1c(config: Config, runner: Runner) -> Table:
    """Errors of the weights in continuous worlds."""
    cells = [(world, method) for world in config.worlds for method in WORLDS[world][1]]
    jobs = [ContinuousJob(*cell, s) for cell in cells for s in range(config.n_seeds(cell[0]))]
    outcomes = runner.outcomes("3.1c", jobs)
    rest = iter(outcomes)
    rows, bars, notes = [], [], list(NOTES)
    for world, method in cells:
        part = [next(rest) for _ in range(config.n_seeds(world))]
        good = [o for o in part if not o["error"]]
        if len(good) < len(part):
            bad = next(o["error"] for o in part if o["error"])
            notes.append(f"{method} ({world}) failed on {len(part) - len(good)} seeds: {bad}")
        rows.append((world, method, *_figures(good)))
        if good:
            errors = [o["dw"] for o in good]
            bars.append(Loss(world, method, float(np.mean(errors)), min(errors), max(errors)))
    if "walking path" in config.worlds:
        notes.append(f"walking path: {config.n_seeds('walking path')} seed, 12 intervals.")
    title = "inverse methods in continuous worlds, error of the weights"
    raw = tuple({**job.key(), **o} for job, o in zip(jobs, outcomes, strict=True))
    caption = "|dw|, mean over seeds, from the smallest to the largest"
    chart = loss_chart(f"Table 3.1c: {title}", bars, caption)
    header = {"seeds": config.seeds, **machine()}
    return Table("3.1c", title, COLUMNS, tuple(rows), tuple(notes), header, raw, chart)


def _figures(outcomes: list[dict[str, Any]]) -> tuple[str, ...]:
    if not outcomes:
        return ("n/a",) * 4
    ess = [o["ess"] for o in outcomes if o["ess"] is not None]
    return (
        f"{np.mean([o['dw'] for o in outcomes]):.2g}",
        f"{np.mean([o['solves'] for o in outcomes]):.1f}",
        f"{np.mean([o['seconds'] for o in outcomes]):.2g}",
        f"{np.mean(ess):.1f}" if ess else "-",
    )
