"""Ng & Russell 2: weights from a policy's advantages at sampled states (ICML 2000, section 4).

max sum_{s in S0} min_a p(w.X_sa) with X_sa = E_{s' ~ pi} Psi(s') - E_{s' ~ a} Psi(s') and
p(x) = min(x, 2 x): concave, hence a linear program with t_s <= w.X_sa, t_s <= 2 w.X_sa. The rows
X_sa are all that it needs, so it runs wherever one deviation from a policy can be evaluated.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse
from scipy.optimize import linprog

from walking_irl.arrays import Array, Indices
from walking_irl.baselines.ng_russell_1 import deviations
from walking_irl.baselines.recovered import Recovered, Space, from_weights, positive
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.rl.finite_mdp import Actions, FiniteMDP
from walking_irl.rl.successor import successor_states
from walking_irl.rl.tabular import checked_policy

PENALTY = 2.0
"""How much harder a violated constraint counts than a kept one (the paper's heuristic)."""


def margin_program(
    X: Array, owner: Indices, *, penalty: float = PENALTY, is_simplex: bool = False
) -> tuple[Array, float]:
    """Weights that maximise sum_s min over the rows of s of p(w.x), and that value.

    Args:
        X: Advantages of the expert's choice in each feature, shape (n, K).
        owner: Index of each row's state, shape (n,), from 0 without gaps.
        penalty: Slope of p for negative arguments, at least 1.
        is_simplex: Whether w >= 0 and sum w = 1; else |w_j| <= 1.

    Returns:
        Weights, shape (K,), and the value of the program.

    Raises:
        InvalidInputError: If there are no rows, or the penalty is below 1.
        SolverError: If HiGHS finds no solution.
    """
    X = np.asarray(X, dtype=np.float64)
    if X.ndim != 2 or not len(X) or len(owner) != len(X) or not np.isfinite(X).all():
        raise InvalidInputError(f"need finite rows (n >= 1, K) and their states, got {X.shape}")
    if not 1 <= penalty < np.inf:
        raise InvalidInputError(f"penalty must be at least 1 to be concave, got {penalty}")
    (n, K), m = X.shape, int(owner.max()) + 1
    pick = sparse.csr_array((np.ones(n), (np.arange(n), owner)), shape=(n, m))
    rows = sparse.vstack([sparse.hstack([-X, pick]), sparse.hstack([-penalty * X, pick])])
    equal: dict[str, Any] = {}
    if is_simplex:
        equal = {"A_eq": np.r_[np.ones(K), np.zeros(m)][None], "b_eq": [1.0]}
    result = linprog(
        np.r_[np.zeros(K), -np.ones(m)],
        A_ub=rows,
        b_ub=np.zeros(2 * n),
        bounds=[(0.0 if is_simplex else -1.0, 1.0)] * K + [(None, None)] * m,
        method="highs",
        **equal,
    )
    if result.status != 0:
        raise SolverError(f"the program of Ng & Russell has no solution: {result.message}")
    return np.asarray(result.x[:K]), -float(result.fun)


def ng_russell_2_sampled(
    advantages: tuple[Array, Indices], *, penalty: float = PENALTY, is_simplex: bool = True
) -> Recovered:
    """The same where deviations from the policy are sampled, whatever the world is made of.

    Args:
        advantages: Rows of :func:`margin_program` and their states; all features in one scale.
        penalty: Slope of p for negative arguments.
        is_simplex: Whether weights are known to be >= 0; else |w_j| <= 1.

    Returns:
        Weights whose error is of the order of the deviations' size; no forward solve is needed.
    """
    X, owner = advantages
    largest = max(float(np.abs(X).max(initial=0.0)), 1e-300)
    w, value = margin_program(X / largest, owner, penalty=penalty, is_simplex=is_simplex)
    if is_simplex:
        w = np.maximum(w, 0.0) / np.maximum(w, 0.0).sum()
    info = {"n_rows": len(X), "solves": 0}
    space: Space = "simplex" if is_simplex else "box"
    return Recovered(w=w, space=space, objective=np.array([value]), info=info)


def advantage_rows(
    mdp: FiniteMDP, pi: Actions, states: Indices, *, Psi: Array | None = None
) -> tuple[Array, Indices]:
    """Rows of :func:`margin_program` for some states of a finite world, and their states.

    Args:
        mdp: The world.
        pi: The expert's complete policy, shape (S,).
        states: Sampled states, shape (m,).
        Psi: Values of each feature under the policy, shape (S, K), for example by Monte Carlo;
            exact by default.
    """
    rows = deviations(mdp, pi, states)
    _, owner = np.unique(rows.owner, return_inverse=True)
    Psi = successor_states(mdp, pi) if Psi is None else Psi
    return np.asarray(rows.D @ Psi), owner.astype(np.intp)


def ng_russell_2(
    mdp: FiniteMDP,
    policy: Actions,
    *,
    rng: np.random.Generator,
    n_states: int = 50,
    penalty: float = PENALTY,
    is_simplex: bool = False,
) -> Recovered:
    """Weights from a complete policy and a sample of states.

    Args:
        mdp: The world.
        policy: The expert's complete policy, shape (S,).
        rng: Draws the states, without replacement.
        n_states: Number of states; all if there are fewer.
        penalty: Slope of p for negative arguments.
        is_simplex: Whether weights are known to be >= 0; else |w_j| <= 1.

    Raises:
        InvalidInputError: If the policy is not complete and deterministic, or no action of the
            sampled states leads elsewhere than the policy's.
    """
    positive(n_states=n_states)
    pi = checked_policy(mdp, policy)
    if pi.ndim != 1:
        raise InvalidInputError("Ng & Russell need a deterministic policy, one action per state")
    S = mdp.n_states
    states = np.sort(rng.choice(S, size=min(n_states, S), replace=False))
    X, owner = advantage_rows(mdp, np.asarray(pi, dtype=np.intp), states)
    w, value = margin_program(X, owner, penalty=penalty, is_simplex=is_simplex)
    space: Space = "simplex" if is_simplex else "box"
    info = {"n_rows": len(X), "solves": 0}
    return from_weights(mdp, w, space, objective=np.array([value]), info=info)
