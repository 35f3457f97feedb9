"""What a domain promises to all who run, record or list it.

The algorithm needs ``forward`` alone. The rest makes experts, hands a learner its tools and stores
policies, so that nobody has to ask a domain's name or type. Domains whose experts are known exactly
inherit most of it from :class:`~walking_irl.domains.exact.ExactDomain`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.types import Expert, Forward, Objective, Response

EXPERTS = ("optimal", "suboptimal")
INTERIOR = 0.05
"""Share of even weights that methods without a least weight ask for where a vanishing weight leaves
the optimum ill-defined."""

OnStep = Callable[[int, float], None]
"""Told of every step of a solver: its number and the cost so far."""
Measure = Callable[[Any], tuple[Array, Array]]
"""Mean (K,) and covariance (K, K) of a policy's features, measured as the expert's were."""


class Option(NamedTuple):
    """A setting of a domain's experts: how their weights are drawn, how they are recorded."""

    default: Any
    meaning: str
    """A few words for ``--help``."""
    choices: tuple[str, ...] = ()


class Defaults(NamedTuple):
    """How a domain is learnt unless a user asks for something else."""

    max_solves: int = 60
    """Budget of forward solves, probes left aside; what is cheap to solve may be solved often."""
    min_weight: float = 0.0
    """The learner's lower bound of every weight."""
    interior: float = 0.0
    """Share of even weights in queries on the simplex's faces, where an optimum is ill-defined."""
    needs_workers: bool = False
    """Whether a forward solve takes longer than to start a process."""
    files: str = ""
    """What a run's files are called unless a user names them; as the domain, where empty."""


@dataclass(frozen=True)
class Request:
    """Which expert is asked for.

    Attributes:
        weights: Its ground-truth weights, shape (K,), or None to draw them.
        expert: "optimal", or "suboptimal" under those weights.
        options: Values by name of :attr:`Domain.options`; what is left out has its default.
    """

    weights: Array | None = None
    expert: str = "optimal"
    options: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.expert not in EXPERTS:
            choices = " or ".join(EXPERTS)
            raise InvalidInputError(f"unknown expert {self.expert!r}; choose {choices}")


@dataclass(frozen=True)
class Truth:
    """What only scoring and pictures may look at.

    Attributes:
        w: Ground-truth weights, shape (K,).
        mu: Features of the expert's policy without noise, shape (K,).
    """

    w: Array
    mu: Array

    def relative_loss(self, mu: Array) -> float:
        """(J_E - J) / |J_E| of a policy with features ``mu``, under the ground-truth weights."""
        J_E, J = float(self.w @ self.mu), float(self.w @ mu)
        return (J_E - J) / max(abs(J_E), 1e-300)


@dataclass(frozen=True)
class Demonstration:
    """An expert and what stands behind it.

    Attributes:
        expert: All that a learner receives.
        policy: The expert's own policy; for pictures.
        truth: Its weights and features, or None where nobody knows them; for scoring.
        trajectories: What was recorded of it; nothing where it is known exactly.
    """

    expert: Expert
    policy: Any
    truth: Truth | None = None
    trajectories: tuple[Any, ...] = ()


class Compared(NamedTuple):
    """The optimal policy for some weights beside one that was shown, in the policy's parameters."""

    residual: Array
    """Shown minus optimal, shape (m,)."""
    slope: Callable[[], Array]
    """d optimal / d w, shape (m, K); asked for only by methods that use it."""
    policy: Any
    """The optimal policy."""
    mu: Array
    """Its feature expectations, shape (K,)."""


@dataclass(frozen=True)
class Learner:
    """A learner's tools; they know the expert's features, never its weights.

    Attributes:
        forward: Its forward solver.
        measure: Measures a policy as the expert was measured, or None where the expert is exact.
    """

    forward: Forward
    measure: Measure | None = None


class Domain(Protocol):
    """A world with objectives, and a solver for the best policy under given weights.

    Some methods of :mod:`walking_irl.baselines` ask for more, and run where it is offered:

    - ``mdp``: the world as a finite MDP;
    - ``policy_gradient(policy)``: gradient of each feature in the policy's parameters (p, K), along
      the directions that its constraints leave;
    - ``advantages(policy, *, size, rng)``: by how much the policy beats random deviations of a
      relative size in each feature (n, K), and the state that each deviation belongs to (n,);
    - ``nearest(policy)``: maps weights to their optimal policy beside that one, :class:`Compared`.
    """

    @property
    def name(self) -> str:
        """What it is called in sentences."""
        ...

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """What a policy may be good at, K of them."""
        ...

    @property
    def options(self) -> Mapping[str, Option]:
        """Options of a request that it understands; others are refused."""
        ...

    @property
    def defaults(self) -> Defaults:
        """How it is learnt unless a user asks for something else."""
        ...

    @property
    def question(self) -> str:
        """What a recovery answers, as the title of its result."""
        ...

    @property
    def view(self) -> str | None:
        """Which view of a recording shows its policies (``recording.views.registry``), or None."""
        ...

    @property
    def has_trajectories(self) -> bool:
        """Whether its experts can be known by recorded trajectories."""
        ...

    def forward(self, w: Array) -> Response:
        """Solve "best policy for w"; deterministic; knows nothing of any expert."""
        ...

    def expert(self, w_E: Array, rng: np.random.Generator) -> Expert:
        """Synthetic expert for given weights, solved at least as hard as any learner's query."""
        ...

    def random_weights(self, population: str, rng: np.random.Generator) -> Array:
        """Weights of an expert, shape (K,)."""
        ...

    def demonstrate(
        self, request: Request, *, rng: np.random.Generator, executor: Executor | None = None
    ) -> Demonstration:
        """Make the expert that a request asks for.

        Args:
            request: Which expert.
            rng: Draws weights, disturbances and starts of searches.
            executor: Runs independent solves and trajectories side by side.

        Raises:
            InvalidInputError: If it takes no such request.
        """
        ...

    def read_demonstration(self, path: Path) -> Demonstration:
        """An expert of unknown weights from a file.

        Raises:
            InvalidInputError: If the file does not hold one, or the domain takes no files.
        """
        ...

    def learner(
        self,
        expert: Expert,
        options: Mapping[str, Any],
        *,
        rng: np.random.Generator,
        executor: Executor | None = None,
        on_step: OnStep | None = None,
    ) -> Learner:
        """Tools for whoever is to explain an expert.

        Args:
            expert: The expert.
            options: The request's, which say how it was recorded; never its weights.
            rng: Draws disturbances of what is measured.
            executor: Runs independent trajectories side by side; None keeps to one thread.
            on_step: Told of every step of the forward solver, in this process.
        """
        ...

    def picture(self, policy: Any) -> Any:
        """What its view needs in order to draw a policy."""
        ...

    def pack(self, policy: Any) -> Array:
        """A policy as one array, for files."""
        ...

    def unpack(self, packed: Array) -> Any:
        """Inverse of :meth:`pack`."""
        ...

    def pack_trajectories(self, trajectories: Sequence[Any]) -> Mapping[str, Array]:
        """Recorded trajectories as arrays by name, for a file."""
        ...


def settings(
    known: Mapping[str, Option], given: Mapping[str, Any], owner: str, why: str = ""
) -> dict[str, Any]:
    """All options: those given, the others by default.

    Args:
        known: What is understood.
        given: Values by name.
        owner: Whose options they are, for a complaint.
        why: Why it takes no others, for a complaint.

    Raises:
        InvalidInputError: If a name or a choice is unknown, or a value is of another type.
    """
    unknown = [name for name in given if name not in known]
    if unknown:
        reason = f": {why}" if why else ""
        raise InvalidInputError(f"{owner} takes no {', '.join(unknown)}{reason}")
    for name, value in given.items():
        default, choices = known[name].default, known[name].choices
        if choices and value not in choices:
            raise InvalidInputError(f"unknown {name} {value!r}; choose from {', '.join(choices)}")
        kinds = (int, float) if isinstance(default, float) else (type(default),)
        if not isinstance(value, kinds):
            raise InvalidInputError(f"{name} must be a {kinds[-1].__name__}, got {value!r}")
    return {name: given.get(name, option.default) for name, option in known.items()}


def refuse(given: Iterable[str], without_effect: Iterable[str], why: str) -> None:
    """Complain about options that would change nothing.

    Raises:
        InvalidInputError: If one of them is given.
    """
    names = [name for name in given if name in set(without_effect)]
    if names:
        raise InvalidInputError(f"{why}: leave out {', '.join(names)}")
