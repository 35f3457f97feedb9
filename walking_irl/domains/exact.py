"""What domains share whose experts are known exactly: a starting point for a domain of your own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.contract import (
    Defaults,
    Demonstration,
    Learner,
    OnStep,
    Option,
    Request,
    Truth,
    settings,
)
from walking_irl.errors import InvalidInputError
from walking_irl.types import Expert, Objective, Response

UNIFORM = "uniform"


class ExactDomain:
    """A domain by its name, its objectives, ``forward`` and ``expert``.

    Everything else has a default: ground-truth weights are uniform on the simplex, a learner gets
    ``forward``, policies are arrays, and a recording shows the weights without a picture.
    """

    name: str
    objectives: tuple[Objective, ...]
    options: Mapping[str, Option] = {}
    defaults = Defaults()
    view: str | None = None
    has_trajectories = False

    @property
    def question(self) -> str:
        """What a recovery answers."""
        return f"What does the expert of {self.name} want?"

    def forward(self, w: Array) -> Response:
        """Best policy for weights ``w`` of the simplex, shape (K,)."""
        raise NotImplementedError

    def expert(self, w_E: Array, rng: np.random.Generator) -> Expert:
        """Expert that is optimal for weights ``w_E``, shape (K,), with exact features."""
        response = self.forward(w_E)
        return Expert(response.mu, np.zeros_like(response.mu), demonstration=response.policy)

    def suboptimal_expert(self, w_E: Array, rng: np.random.Generator) -> Expert:
        """Expert that is not optimal for weights ``w_E``.

        Raises:
            InvalidInputError: If there is none.
        """
        raise InvalidInputError(f"domain {self.name} has no suboptimal expert")

    def random_weights(self, population: str, rng: np.random.Generator) -> Array:
        """Ground-truth weights, uniform on the simplex, shape (K,).

        Raises:
            InvalidInputError: If there is no such population.
        """
        if population != UNIFORM:
            raise InvalidInputError(f"unknown population {population!r}; choose {UNIFORM}")
        return rng.dirichlet(np.ones(len(self.objectives)))

    def demonstrate(
        self, request: Request, *, rng: np.random.Generator, executor: Executor | None = None
    ) -> Demonstration:
        """Draw weights unless they are given, and solve for their expert."""
        why = "its experts are known exactly"
        given = settings(self.options, request.options, f"domain {self.name}", why)
        w_E = request.weights
        if w_E is None:
            w_E = self.random_weights(given.get("population", UNIFORM), rng)
        make = self.expert if request.expert == "optimal" else self.suboptimal_expert
        expert = make(w_E, rng)
        return Demonstration(expert, expert.demonstration, Truth(w_E, expert.mu))

    def read_demonstration(self, path: Path) -> Demonstration:
        """Complain: its experts are made, not read."""
        raise InvalidInputError(f"domain {self.name} takes no demonstration files")

    def learner(
        self,
        expert: Expert,
        options: Mapping[str, Any],
        *,
        rng: np.random.Generator,
        executor: Executor | None = None,
        on_step: OnStep | None = None,
    ) -> Learner:
        """The forward solver as it is."""
        return Learner(self.forward)

    def picture(self, policy: Any) -> Any:
        """The policy itself."""
        return policy

    def pack(self, policy: Any) -> Array:
        """A policy as one array, for files: itself."""
        return np.asarray(policy)

    def unpack(self, packed: Array) -> Any:
        """Inverse of :meth:`pack`."""
        return packed

    def pack_trajectories(self, trajectories: Sequence[Any]) -> Mapping[str, Array]:
        """Nothing is recorded of an expert that is known exactly."""
        return {}
