"""Linear programming (U. Syed, M. Bowling & R. Schapire, Apprenticeship learning, ICML 2008)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy import sparse
from scipy.optimize import linprog

from walking_irl.baselines.apprentice import Apprentice
from walking_irl.baselines.loop import USUAL, Setting
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.rl.finite_mdp import normalised_occupancy
from walking_irl.rl.linear_program import flow_constraints
from walking_irl.types import Expert, Forward, Response, Status


def lpal(
    forward: Forward,
    expert: Expert,
    *,
    rng: np.random.Generator,
    setting: Setting = USUAL,
    tol: float = 0.0,
    max_solves: int = 0,
) -> Iterator[Apprentice]:
    """The stationary policy that beats the expert by the widest margin in its worst feature.

    max B subject to B <= mu_i(x) - mu_E_i for all i and the Bellman flow of x >= 0 (equations 9 to
    12); one program, no forward solves. The worst weights are its multipliers. Arguments: see
    :class:`~.loop.Baseline`; only the expert and ``setting.mdp`` are used.

    Yields:
        One stochastic policy (S, A) as a mixture of one; ``info["margin"]`` is B.

    Raises:
        InvalidInputError: If there is no finite MDP.
        SolverError: If HiGHS finds no solution.
    """
    mdp = setting.mdp
    if mdp is None:
        raise InvalidInputError("LPAL needs finitely many states and actions; this domain has not")
    n = mdp.n_states * mdp.n_actions
    flow = sparse.hstack([flow_constraints(mdp), sparse.csr_array((mdp.n_states, 1))])
    features = sparse.csr_array(np.tile(mdp.Phi.T, mdp.n_actions))
    margin = sparse.hstack([-features, sparse.csr_array(np.ones((mdp.n_objectives, 1)))])
    result = linprog(
        np.r_[np.zeros(n), -1.0],
        A_ub=margin,
        b_ub=-expert.mu,
        A_eq=flow,
        b_eq=mdp.start,
        bounds=[(0, None)] * n + [(None, None)],
        method="highs",
    )
    if result.status != 0:
        raise SolverError(f"LPAL's program has no solution: {result.message}")
    pi = normalised_occupancy(result.x[:n].reshape(mdp.n_actions, mdp.n_states).T)
    info = {"margin": float(result.x[-1]), "iterations": int(result.nit)}
    response = Response(pi, mdp.feature_expectations(pi), info=info)
    w = -result.ineqlin.marginals
    yield Apprentice(w[None], (response,), np.ones(1), expert.mu, Status.GAP_CLOSED)
