"""What all domains with finitely many states and actions share."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.contract import Defaults
from walking_irl.domains.exact import ExactDomain
from walking_irl.domains.weights import checked_weights
from walking_irl.errors import InvalidInputError
from walking_irl.rl.finite_mdp import Actions, FiniteMDP
from walking_irl.rl.policy_iteration import policy_iteration
from walking_irl.rl.value_iteration import value_iteration
from walking_irl.types import Expert, Objective, Response

METHODS = ("policy-iteration", "value-iteration")
DISTURBED = 0.25
"""Share of states in which a sub-optimal expert acts at random (our choice, as for the LQR)."""


class FiniteDomain(ExactDomain):
    """A finite MDP as a domain; policies are arrays of actions, shape (S,).

    Args:
        name: Name in the registry.
        objectives: One per feature.
        mdp: The world.
        method: Forward solver: "policy-iteration" (exact) or "value-iteration" (to 1e-9).
    """

    defaults = Defaults(max_solves=100)  # milliseconds each; levels take up to 48 for 9 regions

    def __init__(
        self,
        name: str,
        objectives: tuple[Objective, ...],
        mdp: FiniteMDP,
        method: str = "policy-iteration",
    ) -> None:
        if method not in METHODS:
            raise InvalidInputError(f"unknown method {method!r}; choose from {', '.join(METHODS)}")
        self.name, self.objectives, self.mdp, self.method = name, objectives, mdp, method

    def forward(self, w: Array) -> Response:
        """Best policy for weights ``w`` of the simplex, shape (K,)."""
        return self.solve(checked_weights(w, len(self.objectives)))

    def solve(self, w: Array) -> Response:
        """Best policy for any finite weights, negative ones included (Abbeel & Ng 2004)."""
        solver = policy_iteration if self.method == METHODS[0] else value_iteration
        solution = solver(self.mdp, w)
        return Response(solution.pi, solution.mu, info={"iterations": solution.n_iter})

    def expert(self, w_E: Array, rng: np.random.Generator) -> Expert:
        """Exactly optimal expert with exact feature expectations."""
        w_E = checked_weights(w_E, len(self.objectives))
        solution = policy_iteration(self.mdp, w_E)
        return Expert(solution.mu, np.zeros_like(solution.mu), demonstration=solution.pi)

    def suboptimal_expert(self, w_E: Array, rng: np.random.Generator) -> Expert:
        """Expert that acts at random in a quarter of the states, unknown to the learner."""
        pi: Actions = self.expert(w_E, rng).demonstration.copy()
        is_random = rng.random(pi.size) < DISTURBED
        pi[is_random] = rng.integers(self.mdp.n_actions, size=int(is_random.sum()))
        mu = self.mdp.feature_expectations(pi)
        return Expert(mu, np.zeros_like(mu), demonstration=pi)
