"""The contract between domains, algorithms and observers: plain immutable records.

Larger feature expectations ``mu`` are better (costs enter with a minus sign) and the weights ``w``
live on the simplex: ``w >= 0`` and ``sum(w) = 1``.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, get_args

import numpy as np

from walking_irl.arrays import Array
from walking_irl.geometry.polyhedron import WeightPolyhedron

Mode = Literal["optimal", "set", "minimise"]
"""Which weights explain an expert: regret 0, regret below a tolerance, or the least regret."""
MODES: tuple[Mode, ...] = get_args(Mode)


class Objective(NamedTuple):
    """One objective that a policy may be optimal for."""

    name: str
    unit: str
    """Unit of the raw cost, before it is divided by ``scale``."""
    scale: float
    """Raw value that counts as one; weights live in the scaled space."""
    meaning: str
    """One sentence for a person."""
    formula: str = ""


def _no_policies() -> Array:
    return np.empty((0, 0))


@dataclass(frozen=True)
class Response:
    """Answer of a forward solver to a weight vector."""

    policy: Any
    """Opaque and picklable; only its domain looks inside."""
    mu: Array
    """Feature expectations, shape (K,)."""
    sensitivity: Array | None = None
    """d mu / d w, the Hessian of V(w) = max_pi w.mu(pi): shape (K, K), symmetric and positive
    semi-definite; None where the domain has none, or where it cannot be trusted at this policy."""
    evaluated: Array = field(default_factory=_no_policies)
    """Feature expectations of every other policy evaluated on the way, shape (n, K): each is a
    valid cut, free of charge."""
    info: Mapping[str, Any] = field(default_factory=dict)
    """Figures of the solver (iterations, seconds, ...)."""


Forward = Callable[[Array], Response]


@dataclass(frozen=True)
class Expert:
    """What a learner may know of an expert: never its weights.

    Attributes:
        mu: Feature expectations, shape (K,).
        error: Confidence half-widths of ``mu``, shape (K,), zero where it is exact.
        suboptimality: How much better than the expert a policy may be under its own weights, in
            units of ``w.mu``; zero for an exactly optimal expert.
        covariance: Covariance of the estimate ``mu``, shape (K, K), or None where it is exact.
        n_samples: Independent trajectories behind ``mu``; 0 where it is exact.
        demonstration: What was seen of the policy itself (for the humanoid a gait), or None.
        vouched_by: Who vouches for ``suboptimality``, where it is a person's word.
    """

    mu: Array
    error: Array
    suboptimality: float = 0.0
    covariance: Array | None = None
    n_samples: int = 0
    demonstration: Any = None
    vouched_by: str = ""


class Status(enum.Enum):
    """Why CPIRL yielded an iteration; every value but CUT and PROBE ends the run."""

    CUT = "the policy cuts the polyhedron; continue"
    PROBE = "an extreme weight of the tolerance set was tried, to tighten the intervals"
    MATCHED = "the expert is optimal for these weights within the tolerance"
    CONVERGED = "the estimate of the weights no longer moves"
    GAP_CLOSED = "the best regret and its lower bound meet"
    DOMINATED = "one policy is at least as good as the expert in every feature"
    MIXTURE_DOMINATES = "a mixture of the policies found is at least as good in every feature"
    EMPTY = "no weight satisfies every cut: the expert is not optimal, or its features are off"
    NOT_OPTIMAL = "the expert is not exactly optimal for any weights allowed; these explain it best"
    CONTRADICTED = (
        "the expert is not optimal, which this mode takes for granted: policies beat it under all "
        "weights; ask for the least regret, mode minimise"
    )
    STALLED = "the query repeats itself and the solver finds nothing better"
    BUDGET = "the budget of forward solves is spent"
    SAMPLED = "as many samples are drawn as were asked for"

    @property
    def is_success(self) -> bool:
        """Whether a run that ended so answers what the expert's weights are, or that none are."""
        return self in (
            Status.MATCHED,
            Status.CONVERGED,
            Status.GAP_CLOSED,
            Status.NOT_OPTIMAL,
            Status.DOMINATED,
            Status.MIXTURE_DOMINATES,
        )

    @property
    def has_weights(self) -> bool:
        """Whether a run that ended so has found weights to be sure of."""
        return self in (
            Status.MATCHED,
            Status.CONVERGED,
            Status.GAP_CLOSED,
            Status.NOT_OPTIMAL,
        )

    @property
    def is_refuted(self) -> bool:
        """Whether it ended because policies are known that beat the expert under all weights."""
        return self in (Status.DOMINATED, Status.MIXTURE_DOMINATES, Status.CONTRADICTED)


class Bracket(NamedTuple):
    """Bounds on min f, the sub-optimality that no weights explain, in units of w.mu."""

    lower: float = 0.0
    upper: float = np.inf

    def is_closed(self, ratio: float) -> bool:
        """Whether min f is known to be above 0, to within a ratio."""
        return 0.0 < self.lower and self.upper <= ratio * self.lower


class Gap(enum.Enum):
    """Who says how sub-optimal an expert may be under its own weights."""

    MEASURED = "measured"
    GRANTED = "granted"
    ASKED = "asked for"


class Certainty(NamedTuple):
    """Half widths of the weights' intervals by cause, (K,) each; they add up."""

    from_noise: Array
    """Of the expert's features: ``standard_errors`` times Student's quantile for all at once."""
    from_gap: Array
    """What a sub-optimality of ``gap`` allows."""
    from_solver: Array
    """What the learner's own solver leaves."""
    standard_errors: Array
    """Of the weights, from noise."""
    gap: float
    """Sub-optimality of the expert that is allowed for, in units of w.mu."""
    source: Gap
    """Who says so."""

    @property
    def half_widths(self) -> Array:
        """Of everything."""
        whole: Array = self.from_noise + self.from_gap + self.from_solver
        return whole


class Rule(enum.Enum):
    """How a query was chosen."""

    CENTRE = "centre of the polyhedron"
    NEWTON = "Newton step on the regret"
    KELLEY = "least regret that the policies found leave"
    PROBE = "predicted extreme of the tolerance set"


@dataclass(frozen=True)
class Iteration:
    """One forward solve of CPIRL and all that is known after it.

    Attributes:
        k: Index of the forward solve, from 0.
        polyhedron: Localisation set in which ``w`` was chosen, before this iteration's cut.
        w: Query, shape (K,).
        rule: How the query was chosen.
        response: The forward solver's answer.
        regret: f(w) = max_i w.mu_i - w.mu_E over all policies evaluated so far.
        best_regret: Smallest regret of any query so far.
        certificate: t_k of the minimax program (theory: Theorem 6.2.3): some mixture of the
            policies found loses at most t_k against the expert, whatever its weights.
        intervals: Per-weight bounds after this iteration's cut, shape (K, 2).
        estimate: Best estimate of the expert's weights after this iteration, shape (K,).
        status: Why this iteration was yielded.
        bracket: Bounds on min f, noise in the expert's features included.
        certainty: What the intervals are made of, or None before the end and where only cuts tell.
    """

    k: int
    polyhedron: WeightPolyhedron
    w: Array
    rule: Rule
    response: Response
    regret: float
    best_regret: float
    certificate: float
    intervals: Array
    estimate: Array
    status: Status
    bracket: Bracket = Bracket()
    certainty: Certainty | None = None

    @property
    def widest(self) -> float:
        """Width of the widest interval."""
        return float(np.diff(self.intervals, axis=1).max())


@dataclass(frozen=True)
class Rollout:
    """A recorded execution of a policy, sampled at every step of the simulation.

    Attributes:
        time: Times [s], shape (T,).
        q: Joint positions [m, rad], shape (T, nv).
        v: Joint velocities [m/s, rad/s], shape (T, nv).
        a: Joint accelerations during the step that follows, shape (T, nv).
        u: Joint torques during the step that follows [Nm], shape (T, nu).
        sensors: Sensor readings at the start of the step, shape (T, ns).
    """

    time: Array
    q: Array
    v: Array
    a: Array
    u: Array
    sensors: Array
