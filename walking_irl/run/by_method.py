"""One recovery by any method of table 3.1, from ground-truth weights to what it found of them."""

from __future__ import annotations

import time
from concurrent.futures import Executor
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.given import HOOKS
from walking_irl.baselines.recovered import Recovered
from walking_irl.baselines.registry import FINITE, METHODS, Method, Needs, run_method
from walking_irl.domains import load
from walking_irl.domains.contract import Domain
from walking_irl.errors import InvalidInputError
from walking_irl.rl.demonstrations import Demonstrations, demonstrate
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.run.problem import Problem, prepare
from walking_irl.run.setup import HORIZON, TRAJECTORIES, Setup
from walking_irl.types import Expert
from walking_irl.versions import versions


@dataclass(frozen=True)
class MethodReport:
    """What a method found.

    Attributes:
        method: Its name in the registry.
        problem: The domain and the expert.
        found: The method's answer.
        n_trajectories: Demonstrations that it saw; 0 where it saw the expert as the domain
            describes it.
        seconds: Wall time of the method alone.
    """

    method: str
    problem: Problem
    found: Recovered
    n_trajectories: int
    seconds: float
    recording: str | None = None

    @property
    def weights(self) -> Array | None:
        """Recovered weights (K,), scaled to sum |w| = 1; None where the reward has none."""
        w = self.found.w
        if w is None or not np.abs(w).sum() > 0 or len(w) != len(self.problem.objectives):
            return None
        return scaled(w)

    @property
    def samples(self) -> Array | None:
        """Samples of a posterior (m, K), scaled likewise, where the method draws some."""
        if self.found.samples is None:
            return None
        samples = scaled(self.found.samples)
        known: Array = samples[np.isfinite(samples).all(axis=1)]
        return known if len(known) else None

    @property
    def intervals(self) -> Array | None:
        """95 % intervals of the weights scaled so, (K, 2), where the method has them."""
        found = self.found.info.get("intervals")
        if found is not None and self.found.space == "simplex":
            return np.asarray(found)
        if self.samples is None:
            return None
        return np.asarray(np.quantile(self.samples, [0.025, 0.975], axis=0).T)

    @property
    def relative_loss(self) -> float | None:
        """(J_E - J) / |J_E| of the method's policy, under the ground-truth weights."""
        truth = self.problem.demonstration.truth
        if truth is None or self.found.mu is None or len(self.found.mu) != len(truth.w):
            return None
        return truth.relative_loss(self.found.mu)

    def to_json(self) -> dict[str, Any]:
        """All figures."""
        truth, w, intervals = self.problem.w_expert, self.weights, self.intervals
        return {
            "method": self.method,
            "domain": self.problem.setup.domain,
            "seed": self.problem.setup.seed,
            "objectives": [o.name for o in self.problem.objectives],
            "ground_truth_weights": None if truth is None else truth.tolist(),
            "weights": None if w is None else w.tolist(),
            "space": self.found.space,
            "intervals": None if intervals is None else intervals.tolist(),
            "relative_loss": self.relative_loss,
            "trajectories": self.n_trajectories,
            "forward_solves": self.found.info.get("solves"),
            "status": self.found.status.value,
            "notes": list(self.found.notes),
            "objective": self.found.objective.tolist(),
            "reward": None if self.found.reward is None else self.found.reward.tolist(),
            "seconds": self.seconds,
            "recording": self.recording,
            "versions": versions(),
        }


def scaled(w: Array) -> Array:
    """Weights (..., K) with sum |w| = 1, whose scale says nothing; not a number where all are 0."""
    with np.errstate(invalid="ignore"):
        shares: Array = w / np.abs(w).sum(axis=-1, keepdims=True)
    return shares


def recover_by(
    method: str,
    setup: Setup,
    *,
    n_trajectories: int | None = None,
    horizon: int | None = None,
    executor: Executor | None = None,
) -> MethodReport:
    """Make the expert that a setup asks for, and explain it by a method.

    Args:
        method: Name in the registry of methods.
        setup: Domain, weights and expert; what concerns CPIRL has no effect.
        n_trajectories: Demonstrations that stand for the expert in finite worlds; by default 100
            for methods that read actions, and the exact expert for the others.
        horizon: Steps of each, 50 by default.
        executor: Runs independent solves of the expert side by side.

    Raises:
        InvalidInputError: If there is no such method, or it cannot run on the domain.
    """
    if method not in METHODS:
        raise InvalidInputError(f"unknown method {method!r}; choose from {', '.join(METHODS)}")
    domain = load(setup.domain)
    mdp = _check(METHODS[method], domain)
    n, steps = _seen(METHODS[method], domain, mdp, n_trajectories, horizon)
    problem = prepare(setup, executor)  # may take minutes: what cannot run is said before
    rng = np.random.default_rng([setup.seed, 2])
    data: Expert | Demonstrations = problem.expert
    if mdp is not None and n:
        data = demonstrate(mdp, problem.demonstration.policy, n, steps, rng=rng)
    start = time.perf_counter()
    found = run_method(method, _world(problem), data, rng=rng)
    return MethodReport(method, problem, found, n, time.perf_counter() - start)


def _check(method: Method, domain: Domain) -> FiniteMDP | None:
    """The domain's finite MDP, if it has one.

    Raises:
        InvalidInputError: If the method cannot run on it.
    """
    found = getattr(domain, "mdp", None)
    mdp = found if isinstance(found, FiniteMDP) else None
    if mdp is None and method.worlds == (FINITE,):
        raise InvalidInputError(
            f"{method.name} needs finitely many states and actions with a known model, "
            f"{domain.name} has not"
        )
    is_asked = mdp is None or FINITE not in method.worlds
    if method.hook and is_asked and not hasattr(domain, method.hook):
        raise InvalidInputError(
            f"{method.name} needs {HOOKS[method.hook]}; {domain.name} offers none"
        )
    return mdp


def _seen(
    method: Method, domain: Domain, mdp: FiniteMDP | None, n: int | None, horizon: int | None
) -> tuple[int, int]:
    """How many trajectories a method sees, 0 for the expert itself, and their steps.

    Raises:
        InvalidInputError: If it sees none where some are asked for.
    """
    if n is not None and mdp is None:
        raise InvalidInputError(f"{domain.name} takes no trajectories of states and actions")
    if n is not None and method.needs is Needs.POLICY:
        raise InvalidInputError(f"{method.name} sees the expert's policy; it takes no trajectories")
    reads_actions = mdp is not None and method.needs is Needs.ACTIONS
    if n is None and not reads_actions:
        if horizon is not None:
            raise InvalidInputError(
                f"{method.name} on {domain.name} sees the expert itself, and no trajectories of "
                "some horizon: leave it out"
            )
        return 0, 0
    n, steps = TRAJECTORIES if n is None else n, HORIZON if horizon is None else horizon
    if n < 1 or steps < 1:
        raise InvalidInputError(f"need at least one trajectory of one step, got {n} of {steps}")
    return n, steps


def _world(problem: Problem) -> Any:
    """The domain; where the learner's solver is its own, with that one."""
    domain = problem.domain
    if isinstance(getattr(domain, "mdp", None), FiniteMDP):
        return domain
    hooks = {hook: getattr(domain, hook) for hook in HOOKS if hasattr(domain, hook)}
    return SimpleNamespace(
        name=domain.name, forward=problem.learner.forward, defaults=domain.defaults, **hooks
    )
