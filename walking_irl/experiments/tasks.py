"""One cell of a table for one seed: a hidden expert, a method, and how it is scored."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines import kelley, lpal, max_margin, mwal, projection
from walking_irl.cpirl.loop import cpirl
from walking_irl.domains.humanoid.closed_loop.trials import Protocol
from walking_irl.domains.humanoid.domain import Humanoid
from walking_irl.domains.humanoid.population import typical_weights
from walking_irl.domains.lqr import LQR
from walking_irl.domains.mdp.driving import Driving
from walking_irl.domains.mdp.finite import FiniteDomain
from walking_irl.domains.mdp.gridworld import Gridworld
from walking_irl.domains.path.walking_path import WalkingPath
from walking_irl.errors import InvalidInputError, WalkingIRLError
from walking_irl.experiments.cutting import cutting_planes
from walking_irl.geometry.centres import centre_rule
from walking_irl.geometry.centres.gravity import gravity
from walking_irl.geometry.game import game_lp
from walking_irl.types import Expert, Response

DOMINANCE_TOL = 1e-9
"""Relative slack of "at least as good in every feature": rounding only."""

FLOOR = 0.05
"""Uniform share of the rivals' queries where a term of no weight leaves the optimum ill-defined."""
MIN_WEIGHT = {"humanoid": 0.005, "humanoid-planar": 0.005}
"""Lower bound of the learner's weights, by domain; as in the main job."""


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


class State(NamedTuple):
    """What a method holds after a forward solve."""

    mu: Array
    """Of the policy or mixture that is scored."""
    M: Array
    """Of all policies found."""
    w: Array | None
    """Estimate of the weights, where the method has one."""
    width: float | None
    """Largest weight interval, where the method has intervals."""


class _Clock:
    """A forward solver that counts its calls and its seconds."""

    def __init__(self, forward: Callable[[Array], Response], has_sensitivity: bool) -> None:
        self.forward, self.has_sensitivity = forward, has_sensitivity
        self.n, self.seconds = 0, 0.0

    def __call__(self, w: Array) -> Response:
        start = time.perf_counter()
        response = self.forward(w)
        self.seconds += time.perf_counter() - start
        self.n += 1
        if self.has_sensitivity:
            return response
        return Response(response.policy, response.mu, info=response.info)


def make_domain(name: str, options: dict[str, Any]) -> Any:
    """Domain by name.

    Raises:
        InvalidInputError: If there is none.
    """
    makers: dict[str, Callable[..., Any]] = {
        "gridworld": Gridworld,
        "driving": Driving,
        "lqr": LQR,
        "walking-path": WalkingPath,
        "humanoid": partial(Humanoid, planar=False),
        "humanoid-planar": partial(Humanoid, planar=True),
    }
    if name not in makers:
        raise InvalidInputError(f"unknown domain {name!r}; choose from {', '.join(makers)}")
    return makers[name](**options)


def hidden_expert(task: Task, domain: Any, rng: np.random.Generator) -> tuple[Array, Expert, int]:
    """Hidden weights (K,), an expert, and how many were drawn for it.

    The expert is optimal for "return" and perturbed for "dominance".
    """
    w_E, expert = _drawn(task, domain, rng)
    n_drawn = 1
    while task.least_advantage > 0.0 and domain.advantage(expert.mu) < (
        task.least_advantage * np.abs(expert.mu).mean()
    ):
        w_E, expert = _drawn(task, domain, rng)
        n_drawn += 1
    return w_E, expert, n_drawn


def _drawn(task: Task, domain: Any, rng: np.random.Generator) -> tuple[Array, Expert]:
    if isinstance(domain, Humanoid):
        return _walker(domain.planar, task.criterion == "dominance", task.seed)
    sample = getattr(domain, "random_weights", None)
    w_E = sample(rng) if sample else rng.dirichlet(np.ones(len(domain.objectives)))
    if task.criterion == "return" or not hasattr(domain, "suboptimal_expert"):
        return w_E, domain.expert(w_E, rng)  # the LQR perturbs its expert by an option
    return w_E, domain.suboptimal_expert(w_E, rng)


@lru_cache(maxsize=32)
def _walker(planar: bool, is_spoilt: bool, seed: int) -> tuple[Array, Expert]:
    """Hidden weights and a walker known exactly; kept, for the search takes longer than a row."""
    domain, rng = Humanoid(planar), np.random.default_rng([seed, 7])
    w_E = typical_weights(rng)
    if is_spoilt:
        return w_E, domain.demonstrate_poorly(w_E, rng).expert
    return w_E, domain.demonstrate(w_E, rng, Protocol(rollouts=0)).expert


def run_task(task: Task) -> dict[str, Any]:
    """Run a method until it satisfies the criterion, ends or spends its budget.

    Returns:
        success, solves, seconds, query_seconds, dw, certificate, width (None where undefined),
        experts drawn until one was sub-optimal enough, and the error that ended the run, if any.
    """
    rng = np.random.default_rng([task.seed, 7])
    domain = make_domain(task.domain, task.options)
    w_E, expert, n_drawn = hidden_expert(task, domain, rng)
    if isinstance(domain, Humanoid):
        solver: Any = domain.learner(expert)
    else:
        solver = domain.solve if isinstance(domain, FiniteDomain) else domain.forward
        domain.forward(np.full(len(w_E), 1 / len(w_E)))  # caches and imports are not timed
    clock = _Clock(solver, bool(task.arguments.get("has_newton", False)))
    span = _span(domain, solver, expert) if task.method == "mwal" else 0.0
    start = time.perf_counter()
    state, success, error = None, False, None
    try:
        for state in _states(task, domain, clock, expert, span, rng):
            success = _is_success(task, state.mu, w_E, expert.mu)
            if success:
                break
    except WalkingIRLError as problem:  # one seed that fails must not lose the table
        error = str(problem)
    seconds = time.perf_counter() - start
    certificate = None if state is None else game_lp(state.M - expert.mu).value
    return {
        "success": success,
        "solves": clock.n,
        "seconds": seconds,
        "query_seconds": seconds - clock.seconds,
        "dw": None if state is None or state.w is None else float(np.abs(state.w - w_E).max()),
        "certificate": certificate,
        "width": None if state is None else state.width,
        "drawn": n_drawn,
        "error": error,
    }


def _is_success(task: Task, mu: Array, w_E: Array, mu_E: Array) -> bool:
    if task.criterion == "return":
        J_E = float(w_E @ mu_E)
        return float(w_E @ mu) >= J_E - task.share * abs(J_E)
    return bool((mu - mu_E).min() >= -DOMINANCE_TOL * np.abs(mu_E).max())


def _states(
    task: Task, domain: Any, clock: _Clock, expert: Expert, span: float, rng: np.random.Generator
) -> Iterator[State]:
    if task.method == "cpirl":
        yield from _cpirl(task, clock, expert, rng)
    elif task.method in ("utopia", "samples"):
        yield from _cutting(task, clock, expert, rng)
    else:
        yield from _rival(task, domain, clock, expert, span, rng)


def _cpirl(task: Task, clock: _Clock, expert: Expert, rng: np.random.Generator) -> Iterator[State]:
    mode: Any = "optimal" if task.criterion == "return" else "minimise"
    centre = task.arguments["centre"]
    M: list[Array] = []
    run = cpirl(
        clock,
        expert,
        centre=centre,
        mode=mode,
        max_solves=task.max_solves,
        min_weight=MIN_WEIGHT.get(task.domain, 0.0),
        rng=rng,
    )
    for it in run:
        M.append(it.response.mu)
        mu = it.response.mu
        if task.scored == "mixture":
            mu = _best_mixture(np.array(M), expert.mu)
        width = float(np.ptp(it.intervals, axis=1).max())
        yield State(mu, np.array(M), it.estimate, width)


def _best_mixture(M: Array, mu_E: Array) -> Array:
    """mu of the mixture with the smallest worst-case loss."""  # noqa: D403
    mixture = np.maximum(game_lp(M - mu_E).mixture, 0.0)
    mu: Array = mixture @ M / mixture.sum()
    return mu


def _cutting(
    task: Task, clock: _Clock, expert: Expert, rng: np.random.Generator
) -> Iterator[State]:
    has_utopia = task.method == "utopia"
    if has_utopia:
        rule: Any = centre_rule(task.arguments["centre"])
    else:
        rule = partial(gravity, n_samples=task.arguments["n_samples"])
    M: list[Array] = []
    for step in cutting_planes(
        clock, expert, rule, rng=rng, max_solves=task.max_solves, has_utopia=has_utopia
    ):
        M.append(step.response.mu)
        yield State(step.response.mu, np.array(M), step.w, None)


def _rival(
    task: Task, domain: Any, clock: _Clock, expert: Expert, span: float, rng: np.random.Generator
) -> Iterator[State]:
    n, signed = task.max_solves, isinstance(domain, FiniteDomain)
    oracle: Any = _interior(clock) if isinstance(domain, WalkingPath | Humanoid) else clock
    if task.method == "lpal":
        run: Any = [lpal(domain, expert)]
    elif task.method == "mwal":
        run = mwal(oracle, expert, span=span, max_solves=n)
    elif task.method == "kelley":
        run = kelley(oracle, expert, max_solves=n)
    elif task.method in ("projection", "max-margin"):
        method = projection if task.method == "projection" else max_margin
        run = method(oracle, expert, rng=rng, max_solves=n, is_signed=signed)
    else:
        raise InvalidInputError(f"unknown method {task.method!r}")
    for apprentice in run:
        mu = apprentice.mu if task.scored == "mixture" else apprentice.last.mu
        w = apprentice.W[-1]
        yield State(mu, apprentice.M, w if w.min() >= 0 and task.method != "lpal" else None, None)


def _interior(forward: Callable[[Array], Response]) -> Callable[[Array], Response]:
    """Solver that moves weights off the simplex's faces."""
    return lambda w: forward((1 - FLOOR) * w + FLOOR / len(w))


def _span(domain: Any, solver: Callable[[Array], Response], expert: Expert) -> float:
    """Bound on |mu - mu_E|: from the discount for features in [0, 1], else from the corners."""
    if isinstance(domain, FiniteDomain):
        return 1 / (1 - domain.mdp.discount)
    oracle = _interior(solver) if isinstance(domain, WalkingPath | Humanoid) else solver
    return float(max(np.abs(oracle(w).mu - expert.mu).max() for w in np.eye(len(expert.mu))))
