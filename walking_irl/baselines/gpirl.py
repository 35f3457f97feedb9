"""GPIRL: rewards as a Gaussian process of the features (S. Levine, Z. Popovic & V. Koltun, 2011).

Kernel k(x, y) = beta exp(-1/2 (x-y)' Lambda (x-y) - [x != y] s sum Lambda) with s = .005: values at
m inducing states u give rewards r = K_ru K_uu^-1 u everywhere. Maximised over u, log Lambda and
log beta is

    log P(D | r) [MCE] - 1/2 u' K^-1 u - 1/2 log|K| - 1/2 tr K^-2 - sum log(1 + Lambda):

the last two terms are priors, against singular kernels and for few relevant features.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.optimize import minimize

from walking_irl.arrays import Array, Indices
from walking_irl.baselines.recovered import Recovered, from_reward, positive
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.rl.demonstrations import Demonstrations
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.rl.soft import mce_loglik
from walking_irl.types import Status

NOISE = 0.005
"""s: half of the variance 2 sigma^2 = .01 by which inputs are taken to be inexact."""
JITTER = 1e-8
"""Added to the diagonal of K_uu, relative to beta."""
BETA = 5.0
LOG_LAMBDA, LOG_BETA = (-12.0, 8.0), (-6.0, 8.0)
"""Bounds of the search; without them log Lambda of an irrelevant feature runs to -infinity."""
TRIAL_ITERATIONS = 30
REFUSED = 1e10
"""Objective where the kernel cannot be factorised."""


class Kernel(NamedTuple):
    """A kernel matrix and what its derivatives need."""

    K: Array
    """Shape (n, m)."""
    squares: Array
    """(x_i - y_i)^2 of each feature, shape (n, m, d)."""
    differs: Array
    """1 where two states are different, shape (n, m)."""


class GaussianProcess(NamedTuple):
    """A fitted reward function; transfer to other worlds is :meth:`predict`."""

    inducing: Array
    """Features of the inducing states, shape (m, d)."""
    u: Array
    """Their rewards, shape (m,)."""
    relevance: Array
    """Lambda: inverse squared length scale of each feature, shape (d,)."""
    beta: float
    """Variance of the rewards."""

    def predict(self, X: Array) -> Array:
        """Rewards of states with features X, shape (n, d), in any world: shape (n,)."""
        K = inducing_kernel(self.inducing, self.relevance, self.beta)[0]
        cross = kernel(self.inducing, X, self.relevance, self.beta, is_same=False).K
        r: Array = cross.T @ np.linalg.solve(K, self.u)
        return r


class LogPosterior(NamedTuple):
    """The objective at one point."""

    value: float
    gradient: Array
    """In u, log Lambda and log beta, shape (m + d + 1,)."""
    reward: Array
    """r(s), shape (S,)."""
    V: Array
    """Soft values, to start the next solve from, shape (S,)."""


def kernel(
    X: Array,
    Y: Array,
    relevance: Array,
    beta: float,
    *,
    is_same: bool,
    squares: Array | None = None,
) -> Kernel:
    """k(x, y) of all pairs; ``is_same`` says that X and Y are the same states.

    ``squares`` are their squared differences by feature, (n, m, d), where they are known.
    """
    if squares is None:
        squares = (X[:, None] - Y[None]) ** 2
    differs = 1.0 - np.eye(len(X)) if is_same else np.ones((len(X), len(Y)))
    K = beta * np.exp(-0.5 * squares @ relevance - NOISE * relevance.sum() * differs)
    return Kernel(K, squares, differs)


def inducing_kernel(
    X: Array, relevance: Array, beta: float, squares: Array | None = None
) -> tuple[Array, Kernel]:
    """K_uu with its jitter, shape (m, m), and the kernel without it."""
    plain = kernel(X, X, relevance, beta, is_same=True, squares=squares)
    return plain.K + JITTER * beta * np.eye(len(X)), plain


def log_posterior(
    x: Array,
    mdp: FiniteMDP,
    counts: Array,
    X: Array,
    inducing: Indices,
    V: Array | None = None,
    squares: Array | None = None,
) -> LogPosterior:
    """Objective and its gradient at x = (u, log Lambda, log beta), shape (m + d + 1,).

    ``squares`` are the squared differences of the inducing states to all by feature, (m, S, d).

    With a = K^-1 u, g = dL/dr, B = K^-1 K_ur g: d/du = B - a,
    d/dK_uu = M = -B a' + a a'/2 - K^-1/2 + K^-3, d/dK_ur = N = a g'.

    Raises:
        LinAlgError: If K_uu is singular.
        SolverError: If the soft values do not settle.
    """
    m, d = len(inducing), X.shape[1]
    u, relevance, beta = x[:m], np.exp(x[m : m + d]), math.exp(x[-1])
    own = None if squares is None else squares[:, inducing]
    K, plain = inducing_kernel(X[inducing], relevance, beta, own)
    cross = kernel(X[inducing], X, relevance, beta, is_same=False, squares=squares)
    factor = cho_factor(K)
    inverse = cho_solve(factor, np.eye(m))
    a = inverse @ u
    reward = cross.K.T @ a
    L = mce_loglik(mdp, reward, counts, V=V)
    log_det = 2 * np.log(np.diag(factor[0])).sum()
    value = L.value - 0.5 * u @ a - 0.5 * log_det - 0.5 * m * math.log(2 * math.pi)
    value += -0.5 * (inverse**2).sum() - np.log1p(relevance).sum()
    B = inverse @ (cross.K @ L.gradient)
    M = -np.outer(B, a) + 0.5 * np.outer(a, a) - 0.5 * inverse + inverse @ inverse @ inverse
    MK, NK = M * plain.K, np.outer(a, L.gradient) * cross.K
    by_lambda = -0.5 * (np.tensordot(MK, plain.squares, 2) + np.tensordot(NK, cross.squares, 2))
    by_lambda -= NOISE * ((MK * plain.differs).sum() + NK.sum())
    by_log_lambda = relevance * (by_lambda - 1 / (1 + relevance))
    by_log_beta = (M * K).sum() + NK.sum()
    return LogPosterior(float(value), np.r_[B - a, by_log_lambda, by_log_beta], reward, L.V)


def gpirl(
    mdp: FiniteMDP,
    demonstrations: Demonstrations,
    *,
    rng: np.random.Generator,
    features: Array | None = None,
    n_inducing: int = 64,
    n_starts: int = 5,
    max_iter: int = 200,
) -> Recovered:
    """A reward that need not be linear in the features, and which features it depends on.

    Args:
        mdp: The world.
        demonstrations: States and actions.
        rng: Draws inducing states and starts of the search (it has local optima).
        features: Continuous features, shape (S, d), scaled to about [0, 1]; the world's own by
            default.
        n_inducing: At most so many inducing states: the demonstrated ones, filled or thinned.
        n_starts: Starts that get 30 iterations each; the best gets ``max_iter`` more.
        max_iter: Budget of L-BFGS iterations.

    Returns:
        A tabular reward; ``info["process"]`` is the :class:`GaussianProcess`.

    Raises:
        InvalidInputError: If the features do not fit the world.
    """
    positive(n_inducing=n_inducing, n_starts=n_starts, max_iter=max_iter)
    X = np.asarray(mdp.Phi if features is None else features, dtype=np.float64)
    if X.ndim != 2 or len(X) != mdp.n_states or not np.isfinite(X).all():
        raise InvalidInputError(
            f"GPIRL needs finite features of shape ({mdp.n_states}, d), got {X.shape}"
        )
    counts = demonstrations.counts(mdp.n_states, mdp.n_actions)
    inducing = inducing_states(X, counts, n_inducing, rng)
    m, d = len(inducing), X.shape[1]
    squares = (X[inducing][:, None] - X[None]) ** 2
    V: Array | None = None
    log: list[float] = []

    def objective(x: Array) -> tuple[float, Array]:
        nonlocal V
        try:
            L = log_posterior(x, mdp, counts, X, inducing, V, squares)
        except (LinAlgError, SolverError):
            return REFUSED, np.zeros_like(x)
        if not math.isfinite(L.value):
            return REFUSED, np.zeros_like(x)
        V = L.V
        log.append(L.value)
        return -L.value, -L.gradient

    def search(x: Array, n: int) -> tuple[float, Array, int]:
        bounds = [(None, None)] * m + [LOG_LAMBDA] * d + [LOG_BETA]
        options = {"maxiter": n}
        r = minimize(objective, x, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
        return float(r.fun), np.asarray(r.x), int(r.nit)

    starts = [np.r_[rng.random(m), np.zeros(d), math.log(BETA)] for _ in range(n_starts)]
    best = min((search(x, TRIAL_ITERATIONS) for x in starts), key=lambda found: found[0])
    _, x, n_iter = search(best[1], max_iter)
    end = log_posterior(x, mdp, counts, X, inducing, V)
    process = GaussianProcess(X[inducing], x[:m], np.exp(x[m : m + d]), math.exp(x[-1]))
    info = {"process": process, "log_posterior": end.value, "solves": len(log)}
    status = Status.BUDGET if n_iter >= max_iter else Status.CONVERGED
    return from_reward(mdp, end.reward, objective=np.array(log), status=status, info=info)


def inducing_states(X: Array, counts: Array, n: int, rng: np.random.Generator) -> Indices:
    """Demonstrated states, thinned or filled at random to n; one for each distinct feature vector.

    Equal feature vectors would make K_uu singular.
    """
    seen = np.flatnonzero(counts.sum(axis=1))
    if len(seen) > n:
        chosen = rng.choice(seen, n, replace=False)
    else:
        rest = np.setdiff1d(np.arange(len(X)), seen)
        chosen = np.r_[seen, rng.choice(rest, min(n - len(seen), len(rest)), replace=False)]
    chosen = np.sort(chosen)
    _, first = np.unique(np.round(X[chosen], 12), axis=0, return_index=True)
    distinct: Indices = chosen[np.sort(first)]
    return distinct
