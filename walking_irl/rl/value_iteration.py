"""Value iteration with a stated tolerance (R. Bellman, 1957; Puterman 1994, section 6.3)."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.rl.chain import Chain
from walking_irl.rl.finite_mdp import FiniteMDP, Solution


def value_iteration(
    mdp: FiniteMDP, w: Array, *, tol: float = 1e-9, max_iter: int = 100_000
) -> Solution:
    """A policy whose value is within ``tol`` of the optimal one in every state.

    Sweeps V <- max_a (r + gamma T_a V) until they move by at most tol (1 - gamma) / (2 gamma)
    (Puterman 1994, Theorem 6.3.1). The greedy policy is then evaluated exactly, so that ``V`` and
    ``mu`` belong to it; only its choice of actions is approximate.

    Args:
        mdp: The world.
        w: Weights, shape (K,).
        tol: Largest loss of the policy's value in any state.
        max_iter: Number of sweeps after which it gives up.

    Raises:
        InvalidInputError: If ``tol`` is not positive.
        SolverError: If the sweeps have not settled after ``max_iter``.
    """
    if not tol > 0:
        raise InvalidInputError(f"tol must be positive, got {tol}")
    r, V = mdp.reward(w), np.zeros(mdp.n_states)
    bound = tol * (1 - mdp.discount) / (2 * max(mdp.discount, 1e-12))
    for n_iter in range(1, max_iter + 1):
        Q = mdp.action_values(r, V)
        V_next = Q.max(axis=0)
        change = float(np.abs(V_next - V).max())
        V = V_next
        if change <= bound:
            pi = mdp.action_values(r, V).argmax(axis=0)
            chain = Chain(mdp, pi)
            mu = mdp.Phi.T @ chain.solve_transposed(mdp.start)
            return Solution(pi, chain.solve(r), mu, n_iter)
    raise SolverError(f"value iteration still moves by {change:.1e} after {max_iter} sweeps")
