"""The dual linear program of an MDP, over occupancy measures (Puterman 1994, section 6.9)."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from walking_irl.arrays import Array
from walking_irl.errors import SolverError
from walking_irl.rl.chain import Chain
from walking_irl.rl.finite_mdp import FiniteMDP, Solution


def flow_constraints(mdp: FiniteMDP) -> Any:
    """Sparse (S, A * S) matrix F of the Bellman flow F x = start, column ``a * S + s``.

    sum_a x(s, a) - gamma sum_{s', a} T(s', a, s) x(s', a) = start(s).
    """
    identity = sparse.hstack([sparse.eye_array(mdp.n_states)] * mdp.n_actions)
    return (identity - mdp.discount * mdp.T.T).tocsr()


def linear_program(mdp: FiniteMDP, w: Array) -> Solution:
    """Optimal policy for reward w.phi from max {r.x : F x = start, x >= 0}.

    HiGHS solves the program to 1e-7; the policy takes the most visited action of each state (an
    unvisited state takes the greedy one) and is then evaluated exactly.

    Args:
        mdp: The world.
        w: Weights, shape (K,).

    Raises:
        SolverError: If HiGHS finds no solution.
    """
    r = mdp.reward(w)
    from scipy.optimize import linprog  # takes .3 s; every finite domain comes by here

    result = linprog(
        -np.tile(r, mdp.n_actions),
        A_eq=flow_constraints(mdp),
        b_eq=mdp.start,
        bounds=(0, None),
        method="highs",
    )
    if result.status != 0:
        raise SolverError(f"the dual program of the MDP has no solution: {result.message}")
    x = result.x.reshape(mdp.n_actions, mdp.n_states)
    V = -result.eqlin.marginals  # multipliers of the flow: the values of visited states
    greedy = mdp.action_values(r, V).argmax(axis=0)
    pi = np.where(x.sum(axis=0) > 1e-9, x.argmax(axis=0), greedy)
    chain = Chain(mdp, pi)
    mu = mdp.Phi.T @ chain.solve_transposed(mdp.start)
    return Solution(pi, chain.solve(r), mu, int(result.nit))
