"""What a run works on: a domain, a demonstrated expert, and the learner's tools."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains import load
from walking_irl.domains.contract import (
    Demonstration,
    Domain,
    Learner,
    OnStep,
    Request,
    refuse,
)
from walking_irl.domains.weights import normalised
from walking_irl.errors import InvalidInputError
from walking_irl.run.setup import Setup
from walking_irl.types import Expert, Objective


@dataclass(frozen=True)
class Problem:
    """Who is to be explained, and with what.

    The learner's side receives ``demonstration.expert`` and :attr:`learner` only. Ground-truth
    weights stay beside them, for scoring and for pictures.

    Attributes:
        setup: What was asked.
        domain: The domain.
        demonstration: The expert, and what stands behind it.
        learner: The learner's tools.
    """

    setup: Setup
    domain: Domain
    demonstration: Demonstration
    learner: Learner

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """The domain's."""
        return self.domain.objectives

    @property
    def expert(self) -> Expert:
        """What the learner is told of the expert."""
        return self.demonstration.expert

    @property
    def w_expert(self) -> Array | None:
        """Ground-truth weights, shape (K,), or None where nobody knows them."""
        truth = self.demonstration.truth
        return None if truth is None else truth.w

    @property
    def min_weight(self) -> float:
        """The learner's lower bound of every weight, the domain's where none was asked for."""
        return _least_weight(self.setup, self.domain)

    @property
    def max_solves(self) -> int:
        """Budget of forward solves, the domain's where none was asked for."""
        asked = self.setup.max_solves
        return self.domain.defaults.max_solves if asked is None else asked


def prepare(
    setup: Setup, executor: Executor | None = None, on_step: OnStep | None = None
) -> Problem:
    """Make the expert: solve for its policy, record it; or read the demonstration.

    Args:
        setup: What is asked.
        executor: Runs independent solves and trajectories side by side.
        on_step: Told of every step of the learner's solver.

    Raises:
        InvalidInputError: If the setup asks for what there is not, or for what has no effect.
        FallError: If a recorded expert falls.
    """
    domain = load(setup.domain)
    least, K = _least_weight(setup, domain), len(domain.objectives)
    if not least * K < 1.0:
        raise InvalidInputError(
            f"min-weight must lie below 1/{K}, as {K} weights sum to 1, got {least:g}"
        )
    if setup.demonstration is None:
        rng = np.random.default_rng(setup.seed)
        shown = domain.demonstrate(_request(setup, domain), rng=rng, executor=executor)
        if shown.truth is not None:
            _refuse_small(shown.truth.w, least, domain)
    else:
        without_effect = (["expert"] if setup.expert != Setup.expert else []) + [*setup.options]
        refuse(without_effect, without_effect, "a demonstration file holds the expert as it is")
        shown = domain.read_demonstration(setup.demonstration)
    return pose(setup, shown, executor, on_step)


def pose(
    setup: Setup,
    demonstration: Demonstration,
    executor: Executor | None = None,
    on_step: OnStep | None = None,
) -> Problem:
    """The problem of explaining an expert that is known already."""
    domain = load(setup.domain)
    if setup.expert_gap is not None:
        demonstration = replace(
            demonstration, expert=_vouched(demonstration.expert, setup.expert_gap)
        )
    learner = domain.learner(
        demonstration.expert,
        setup.options,
        rng=np.random.default_rng([setup.seed, 1]),
        executor=executor,
        on_step=on_step,
    )
    return Problem(setup, domain, demonstration, learner)


def _least_weight(setup: Setup, domain: Domain) -> float:
    """The least weight that is looked for."""
    return domain.defaults.min_weight if setup.min_weight is None else setup.min_weight


def _vouched(expert: Expert, gap: float) -> Expert:
    """The expert, as sub-optimal as a person says, relative to its return."""
    size = float(np.mean(np.abs(expert.mu)))
    return replace(expert, suboptimality=gap * size, vouched_by="--expert-gap")


def _request(setup: Setup, domain: Domain) -> Request:
    if setup.weights is None:
        return Request(None, setup.expert, setup.options)
    w_E = normalised(setup.weights, domain.objectives)
    _refuse_small(w_E, _least_weight(setup, domain), domain)
    refuse(setup.options, ["population"], "weights are given, so none are drawn")
    return Request(w_E, setup.expert, setup.options)


def _refuse_small(w_E: Array, least: float, domain: Domain) -> None:
    """Complain about ground-truth weights that the learner does not look for.

    Raises:
        InvalidInputError: If there are some.
    """
    small = [
        f"{objective.name} {w:.4g}"
        for objective, w in zip(domain.objectives, w_E, strict=True)
        if w < least - 1e-12
    ]
    if small:
        raise InvalidInputError(
            f"{domain.name} looks for weights of at least {least:g} of their sum, got "
            f"{', '.join(small)}; give larger ones, or lower the bound with --min-weight"
        )
