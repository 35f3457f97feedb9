"""What a method is given: a world as far as it can be seen, and what is known of the expert.

No method knows domains. A world is a finite MDP, or anything that has one as ``mdp``, or anything
with ``forward``; ``policy_gradient`` (a policy's d mu / d theta, shape (p, K)) is used where it is
offered. What a world or an expert lacks is said in one sentence.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.recovered import from_start
from walking_irl.cpirl import cpirl
from walking_irl.errors import InvalidInputError
from walking_irl.expert import check_expert
from walking_irl.rl.demonstrations import Demonstrations
from walking_irl.rl.finite_mdp import Actions, FiniteMDP
from walking_irl.rl.tabular import best_policy, checked_policy
from walking_irl.types import Expert, Forward, Response

HOOKS = {
    "policy_gradient": "policies with parameters and the gradient of their features",
    "advantages": "deviations from a policy whose features can be told",
    "nearest": "policies with parameters that can be compared",
}
"""What a world may offer beside its solver, in words; see :mod:`walking_irl.domains.contract`."""
ARCHIVE_SOLVES = 60
"""Forward solves of the CPIRL run whose policies are an archive, where none is given."""


@dataclass(frozen=True)
class Given:
    """A world and an expert, as one method asks for them.

    Attributes:
        method: Name of the method, for complaints.
        world: A finite MDP, a domain with one, or a domain with ``forward``.
        data: Demonstrated states and actions, or an expert's features (and policy).
    """

    method: str
    world: Any
    data: Demonstrations | Expert

    def __post_init__(self) -> None:
        if not isinstance(self.data, Demonstrations | Expert):
            raise InvalidInputError(
                f"{self.method} needs Demonstrations or an Expert, got {type(self.data).__name__}"
            )
        if isinstance(self.data, Expert):
            check_expert(self.data)

    @property
    def name(self) -> str:
        """What the world is called in sentences."""
        return str(getattr(self.world, "name", type(self.world).__name__))

    @property
    def is_finite(self) -> bool:
        """Whether there are finitely many states and actions."""
        return self._mdp is not None

    @property
    def _mdp(self) -> FiniteMDP | None:
        found = self.world if isinstance(self.world, FiniteMDP) else None
        found = getattr(self.world, "mdp", None) if found is None else found
        return found if isinstance(found, FiniteMDP) else None

    @property
    def mdp(self) -> FiniteMDP:
        """The finite world itself.

        Raises:
            InvalidInputError: If there is none.
        """
        if self._mdp is None:
            raise InvalidInputError(
                f"{self.method} needs finitely many states and actions with a known model, "
                f"{self.name} has not"
            )
        return self._mdp

    @property
    def planned(self) -> FiniteMDP:
        """The finite world, entered where the demonstrations begin if there are some."""
        if isinstance(self.data, Demonstrations):
            return from_start(self.mdp, self.data)
        return self.mdp

    @property
    def demonstrations(self) -> Demonstrations:
        """States and actions.

        Raises:
            InvalidInputError: If only features are known.
        """
        if not isinstance(self.data, Demonstrations):
            raise InvalidInputError(
                f"{self.method} needs demonstrated states and actions, an expert's features are "
                "not enough: draw trajectories with rl.demonstrations.demonstrate"
            )
        self.data.check(self.mdp.n_states, self.mdp.n_actions)
        return self.data

    @property
    def expert(self) -> Expert:
        """Feature expectations, with error bars where there are at least two trajectories."""
        if isinstance(self.data, Expert):
            return self.data
        mdp, data = self.mdp, self.demonstrations
        if data.n_trajectories > 1:
            return data.expert(mdp.Phi, mdp.discount)
        return self.exact

    @property
    def exact(self) -> Expert:
        """The same without error bars."""
        if isinstance(self.data, Expert):
            return self.data
        mu = self.demonstrations.feature_expectations(self.mdp.Phi, self.mdp.discount)
        return Expert(mu, np.zeros_like(mu), demonstration=self.data)

    @property
    def policy(self) -> Actions:
        """The expert's complete, deterministic policy, shape (S,).

        Raises:
            InvalidInputError: If it is not known in every state.
        """
        known = self.data.demonstration if isinstance(self.data, Expert) else None
        mdp = self.mdp
        if known is None or np.shape(known) != (mdp.n_states,):
            raise InvalidInputError(
                f"{self.method} needs the expert's complete policy, an action for each of "
                f"{mdp.n_states} states: give an Expert whose demonstration is that array"
            )
        return np.asarray(checked_policy(mdp, known), dtype=np.intp)

    @cached_property
    def forward(self) -> Forward:
        """Best policy for weights; takes negative ones in finite worlds only.

        Raises:
            InvalidInputError: If the world has no solver.
        """
        if self.is_finite:
            return solver(self.planned)
        forward: Forward | None = getattr(self.world, "forward", None)
        if forward is None:
            raise InvalidInputError(f"{self.method} needs a forward solver, {self.name} has none")
        return forward

    @property
    def policy_gradient(self) -> Array:
        """Gradient of each feature in the parameters of the expert's policy, shape (p, K).

        Raises:
            InvalidInputError: If the world or the expert does not offer it.
        """
        G: Array = self.offered("policy_gradient")(self.shown)
        return G

    @property
    def shown(self) -> Any:
        """The expert's policy, as the world has policies.

        Raises:
            InvalidInputError: If only features are known.
        """
        if not isinstance(self.data, Expert) or self.data.demonstration is None:
            raise InvalidInputError(
                f"{self.method} needs the expert's policy: give an Expert with its demonstration"
            )
        return self.data.demonstration

    @property
    def least(self) -> float:
        """The world's lower bound of every weight."""
        return float(getattr(getattr(self.world, "defaults", None), "min_weight", 0.0))

    @property
    def oracle(self) -> Forward:
        """The solver, moved off the faces of the simplex where a world asks for that.

        For methods whose queries are corners: where a weight vanishes the optimum may not exist.
        """
        forward = self.forward
        share = float(getattr(getattr(self.world, "defaults", None), "interior", 0.0))
        if self.is_finite or share == 0.0:
            return forward
        return lambda w: forward((1 - share) * w + share / len(w))

    def offered(self, hook: str) -> Callable[..., Any]:
        """What a world may offer beside its solver, by name.

        Raises:
            InvalidInputError: If this one does not.
        """
        found: Callable[..., Any] | None = getattr(self.world, hook, None)
        if found is None:
            raise InvalidInputError(
                f"{self.method} needs {HOOKS[hook]}, {self.name} offers no {hook}"
            )
        return found

    def archive(
        self, rng: np.random.Generator, max_solves: int = ARCHIVE_SOLVES
    ) -> tuple[Array, int]:
        """Features of policies that a recovery by CPIRL evaluates, (n, K), and its solves.

        By cuts alone: Newton's method would need too few policies to surround the expert.
        """
        forward, n_solves = self.forward, 0

        def cuts_only(w: Array) -> Response:
            nonlocal n_solves
            n_solves += 1
            return replace(forward(w), sensitivity=None)

        run = cpirl(
            cuts_only,
            self.exact,
            mode="minimise",
            max_solves=max_solves,
            min_weight=self.least,
            rng=rng,
        )
        rows = []
        for it in run:
            rows += [it.response.mu[None], it.response.evaluated.reshape(-1, it.w.size)]
        return np.concatenate(rows), n_solves


def solver(mdp: FiniteMDP) -> Forward:
    """Policy iteration of a finite world, each solve from the policy before."""
    pi: Actions | None = None

    def forward(w: Array) -> Response:
        nonlocal pi
        best = best_policy(mdp, mdp.reward(w), pi=pi)
        pi = best.pi
        return Response(pi, mdp.Phi.T @ best.chain.solve_transposed(mdp.start))

    return forward


def signed(mdp: FiniteMDP) -> FiniteMDP:
    """The same world with the features (phi, -phi): weights of the simplex become signed ones."""
    return replace(mdp, Phi=np.column_stack([mdp.Phi, -mdp.Phi]))
