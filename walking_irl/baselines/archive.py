"""What an archive of policies says of the weights, in any domain and without a forward solve.

Given the feature expectations mu_i of policies that some method evaluated, the regret that they
leave is f(w) = max_i w.mu_i - w.mu_E. Bayesian IRL becomes the posterior exp(-alpha f(w)) on the
simplex, log-concave: CPIRL's polyhedron with soft walls (alpha to infinity: uniform on it; alpha
times max |mu_E|: the inverse relative regret that the expert is allowed). MaxEnt becomes
min_w tau log sum_i q_i exp(w.(mu_i - mu_E) / tau): Kelley's query as tau falls to 0.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize
from scipy.special import logsumexp

from walking_irl.arrays import Array
from walking_irl.baselines.policywalk import effective_sample_sizes, mixing
from walking_irl.baselines.recovered import Recovered, positive
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.types import Status


def archive_posterior(
    M: Array,
    mu_E: Array,
    *,
    rng: np.random.Generator,
    sharpness: float = 1e4,
    n_samples: int = 20_000,
    burn_in: int = 2_000,
    step: float | None = None,
) -> Recovered:
    """Samples of exp(-alpha f(w)) on the simplex, alpha = sharpness / mean |mu_E|.

    A Metropolis walk that moves up to ``step`` from one weight to another; a move off the simplex
    is rejected.

    Args:
        M: Feature expectations of evaluated policies, shape (n, K).
        mu_E: The expert's, shape (K,).
        rng: Draws proposals.
        sharpness: Inverse of the relative regret that the expert is allowed.
        n_samples: Samples that are kept.
        burn_in: Samples thrown away before.
        step: Largest move; by default tuned during the burn-in to accept about a third.

    Returns:
        Mean weights and samples; ``info`` holds 95 % intervals (K, 2), the share of accepted
        moves and effective sample sizes.
    """
    D, scale = _differences(M, mu_E)
    positive(sharpness=sharpness, n_samples=n_samples)
    K, n = D.shape[1], burn_in + n_samples
    alpha, size = sharpness / scale, 0.05 if step is None else step
    w, values = np.full(K, 1 / K), D.mean(axis=1)
    level = alpha * max(float(values.max()), 0.0)
    i, j = rng.integers(K, size=n), rng.integers(max(K - 1, 1), size=n)
    j = (i + 1 + j) % K
    share, dice = rng.uniform(-1, 1, n), np.log(rng.random(n))
    samples, log, accepted = np.empty((n, K)), np.empty(n), 0
    for t in range(n):
        move = size * share[t]
        if min(w[i[t]] + move, w[j[t]] - move) >= 0:
            moved = values + move * (D[:, i[t]] - D[:, j[t]])
            new = alpha * max(float(moved.max()), 0.0)
            is_accepted = dice[t] < level - new
            if is_accepted:
                w = w.copy()
                w[i[t]] += move
                w[j[t]] -= move
                values, level = moved, new
                accepted += t >= burn_in
            if step is None and t < burn_in:  # Robbins & Monro on the logarithm of the step
                size = min(0.5, size * np.exp(0.05 * (float(is_accepted) - 1 / 3)))
        samples[t], log[t] = w, -level
    samples, log = samples[burn_in:], log[burn_in:]
    info = {
        "intervals": np.quantile(samples, [0.025, 0.975], axis=0).T,
        "acceptance": accepted / n_samples,
        "effective_sample_size": effective_sample_sizes(samples),
        "solves": 0,
    }
    return Recovered(
        w=samples.mean(axis=0),
        space="simplex",
        samples=samples,
        objective=log,
        iterates=samples,
        status=Status.SAMPLED,
        info=info,
        notes=mixing(samples),
    )


def archive_maxent(
    M: Array, mu_E: Array, *, temperature: float = 1e-3, log_q: Array | None = None
) -> Recovered:
    """Weights of the simplex that make the expert likeliest among the archive's policies.

    Args:
        M: Feature expectations of evaluated policies, shape (n, K).
        mu_E: The expert's, shape (K,).
        temperature: tau relative to mean |mu_E|; weights are biased by about as much.
        log_q: Log of the policies' weights in the sum, shape (n,); even by default. Relative
            entropy IRL where the policies were drawn from q.

    Returns:
        Weights of the simplex; ``info`` holds the effective number of policies.

    Raises:
        SolverError: If SLSQP does not converge.
    """
    D, scale = _differences(M, mu_E)
    positive(temperature=temperature)
    K, tau = D.shape[1], temperature * scale
    offset = np.zeros(len(D)) if log_q is None else np.asarray(log_q)

    def objective(w: Array) -> tuple[float, Array]:
        a = offset + D @ w / tau
        top = logsumexp(a)
        return float(tau * top / scale), D.T @ np.exp(a - top) / scale

    result = minimize(
        objective,
        np.full(K, 1 / K),
        jac=True,
        bounds=[(0.0, 1.0)] * K,
        constraints={"type": "eq", "fun": lambda w: w.sum() - 1, "jac": np.ones_like},
        method="SLSQP",
        options={"ftol": 1e-12, "maxiter": 500},
    )
    if result.status != 0:
        raise SolverError(f"MaxEnt over the archive did not converge: {result.message}")
    w = np.maximum(result.x, 0.0)
    w /= w.sum()
    a = offset + D @ w / tau
    p = np.exp(a - logsumexp(a))
    info = {"effective_sample_size": float(1 / (p**2).sum()), "solves": 0}
    return Recovered(w=w, space="simplex", objective=np.array([result.fun]), info=info)


def _differences(M: Array, mu_E: Array) -> tuple[Array, float]:
    """mu_i - mu_E, shape (n, K), and the unit of regrets, mean |mu_E|."""
    M, mu_E = np.asarray(M, dtype=np.float64), np.asarray(mu_E, dtype=np.float64)
    if M.ndim != 2 or not len(M) or mu_E.shape != M.shape[1:] or M.shape[1] < 2:
        raise InvalidInputError(
            f"an archive needs policies' features (n >= 1, K >= 2) and the expert's (K,), got "
            f"{M.shape} and {mu_E.shape}"
        )
    if not (np.isfinite(M).all() and np.isfinite(mu_E).all()):
        raise InvalidInputError("the archive's and the expert's features must be finite")
    return M - mu_E, max(float(np.abs(mu_E).mean()), 1e-300)
