"""Maximum entropy IRL over paths (B. Ziebart et al., AAAI 2008), in both of its readings.

P(path | first state) ~ exp(sum_t g^t w.phi(s_t)) prod_t T(s_t, a_t, s_t+1). With
Z_t(s) = exp(g^t r(s)) sum_a sum_s' T(s, a, s') Z_t+1(s') the log-likelihood of the demonstrations
is w.F_E - sum_s start(s) log Z_1(s), concave; its gradient takes the visits of the *path measure*,
which goes on with s' ~ T Z. Where T is stochastic this lets the agent choose the outcomes of
chance. The paper's algorithm 1 visits by P(a|s) T instead: the agent's true dynamics, but the
gradient of no function.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy import sparse
from scipy.optimize import minimize

from walking_irl.arrays import Array
from walking_irl.baselines.recovered import Recovered, from_weights, not_negative, positive
from walking_irl.errors import InvalidInputError
from walking_irl.rl.demonstrations import Demonstrations
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.types import Status

Visits = Literal["paths", "dynamics"]
ADAM_RATE, ADAM_MEAN, ADAM_SQUARE = 0.05, 0.9, 0.99
"""Step length and forgetting factors of Adam (D. Kingma & J. Ba, 2015) for algorithm 1."""
TINY = 1e-300
"""Stands for sums that underflow: states from which only hopeless paths lead on."""
DENSE_SIZE = 30_000
"""Entries of T up to which a product with the dense array is faster."""
STOCHASTIC = "MaxEnt 2008 lets the agent choose what chance does: T is stochastic, prefer MCE"


class Backward(NamedTuple):
    """Backward pass of algorithm 1."""

    log_Z: Array
    """log Z_t(s) for t = 0..H-1, shape (H, S)."""
    ahead: Array
    """sum_s' T(s, a, s') Z_t+1(s') up to a factor of t, shape (H, A, S); 1 at the end."""
    z: Array
    """Z_t+1(s') up to the same factor, shape (H, S)."""


def backward(mdp: FiniteMDP, reward: Array, horizon: int, discount: float = 1.0) -> Backward:
    """Partition functions of paths with ``horizon`` states; discount 1 is the paper's."""
    S, A = mdp.n_states, mdp.n_actions
    T, _ = _transitions(mdp)
    powers = (discount ** np.arange(horizon))[:, None] * reward
    log_Z, z = np.zeros((horizon, S)), np.ones((horizon, S))
    ahead, top = np.ones((horizon, A, S)), 0.0
    for t in range(horizon - 1, -1, -1):
        if t < horizon - 1:
            top = log_Z[t + 1].max()
            z[t] = np.exp(log_Z[t + 1] - top)
            ahead[t] = (T @ z[t]).reshape(A, S)
        total = np.maximum(ahead[t].sum(axis=0), TINY)
        log_Z[t] = powers[t] + top + np.log(total)
    return Backward(log_Z, ahead, z)


def expected_visits(
    mdp: FiniteMDP, passed: Backward, start: Array, visits: Visits, discount: float = 1.0
) -> Array:
    """sum_t g^t P(s_t = s), shape (S,), under the path measure or under the true dynamics."""
    S, A = mdp.n_states, mdp.n_actions
    _, back = _transitions(mdp)
    shares = passed.ahead / np.maximum(passed.ahead.sum(axis=1, keepdims=True), TINY)
    d, total = start, np.zeros(S)
    for t, share in enumerate(shares):
        total += discount**t * d
        if t == len(shares) - 1:
            break
        if visits == "paths":  # P(s' | s) = sum_a T(s, a, s') Z(s') / sum_a ahead(a, s)
            ahead = np.maximum(passed.ahead[t].sum(axis=0), TINY)
            d = passed.z[t] * (back @ np.tile(d / ahead, A))
        else:
            d = back @ (share * d).ravel()
    return total


def _transitions(mdp: FiniteMDP) -> tuple[Any, Any]:
    """T, shape (A S, S), and its transpose; dense where that is faster."""
    if mdp.n_actions * mdp.n_states**2 <= DENSE_SIZE:
        T = mdp.dense.reshape(-1, mdp.n_states)
        return T, T.T
    T = sparse.csr_array(mdp.T)
    return T, T.T.tocsr()


def maxent(
    mdp: FiniteMDP,
    demonstrations: Demonstrations,
    *,
    visits: Visits = "paths",
    ridge: float = 1e-2,
    discount: float = 1.0,
    max_iter: int = 400,
) -> Recovered:
    """Weights that make the demonstrated paths most likely among all of the same length.

    Args:
        mdp: The world; its own discount plays no part.
        demonstrations: States and actions.
        visits: "paths", the exact gradient (L-BFGS), or "dynamics", algorithm 1 as printed (Adam
            with a fixed number of steps, as there is no function to search a line of).
        ridge: Weight of |w|^2 / 2.
        discount: Discount g within a path.
        max_iter: Budget of iterations, and the number of Adam's.

    Returns:
        Free weights; ``info["residual"]`` is the largest difference of features that is left.
    """
    not_negative(ridge=ridge)
    positive(discount=discount, max_iter=max_iter)
    if visits not in ("paths", "dynamics"):
        raise InvalidInputError(f"unknown visits {visits!r}; choose from paths, dynamics")
    demonstrations.check(mdp.n_states, mdp.n_actions)
    start, H = demonstrations.start(mdp.n_states), demonstrations.horizon
    F_E = demonstrations.features(mdp.Phi, discount).mean(axis=0)
    log: list[float] = []
    tried: list[Array] = []

    def likelihood(w: Array) -> tuple[float, Array]:
        passed = backward(mdp, mdp.Phi @ w, H, discount)
        gradient = F_E - mdp.Phi.T @ expected_visits(mdp, passed, start, visits, discount)
        log.append(float(w @ F_E - start @ passed.log_Z[0]))
        tried.append(w.copy())
        return log[-1] - 0.5 * ridge * float(w @ w), gradient - ridge * w

    if visits == "paths":
        result = minimize(
            lambda w: tuple(-part for part in likelihood(w)),
            np.zeros(mdp.n_objectives),
            jac=True,
            method="L-BFGS-B",
            options={"maxiter": max_iter},
        )
        w, status = np.asarray(result.x), Status.CONVERGED
        if result.nit >= max_iter:
            status = Status.BUDGET
    else:
        w, status = _adam(likelihood, mdp.n_objectives, max_iter), Status.BUDGET
    residual = float(np.abs(likelihood(w)[1] + ridge * w).max())
    return from_weights(
        mdp,
        w,
        "free",
        objective=np.array(log),
        iterates=np.array(tried),
        status=status,
        info={"solves": len(log), "residual": residual},
        notes=(STOCHASTIC,) if is_stochastic(mdp) else (),
    )


def is_stochastic(mdp: FiniteMDP) -> bool:
    """Whether some action may lead to more than one state."""
    return bool(mdp.T.max(axis=1).toarray().min() < 1 - 1e-12)


def _adam(likelihood: Callable[[Array], tuple[float, Array]], K: int, n_steps: int) -> Array:
    """Steps of Adam along what algorithm 1 takes for a gradient."""
    w, mean, square = np.zeros((3, K))
    for k in range(1, n_steps + 1):
        step = likelihood(w)[1]
        mean = ADAM_MEAN * mean + (1 - ADAM_MEAN) * step
        square = ADAM_SQUARE * square + (1 - ADAM_SQUARE) * step**2
        size = np.sqrt(square / (1 - ADAM_SQUARE**k)) + 1e-8
        w = w + ADAM_RATE * mean / (1 - ADAM_MEAN**k) / size
    return np.asarray(w)
