"""Ng & Russell 1: a reward for every state from a complete policy and a known model.

A. Ng & S. Russell, Algorithms for inverse reinforcement learning (ICML 2000), section 3:
max sum_s min_a d_sa - l1 |r|_1, d_sa = (T_pi(s) - T_a(s)) (I - gamma T_pi)^-1 r >= 0, |r| <= r_max.
With the values V as variables r = (I - gamma T_pi) V is sparse and no inverse is needed.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.optimize import linprog

from walking_irl.arrays import Array, Indices
from walking_irl.baselines.recovered import Recovered, not_negative, positive
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.rl.finite_mdp import Actions, FiniteMDP
from walking_irl.rl.tabular import best_policy, checked_policy

SHARE = 0.5
"""Default penalty, relative to the smallest one at which the reward is 0."""
SAME = 1e-12


class Rows(NamedTuple):
    """(T_pi(s) - T_a(s)) for each state and each action that leads elsewhere."""

    D: Any
    """Sparse, shape (n, S)."""
    owner: Indices
    """Position of the row's state among the states asked for, shape (n,)."""


def deviations(mdp: FiniteMDP, pi: Actions, states: Indices) -> Rows:
    """One row for every other action of these states; those like the policy's own are left out.

    At a wall several actions do the same: such a row would force the state's margin to 0.
    """
    S = mdp.n_states
    T = sparse.csr_array(mdp.T)
    own = T[pi * S + np.arange(S)][states]
    rows, owner = [], []
    for a in range(mdp.n_actions):
        D = (own - T[a * S : (a + 1) * S][states]).tocsr()
        differs = np.flatnonzero(abs(D).max(axis=1).toarray().ravel() > SAME)
        rows.append(D[differs])
        owner.append(differs)
    return Rows(sparse.vstack(rows).tocsr(), np.concatenate(owner).astype(np.intp))


def ng_russell_1(
    mdp: FiniteMDP, policy: Actions, *, l1: float | None = None, r_max: float = 1.0
) -> Recovered:
    """The bounded reward under which the policy beats all single deviations by most.

    Args:
        mdp: The world; its features play no part.
        policy: The expert's complete policy, shape (S,).
        l1: Penalty of |r|_1; half of :func:`critical_penalty` by default.
        r_max: Bound of |r|.

    Returns:
        A tabular reward for which the policy is optimal; the answer's ``policy`` is found by
        policy iteration from the expert's own. As other policies may tie with it (r = 0 makes all
        equal), ``info["other_policy"]`` is the one that a fresh solver finds.

    Raises:
        InvalidInputError: If the policy is not complete and deterministic.
        SolverError: If HiGHS finds no solution.
    """
    positive(r_max=r_max)
    pi = _complete(mdp, policy)
    critical = critical_penalty(mdp, pi)
    l1 = SHARE * critical if l1 is None else l1
    not_negative(l1=l1)
    S = mdp.n_states
    result = _program(
        mdp, pi, np.r_[np.zeros(S), -np.ones(S), np.full(S, l1)], r_max=r_max, budget=None
    )
    V = result.x[:S]
    reward = V - mdp.discount * (mdp.T @ V)[pi * S + np.arange(S)]
    reward[np.abs(reward) <= 1e-9 * r_max] = 0.0
    own = best_policy(mdp, reward, pi=pi)
    return Recovered(
        reward=reward,
        policy=own.pi,
        mu=mdp.Phi.T @ own.chain.solve_transposed(mdp.start),
        objective=np.array([-result.fun]),
        info={
            "l1": l1,
            "critical_l1": critical,
            "other_policy": best_policy(mdp, reward).pi,
            "solves": 0,
        },
    )


def critical_penalty(mdp: FiniteMDP, policy: Actions) -> float:
    """Smallest l1 whose reward is 0: max sum_s min_a d_sa subject to |r|_1 <= 1, one program.

    The objective is homogeneous in r, so that a penalty pays exactly if it is below this ratio.
    """
    S = mdp.n_states
    cost = np.r_[np.zeros(S), -np.ones(S), np.zeros(S)]
    return -float(_program(mdp, _complete(mdp, policy), cost, r_max=None, budget=1.0).fun)


def _program(
    mdp: FiniteMDP, pi: Actions, cost: Array, *, r_max: float | None, budget: float | None
) -> Any:
    """Minimise cost.(V, t, u) subject to d_sa >= t_s >= 0, |r| <= u <= r_max, sum u <= budget."""
    S = mdp.n_states
    D, owner = deviations(mdp, pi, np.arange(S))
    n = D.shape[0]
    reward = (sparse.eye_array(S) - mdp.discount * mdp.T[pi * S + np.arange(S)]).tocsr()
    pick = sparse.csr_array((np.ones(n), (np.arange(n), owner)), shape=(n, S))
    nothing, unit = sparse.csr_array((S, S)), sparse.eye_array(S)
    rows = [
        sparse.hstack([-D, pick, sparse.csr_array((n, S))]),
        sparse.hstack([reward, nothing, -unit]),
        sparse.hstack([-reward, nothing, -unit]),
    ]
    limit = np.zeros(n + 2 * S)
    if budget is not None:
        rows.append(sparse.csr_array(np.r_[np.zeros(2 * S), np.ones(S)][None]))
        limit = np.r_[limit, budget]
    highest = np.where(np.isin(np.arange(S), owner), np.inf, 0.0)  # no deviation: t_s = 0
    bounds = [(None, None)] * S + [(0, h) for h in highest] + [(0, r_max)] * S
    result = linprog(cost, A_ub=sparse.vstack(rows), b_ub=limit, bounds=bounds, method="highs")
    if result.status != 0:
        raise SolverError(f"the program of Ng & Russell has no solution: {result.message}")
    return result


def _complete(mdp: FiniteMDP, policy: Actions) -> Actions:
    pi = checked_policy(mdp, policy)
    if pi.ndim != 1:
        raise InvalidInputError("Ng & Russell need a deterministic policy, one action per state")
    return np.asarray(pi, dtype=np.intp)
