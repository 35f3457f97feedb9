"""Policy iteration with exact evaluation (R. Howard, 1960; Puterman 1994, section 6.4)."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import SolverError
from walking_irl.rl.chain import Chain
from walking_irl.rl.finite_mdp import Actions, FiniteMDP, Solution

TIE = 1e-10
"""Relative gain below which a state keeps its action: rounding must not make policies cycle."""


def policy_iteration(
    mdp: FiniteMDP, w: Array, *, pi: Actions | None = None, max_iter: int = 200
) -> Solution:
    """Optimal policy for reward w.phi, exact to rounding.

    Args:
        mdp: The world.
        w: Weights, shape (K,).
        pi: Policy to start from, shape (S,); action 0 everywhere by default.
        max_iter: Number of improvements after which it gives up.

    Raises:
        SolverError: If the policy still changes after ``max_iter`` improvements.
    """
    r, states = mdp.reward(w), np.arange(mdp.n_states)
    pi = np.zeros(mdp.n_states, dtype=np.intp) if pi is None else pi.copy()
    for n_iter in range(1, max_iter + 1):
        chain = Chain(mdp, pi)
        V = chain.solve(r)
        Q = mdp.action_values(r, V)
        margin = TIE * max(1.0, float(np.abs(V).max()))
        is_better = Q.max(axis=0) > Q[pi, states] + margin
        if not is_better.any():
            mu = mdp.Phi.T @ chain.solve_transposed(mdp.start)
            return Solution(pi, V, mu, n_iter)
        pi = np.where(is_better, Q.argmax(axis=0), pi)
    raise SolverError(f"policy iteration still changes the policy after {max_iter} improvements")
