"""One cell of a table for one seed: an expert, a method, and how it is scored."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains import load
from walking_irl.domains.contract import Truth
from walking_irl.errors import WalkingIRLError
from walking_irl.experiments.arenas import arena_of, drawn
from walking_irl.experiments.contenders import Contest, states
from walking_irl.geometry.game import game_lp
from walking_irl.run.stopwatch import Timed
from walking_irl.types import Expert, Forward, Response

DOMINANCE_TOL = 1e-9
"""Relative slack of "at least as good in every feature": rounding only."""


@dataclass(frozen=True)
class Task:
    """A picklable job; equal tasks have equal results but for the clock.

    Attributes:
        domain: "gridworld", "driving", "lqr", "walking-path", "humanoid" or "humanoid-planar".
        options: Arguments of the domain.
        method: "cpirl", "utopia", "samples", "kelley", "mwal", "projection", "max-margin", "lpal".
        arguments: Of the method (centre, has_newton, n_samples).
        scored: "last" policy, "mixture" of all, or "stationary" (LPAL).
        criterion: "return": J within ``share`` of J_E; "dominance": mu >= mu_E.
        share: Relative loss that counts as success.
        max_solves: Budget of forward solves.
        least_advantage: Experts whom no policy beats by this much in every feature, relative to
            their mean |feature|, are drawn again (LQR).
        seed: Of the expert and of the method.
    """

    domain: str
    options: dict[str, Any] = field(default_factory=dict)
    method: str = "cpirl"
    arguments: dict[str, Any] = field(default_factory=dict)
    scored: str = "last"
    criterion: str = "return"
    share: float = 0.01
    max_solves: int = 60
    least_advantage: float = 0.0
    seed: int = 0

    def key(self) -> dict[str, Any]:
        """The job as JSON types."""
        return asdict(self)

    def run(self) -> dict[str, Any]:
        """See :func:`run_task`."""
        return run_task(self)


def synthetic_expert(
    task: Task, domain: Any, rng: np.random.Generator
) -> tuple[Array, Expert, int]:
    """Ground-truth weights (K,), an expert, and how many were drawn for it.

    The expert is optimal for "return" and sub-optimal for "dominance".
    """
    kind = "optimal" if task.criterion == "return" else "suboptimal"
    n_drawn = 0
    while True:
        shown = drawn(task.domain, domain, kind, task.seed, rng)
        expert, truth = shown.expert, shown.truth
        assert truth is not None  # it is synthetic
        n_drawn += 1
        least = task.least_advantage * np.abs(expert.mu).mean()
        if task.least_advantage == 0.0 or domain.advantage(expert.mu) >= least:
            return truth.w, expert, n_drawn


def run_task(task: Task) -> dict[str, Any]:
    """Run a method until it satisfies the criterion, ends or spends its budget.

    Returns:
        success, solves, seconds, query_seconds, dw, certificate, width (None where undefined),
        experts drawn until one was sub-optimal enough, and the error that ended the run, if any.
    """
    rng = np.random.default_rng([task.seed, 7])
    arena, domain = arena_of(task.domain), load(task.domain, **task.options)
    w_E, expert, n_drawn = synthetic_expert(task, domain, rng)
    solver = arena.solver(domain, expert)
    if not arena.is_slow:
        domain.forward(np.full(len(w_E), 1 / len(w_E)))  # caches and imports are not timed
    has_newton = bool(task.arguments.get("has_newton", False))
    clock = Timed(solver if has_newton else _without_sensitivity(solver))
    setting = arena.setting(domain, arena.oracle(solver), expert, task.method == "mwal")
    contest = Contest(clock, arena.oracle(clock), expert, setting, domain.defaults.min_weight, rng)
    start = time.perf_counter()
    state, success, error = None, False, None
    try:
        for state in states(task, contest):
            success = _is_success(task, state.mu, Truth(w_E, expert.mu))
            if success:
                break
    except WalkingIRLError as problem:  # one seed that fails must not lose the table
        error = str(problem)
    seconds = time.perf_counter() - start
    return {
        "success": success,
        "solves": clock.n,
        "seconds": seconds,
        "query_seconds": seconds - clock.seconds,
        "dw": None if state is None or state.w is None else float(np.abs(state.w - w_E).max()),
        "certificate": None if state is None else game_lp(state.M - expert.mu).value,
        "width": None if state is None else state.width,
        "drawn": n_drawn,
        "error": error,
    }


def _without_sensitivity(forward: Forward) -> Forward:
    """A solver for methods by cuts alone."""

    def plain(w: Array) -> Response:
        response = forward(w)
        return Response(response.policy, response.mu, info=response.info)

    return plain


def _is_success(task: Task, mu: Array, truth: Truth) -> bool:
    if task.criterion == "return":
        return truth.relative_loss(mu) <= task.share
    return bool((mu - truth.mu).min() >= -DOMINANCE_TOL * np.abs(truth.mu).max())
