"""Random finite MDPs: worlds without structure, on which no method is favoured.

Source: the Garnet problems of Archibald, McKinnon & Thomas (1995), with random features.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from walking_irl.arrays import Array
from walking_irl.domains.mdp.finite import FiniteDomain
from walking_irl.domains.mdp.soft_expert import soft_expert
from walking_irl.domains.weights import checked_weights
from walking_irl.errors import InvalidInputError
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.types import Expert, Objective


class RandomMDP(FiniteDomain):
    """Every action of every state reaches ``branching`` random states; random features in [0, 1].

    The next states are drawn without replacement, their probabilities from a flat Dirichlet
    distribution; a trajectory starts anywhere.

    Args:
        n_states: S, 2 to 5000.
        n_actions: A, at least 2.
        n_objectives: K, at least 2.
        branching: Next states of each state and action.
        discount: gamma in [0, 1).
        seed: Of the world; another one is another world.
        method: Forward solver, see :class:`FiniteDomain`.
    """

    def __init__(
        self,
        n_states: int = 50,
        n_actions: int = 4,
        n_objectives: int = 5,
        branching: int = 5,
        discount: float = 0.9,
        seed: int = 0,
        method: str = "policy-iteration",
    ) -> None:
        if not 2 <= n_states <= 5000 or n_actions < 2 or n_objectives < 2:
            raise InvalidInputError(
                "a random MDP takes 2 to 5000 states and at least 2 actions and 2 objectives, got "
                f"{n_states}, {n_actions} and {n_objectives}"
            )
        if not 1 <= branching <= n_states:
            raise InvalidInputError(f"branching must lie in [1, {n_states}], got {branching}")
        rng = np.random.default_rng(seed)
        T = _transitions(n_states, n_actions, branching, rng)
        Phi, start = rng.random((n_states, n_objectives)), np.full(n_states, 1 / n_states)
        objectives = tuple(
            Objective(f"feature {i + 1}", "1", 1.0, f"Be where feature {i + 1} is large.")
            for i in range(n_objectives)
        )
        super().__init__("random-mdp", objectives, FiniteMDP(T, Phi, start, discount), method)

    def suboptimal_expert(self, w_E: Array, rng: np.random.Generator) -> Expert:
        """Expert that weighs actions by exp(20 Q), unknown to the learner."""
        return soft_expert(self.mdp, checked_weights(w_E, len(self.objectives)))


def _transitions(S: int, A: int, branching: int, rng: np.random.Generator) -> sparse.csr_array:
    """Sparse (A * S, S)."""
    columns = [rng.choice(S, branching, replace=False) for _ in range(A * S)]
    values = rng.dirichlet(np.ones(branching), A * S)
    rows = np.repeat(np.arange(A * S), branching)
    return sparse.csr_array((values.ravel(), (rows, np.concatenate(columns))), shape=(A * S, S))
