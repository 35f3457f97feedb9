"""Maximum causal entropy IRL: likelihood of actions, and feature matching (B. Ziebart, 2010).

Both take the soft-optimal policy pi_w of rewards w.phi. The likelihood needs the demonstrated
actions alone; matching needs feature expectations alone, and is the regret f(w) of CPIRL with a
softmax in place of the maximum over actions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize

from walking_irl.arrays import Array
from walking_irl.baselines.recovered import Recovered, from_weights, not_negative, positive
from walking_irl.rl.chain import Chain
from walking_irl.rl.demonstrations import Demonstrations
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.rl.soft import mce_loglik, soft_policy
from walking_irl.types import Expert, Status

Entry = tuple[float, Array]
"""A line of a log: the objective, and the weights (K,) that it is of."""
LIKELIHOOD_RIDGE = 1e-3
MATCHING_RIDGE = 1e-2
LARGE = 1e4
"""|w| / (1 - gamma) beyond which a matched deterministic expert has sent weights to infinity."""


def mce_likelihood(
    mdp: FiniteMDP,
    demonstrations: Demonstrations,
    *,
    ridge: float = LIKELIHOOD_RIDGE,
    max_iter: int = 500,
) -> Recovered:
    """Weights under which the soft-optimal policy most likely acts as demonstrated.

    Maximises sum c(s, a) log pi_w(a|s) / n - ridge/2 |w|^2 by L-BFGS.

    Args:
        mdp: The world.
        demonstrations: States and actions, of any length and from any start.
        ridge: Weight of |w|^2 / 2; keeps the weights of a deterministic expert finite.
        max_iter: Budget of L-BFGS iterations.

    Returns:
        Free weights: their scale is the expert's inverse temperature.
    """
    not_negative(ridge=ridge)
    positive(max_iter=max_iter)
    counts = demonstrations.counts(mdp.n_states, mdp.n_actions)
    n, Phi = counts.sum(), mdp.Phi
    V: Array | None = None
    log: list[Entry] = []

    def objective(w: Array) -> tuple[float, Array]:
        nonlocal V
        L = mce_loglik(mdp, Phi @ w, counts, V=V)
        V = L.V
        log.append((L.value / n, w.copy()))
        return -L.value / n + 0.5 * ridge * w @ w, ridge * w - Phi.T @ L.gradient / n

    return _minimised(mdp, objective, log, max_iter, gtol=1e-5, ftol=2e-9)


def soft_regret(
    mdp: FiniteMDP, w: Array, mu_E: Array, *, temperature: float = 1.0, V: Array | None = None
) -> tuple[float, Array, Array]:
    """f_tau(w) = tau start.V_soft(w / tau) - w.mu_E, its gradient mu(pi) - mu_E, and V_soft.

    f <= f_tau <= f + tau ln A / (1 - gamma) with the regret f(w) = max_pi w.mu(pi) - w.mu_E: the
    entropy of a policy is worth at most that much. Hence a minimiser of f_tau on a set of weights
    has at most that much more regret than the best there.
    """
    soft = soft_policy(mdp, mdp.reward(w) / temperature, V=V)
    mu = mdp.Phi.T @ Chain(mdp, soft.pi).solve_transposed(mdp.start)
    value = temperature * float(mdp.start @ soft.V) - float(w @ mu_E)
    return value, mu - mu_E, soft.V


def mce_matching(
    mdp: FiniteMDP,
    expert: Expert,
    *,
    ridge: float = MATCHING_RIDGE,
    max_iter: int = 200,
) -> Recovered:
    """Weights whose soft-optimal policy has the expert's feature expectations.

    Minimises start.V_soft(w) - w.mu_E + ridge/2 |w|^2, convex, by L-BFGS. A deterministic expert
    lies on the boundary of what soft policies reach: without a ridge its weights run to infinity.

    Args:
        mdp: The world, entered as the expert enters it.
        expert: Feature expectations; only ``mu`` is used.
        ridge: Weight of |w|^2 / 2.
        max_iter: Budget of L-BFGS iterations.

    Returns:
        Free weights; ``info["residual"]`` is the largest difference of features that is left.
    """
    not_negative(ridge=ridge)
    positive(max_iter=max_iter)
    V: Array | None = None
    log: list[Entry] = []

    def objective(w: Array) -> tuple[float, Array]:
        nonlocal V
        value, gradient, V = soft_regret(mdp, w, expert.mu, V=V)
        value += 0.5 * ridge * float(w @ w)
        log.append((value, w.copy()))
        return value, gradient + ridge * w

    found = _minimised(mdp, objective, log, max_iter, gtol=1e-9, ftol=0.0)
    assert found.w is not None
    residual = float(np.abs(soft_regret(mdp, found.w, expert.mu)[1]).max())
    notes: tuple[str, ...] = ()
    if np.abs(found.w).max() / (1 - mdp.discount) > LARGE:
        notes = (
            "the weights run to infinity: a deterministic expert cannot be matched by soft "
            "policies; raise the ridge",
        )
    return replace(found, info={**found.info, "residual": residual}, notes=notes)


def _minimised(
    mdp: FiniteMDP,
    objective: Callable[[Array], tuple[float, Array]],
    log: list[Entry],
    max_iter: int,
    *,
    gtol: float,
    ftol: float,
) -> Recovered:
    result = minimize(
        objective,
        np.zeros(mdp.n_objectives),
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": max_iter, "maxfun": 5 * max_iter, "gtol": gtol, "ftol": ftol},
    )
    status = Status.BUDGET if result.nit >= max_iter else Status.CONVERGED
    return from_weights(
        mdp,
        np.asarray(result.x),
        "free",
        objective=np.array([value for value, _ in log]),
        iterates=np.array([w for _, w in log]),
        status=status,
        info={"solves": int(result.nfev)},
    )
