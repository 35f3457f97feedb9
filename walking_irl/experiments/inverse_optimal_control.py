"""Table 7.13: a gait explained as biomechanists do, by inverse optimal control, beside CPIRL."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.inverse_optimal_control import (
    bilevel_gauss_newton,
    bilevel_search,
    kkt_residual,
)
from walking_irl.cpirl import cpirl
from walking_irl.domains.humanoid.domain import MIN_WEIGHT, Humanoid, exact_expert
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.inverse_optimal_control import NearestGait, stationarity
from walking_irl.domains.humanoid.learner import solver_for
from walking_irl.domains.humanoid.spec import WalkerSpec
from walking_irl.errors import InvalidInputError, WalkingIRLError
from walking_irl.experiments.picture import Loss, loss_chart
from walking_irl.experiments.runner import Runner
from walking_irl.experiments.table import Table, machine
from walking_irl.types import Response, Status

COLUMNS = (
    "body",
    "joint noise [deg]",
    "method",
    "L1 of weights",
    "largest L1",
    "forward solves",
    "CPU [s]",
    "ended",
)
EXPERTS = 6
"""Shipped gaits of typical weights, each at its optimum."""
CPIRL_SOLVES = 20
NOTES = (
    "Experts are shipped gaits with known weights, each solved to its optimum. Noise is normal and "
    "independent in every joint angle at every knot; root and timing are exact.",
    "L1 of weights: sum of |w - w_E|, mean over seeds; even weights are at .6 to .9.",
    "KKT residual: weights and multipliers of the root forces for which the gait is nearest to "
    "stationary (Keshavarz, Wang & Boyd 2011); no forward solve. 'Made physical': of the nearest "
    "gait whose root forces vanish, found by a tethered solve, which is not counted.",
    "Bilevel: weights whose optimal gait has the joint angles nearest to the noisy ones, by COBYQA "
    "(Mombaur et al. 2010 with BOBYQA's successor) and by Gauss-Newton with the solver's dx/dw. "
    "Solves start from the gait made physical; second starts are counted.",
    "CPIRL sees the costs of the gait made physical and nothing else of it; it starts its solves "
    "there, too. DOMINATED: one gait beats the noisy one in all costs, so that it is optimal for "
    "no weights, and weights are not what the answer is.",
    "What each does better: the KKT residual is exact and all but free for an exact gait, and "
    "wrong without saying so for any other. Gauss-Newton averages noise over all angles: where "
    "trajectories are known it is the method for noisy ones; it may stall where optimal gaits "
    "jump, and finds one local minimum. The derivative-free search needs several times the "
    "solves for a coarser answer. CPIRL needs no trajectory, only mean costs, takes rollouts with "
    "error bars, bounds every weight, and says when an expert is not optimal.",
)


class Shown(NamedTuple):
    """A demonstration."""

    spec: WalkerSpec
    gait: Gait
    """With noise."""
    is_exact: bool


class Found(NamedTuple):
    """Weights, and what they took."""

    w: Array
    solves: int
    status: Status


@lru_cache(maxsize=16)
def _expert(body: str, seed: int) -> tuple[Array, Array]:
    """Ground-truth weights (K,), and the gait vector that is optimal for them."""
    known = load_library(body)[f"typical {seed}"]
    solver, x = solver_for(WalkerSpec(body)), known.gait.to_vector()
    return known.w, solver.solve(known.w, x, root=solver.dual(x)).x


def demonstration(body: str, seed: int, noise: float) -> tuple[Array, Shown]:
    """Ground-truth weights (K,) and a gait with ``noise`` [deg] on its joint angles.

    Raises:
        InvalidInputError: If there are not so many experts.
    """
    if seed >= EXPERTS:
        raise InvalidInputError(f"table 7.13 has {EXPERTS} experts, so at most as many seeds")
    spec = WalkerSpec(body)
    w_E, x = _expert(body, seed)
    gait = Gait.from_vector(x, len(spec.walker.joints))
    angles = gait.q[:, spec.walker.n_root :]
    angles += np.deg2rad(noise) * np.random.default_rng([seed, 61]).standard_normal(angles.shape)
    return w_E, Shown(spec, gait, noise == 0)


def _physical(shown: Shown) -> Gait:
    """The nearest gait that can be walked."""
    x = solver_for(shown.spec).physical(shown.gait.to_vector())
    return Gait.from_vector(x, len(shown.spec.walker.joints))


def _kkt(is_physical: bool, shown: Shown) -> Found:
    gait = _physical(shown) if is_physical else shown.gait
    found = kkt_residual(*stationarity(shown.spec, gait))
    assert found.w is not None
    return Found(found.w, 0, found.status)


def _bilevel(method: Callable[..., Any], max_solves: int, shown: Shown) -> Found:
    near = NearestGait(shown.spec, shown.gait)
    K = len(shown.spec.stack.objectives)
    found = method(near, K, max_solves=max_solves, min_weight=MIN_WEIGHT)
    return Found(found.w, near.n_solves, found.status)


def _cpirl(shown: Shown) -> Found:
    gait, domain = _physical(shown), Humanoid(shown.spec.body)
    costs = solver_for(shown.spec).problem.evaluate(gait.to_vector()).total_costs()
    expert, rng, solves = exact_expert(gait, costs), np.random.default_rng(0), 0
    learner = domain.learner(expert, {}, rng=rng)

    def counted(w: Array) -> Response:
        nonlocal solves
        solves += 1
        return learner.forward(w)

    mode: Any = "optimal" if shown.is_exact else "minimise"
    budget, least = CPIRL_SOLVES, MIN_WEIGHT
    *_, last = cpirl(counted, expert, mode=mode, max_solves=budget, min_weight=least, rng=rng)
    assert last.status is not None
    return Found(last.estimate, solves, last.status)


METHODS: dict[str, Callable[[Shown], Found]] = {
    "KKT residual, raw angles": partial(_kkt, False),
    "KKT residual, made physical": partial(_kkt, True),
    "bilevel, derivative-free": partial(_bilevel, bilevel_search, 40),
    "bilevel, Gauss-Newton": partial(_bilevel, bilevel_gauss_newton, 30),
    "CPIRL-AC + Newton": _cpirl,
}
SLOW = "bilevel, derivative-free"


@dataclass(frozen=True)
class Config:
    """Settings.

    Attributes:
        bodies: Which humanoids.
        noises: Standard deviations of joint angles [deg].
        methods: Labels of the rows.
        slow_seeds: Experts of the derivative-free search.
        body_seeds: Most experts by body.
        seeds: Experts per cell, at most six.
    """

    bodies: tuple[str, ...] = ("humanoid-planar", "humanoid")
    noises: tuple[float, ...] = (0.0, 0.5, 2.0)
    methods: tuple[str, ...] = tuple(METHODS)
    slow_seeds: int = 1
    body_seeds: int = 2
    seeds: int = 3

    def n_seeds(self, body: str, method: str) -> int:
        """Experts of a cell."""
        if method == SLOW:
            return min(self.seeds, self.slow_seeds)
        return self.seeds if body == self.bodies[0] else min(self.seeds, self.body_seeds)


@dataclass(frozen=True)
class GaitJob:
    """One method on one demonstration.

    Attributes:
        body: Which humanoid.
        noise: Of joint angles [deg].
        method: Label of the row.
        seed: Of expert and noise.
    """

    body: str
    noise: float
    method: str
    seed: int

    def key(self) -> dict[str, Any]:
        """The job as JSON types."""
        return {"kind": "inverse optimal control", **asdict(self)}

    def run(self) -> dict[str, Any]:
        """L1 of the weights, forward solves and CPU seconds; or the error that ended it."""
        w_E, shown = demonstration(self.body, self.seed, self.noise)
        start = time.process_time()
        try:
            found = METHODS[self.method](shown)
        except WalkingIRLError as problem:  # one seed that fails must not lose the table
            return {"error": str(problem)}
        return {
            "L1": float(np.abs(found.w - w_E).sum()),
            "solves": found.solves,
            "status": found.status.name,
            "seconds": time.process_time() - start,
            "error": None,
        }


def table_7_13(config: Config, runner: Runner) -> Table:
    """Weights of exact and noisy gaits by inverse optimal control and by CPIRL."""
    cells = [(b, n, m) for b in config.bodies for n in config.noises for m in config.methods]
    jobs = [GaitJob(*c, s) for c in cells for s in range(config.n_seeds(c[0], c[2]))]
    outcomes = runner.outcomes("7.13", jobs)
    rows, bars, notes = [], [], list(NOTES)
    rest = iter(outcomes)
    for body, noise, method in cells:
        own = [next(rest) for _ in range(config.n_seeds(body, method))]
        good = [o for o in own if not o["error"]]
        if len(good) < len(own):
            bad = next(o["error"] for o in own if o["error"])
            notes.append(f"{method} ({body}, {noise:g} deg) failed {len(own) - len(good)}x: {bad}")
        rows.append((body, f"{noise:g}", method, *_figures(good)))
        if good:
            errors = [o["L1"] for o in good]
            label = f"{body}, {noise:g} deg"
            bars.append(Loss(label, method, float(np.mean(errors)), min(errors), max(errors)))
    notes += [
        f"{body}: {config.n_seeds(body, '')} seeds, {SLOW}: {config.n_seeds(body, SLOW)}."
        for body in config.bodies
    ]
    title = "weights of a gait by inverse optimal control and by CPIRL"
    caption = "L1 of weights, mean over seeds, from the smallest to the largest"
    chart = loss_chart(f"Table 7.13: {title}", bars, caption)
    raw = tuple({**job.key(), **o} for job, o in zip(jobs, outcomes, strict=True))
    header = {"seeds": config.seeds, **machine()}
    return Table("7.13", title, COLUMNS, tuple(rows), tuple(notes), header, raw, chart)


def _figures(outcomes: list[dict[str, Any]]) -> tuple[str, ...]:
    if not outcomes:
        return ("n/a",) * 5
    errors = [o["L1"] for o in outcomes]
    ends = dict.fromkeys(o["status"] for o in outcomes)
    return (
        f"{np.mean(errors):.4f}",
        f"{max(errors):.4f}",
        f"{np.mean([o['solves'] for o in outcomes]):.1f}",
        f"{np.mean([o['seconds'] for o in outcomes]):.2g}",
        ", ".join(ends),
    )
