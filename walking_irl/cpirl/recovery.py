"""The whole of CPIRL in one call: from a forward solver and an expert to weights with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.loop import cpirl
from walking_irl.cpirl.newton_phase import Measure
from walking_irl.cpirl.probes import Probing
from walking_irl.cpirl.stops import StopRule
from walking_irl.cpirl.summary import Summary, summarise
from walking_irl.errors import InvalidInputError
from walking_irl.geometry.centres import OwnCentre
from walking_irl.types import Expert, Forward, Iteration, Mode, Objective, Status

MEASURED = Probing()
"""Intervals that allow for what is measured of the expert's sub-optimality."""


@dataclass(frozen=True)
class Recovery:
    """What :func:`recover` found; ``print(recovery)`` shows it as a table.

    Attributes:
        w: Recovered weights, shape (K,).
        intervals: Bounds of each weight, shape (K, 2).
        status: Why the run ended, a sentence.
        iterations: Every forward solve and what was known after it.
        summary: How sure the weights are, and what limits them.
        names: Of the K objectives.
    """

    w: Array
    intervals: Array
    status: Status
    iterations: tuple[Iteration, ...]
    summary: Summary
    names: tuple[str, ...]

    @property
    def is_success(self) -> bool:
        """Whether the run answers the question; where not, ``status`` says why."""
        return self.status.is_success

    @property
    def policy(self) -> Any:
        """The policy found at the query nearest to the recovered weights."""
        return min(
            self.iterations, key=lambda it: float(np.abs(it.w - self.w).sum())
        ).response.policy

    def __str__(self) -> str:
        width = max(len(name) for name in self.names)
        rows = [
            f"{name:{width}s}  {w:7.4f}  {low:7.4f} .. {high:.4f}"
            for name, w, (low, high) in zip(self.names, self.w, self.intervals, strict=True)
        ]
        return "\n".join([*rows, f"{len(self.iterations)} forward solves: {self.status.value}"])


def recover(
    forward: Forward,
    expert: Expert,
    *,
    objectives: Sequence[Objective | str] | None = None,
    centre: str | OwnCentre = "ac",
    mode: Mode = "optimal",
    tol: float = 1e-6,
    max_solves: int = 60,
    min_weight: float = 0.0,
    rng: np.random.Generator | None = None,
    measure: Measure | None = None,
    probe: float | Probing | None = MEASURED,
    executor: Executor | None = None,
    stop: Sequence[StopRule] = (),
) -> Recovery:
    """Recover the weights under which an expert is optimal, in one call that prints nothing.

    >>> import walking_irl as wi
    >>> pace = np.linspace(0.0, 1.0, 101)  # 101 policies, two objectives
    >>> costs = np.c_[pace**2, (1.0 - pace) ** 2]
    >>> def forward(w):
    ...     best = np.argmin(costs @ w)
    ...     return wi.Response(best, mu=-costs[best])
    >>> expert = wi.Expert(mu=-costs[70], error=np.zeros(2))
    >>> recovery = wi.recover(forward, expert, objectives=["effort", "time"])
    >>> recovery.is_success, recovery.w.round(2).tolist()
    (True, [0.3, 0.7])

    Args:
        forward: Solves "best policy for w"; picklable where an executor is given.
        expert: What is known of the expert.
        objectives: Names (or objectives with units and scales) of the K features, for the summary.
        centre: See :func:`~walking_irl.cpirl.loop.cpirl`, as the arguments that follow.
        mode: "optimal", "set" or "minimise".
        tol: Regret that counts as none, relative to |w.mu_E|.
        max_solves: Budget of forward solves, before probes.
        min_weight: Lower bound of every weight.
        rng: Of sampling centres; by default one of seed 0, so that equal calls have equal results.
        measure: Measures a policy as an estimated expert was measured.
        probe: Sub-optimality of the expert that the intervals allow for, relative; what is measured
            by default, None for no probes.
        executor: Solves the probes side by side.
        stop: Further stop rules.

    Returns:
        The weights, their intervals, and why the run ended; an ending without success is no error.

    Raises:
        InvalidInputError: If an argument is out of range, or no policy achieves the expert's
            features.
    """
    K = np.size(expert.mu)
    if objectives is not None and len(objectives) != K:
        raise InvalidInputError(f"need {K} objectives, one for each feature, got {len(objectives)}")
    if executor is not None and probe is not None:
        probe = Probing(probe.level if isinstance(probe, Probing) else probe, executor)
    described = [Objective(o, "1", 1.0, o) if isinstance(o, str) else o for o in objectives or ()]
    iterations = tuple(
        cpirl(
            forward,
            expert,
            centre=centre,
            mode=mode,
            tol=tol,
            max_solves=max_solves,
            min_weight=min_weight,
            rng=np.random.default_rng(0) if rng is None else rng,
            measure=measure,
            probe=probe,
            stop=stop,
        )
    )
    last = iterations[-1]
    return Recovery(
        w=last.estimate,
        intervals=last.intervals,
        status=last.status,
        iterations=iterations,
        summary=summarise(iterations, expert, described),
        names=tuple(o.name for o in described) or tuple(f"objective {i + 1}" for i in range(K)),
    )
