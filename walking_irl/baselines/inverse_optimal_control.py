r"""Inverse optimal control, as biomechanists explain one demonstrated movement by its weights.

The movement x_E is known, each cost G_j is differentiable, and x*(w) minimises w.G under c(x) = 0:

- KKT residual (A. Keshavarz, Y. Wang, S. Boyd 2011, Imputing a convex objective function): weights
  and multipliers for which x_E is nearest to stationary,
  :math:`\min_{w \in \Delta, \lambda} |\nabla G(x_E)\, w + \nabla c(x_E)^T \lambda|`. It solves no
  forward problem.
- Bilevel (K. Mombaur, A. Truong, J.-P. Laumond 2010, From human to humanoid locomotion, an inverse
  optimal control approach): weights whose optimal movement is nearest to the one shown,
  :math:`\min_w |x_E - x^*(w)|`. Their outer level uses no derivatives (Powell's BOBYQA; here its
  successor COBYQA); with the solver's dx*/dw it is a Gauss-Newton method.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize, nnls

from walking_irl.arrays import Array
from walking_irl.baselines.girl import girl
from walking_irl.baselines.recovered import Recovered, positive
from walking_irl.errors import InvalidInputError
from walking_irl.rl.constraints import free_gradient
from walking_irl.types import Status

HEAVY = 1e3
"""Weight of the row that holds the sum of the weights, relative to the others."""
MAX_HALVINGS = 5
SHRINK = 1 / 3
"""Of a step that came no nearer."""
FIRST_RADIUS, LAST_RADIUS = 0.7, 0.01
"""Of the trust region, in logarithms of ratios of weights."""
WIDEST = 6.0
"""Largest logarithm of a ratio of weights."""


class Fit(NamedTuple):
    """How the optimal movement for some weights compares with the one shown."""

    residual: Array
    """Shown minus optimal, shape (m,)."""
    slope: Callable[[], Array]
    """d optimal / d w, shape (m, K); asked for only by methods that use it."""
    policy: Any = None
    """The optimal movement."""
    mu: Array | None = None
    """Its feature expectations, shape (K,)."""


Solve = Callable[[Array], Fit]
"""Solves the forward problem for weights (K,) and compares."""


def kkt_residual(G: Array, A: Array | None = None) -> Recovered:
    """Weights of the simplex that make a movement nearest to stationary.

    Multipliers are free, so what lies in the rows of A is projected away; what is left is the
    problem of GIRL.

    Args:
        G: Gradient of each cost at the movement, shape (n, K).
        A: Jacobian of the constraints there, shape (m, n), or None.

    Returns:
        Weights; ``info["residual"]`` is what is left, relative to the largest |G_j|.

    Raises:
        InvalidInputError: If shapes do not fit, or numbers are not finite.
    """
    G = np.asarray(G, dtype=np.float64)
    if A is None:
        return girl(G)
    return girl(free_gradient(G, A))


@dataclass
class _Counted:
    """Counts forward solves and keeps the nearest movement, with its weights."""

    solve: Solve
    n: int = 0
    w: Array | None = None
    best: Fit | None = None

    def __post_init__(self) -> None:
        self.log: list[float] = []

    @property
    def distance(self) -> float:
        """Root mean square of the best residual."""
        return np.inf if self.best is None else _rms(self.best.residual)

    def __call__(self, w: Array) -> float:
        """Root mean square distance of the optimal movement for ``w``."""
        self.n += 1
        found = self.solve(w)
        distance = _rms(found.residual)
        if distance < self.distance:
            self.w, self.best = w, found
        self.log.append(self.distance)
        return distance

    def recovered(self, status: Status) -> Recovered:
        """The nearest one."""
        assert self.w is not None and self.best is not None
        return Recovered(
            w=self.w,
            space="simplex",
            policy=self.best.policy,
            mu=self.best.mu,
            objective=np.array(self.log),
            status=status,
            info={"solves": self.n, "distance": self.distance},
        )


def bilevel_search(
    solve: Solve, n_objectives: int, *, max_solves: int = 100, min_weight: float = 0.005
) -> Recovered:
    """Weights of the nearest optimal movement, by a trust region method without derivatives.

    Unknowns are the logarithms of the weights over the last one, from even weights on.

    Args:
        solve: The forward problem.
        n_objectives: K.
        max_solves: Budget of forward solves.
        min_weight: Least weight.

    Returns:
        Weights; ``objective`` is the least distance after each forward solve.
    """
    _check(n_objectives, max_solves, min_weight)
    job = _Counted(solve)

    def weights(z: Array) -> Array:
        e = np.exp(np.r_[z, 0.0] - max(z.max(), 0.0))
        return np.asarray(min_weight + (1 - n_objectives * min_weight) * e / e.sum())

    if n_objectives == 1:
        job(np.ones(1))
        return job.recovered(Status.CONVERGED)
    ended = minimize(
        lambda z: job(weights(z)),
        np.zeros(n_objectives - 1),
        method="COBYQA",
        bounds=[(-WIDEST, WIDEST)] * (n_objectives - 1),
        options={
            "maxfev": max_solves,
            "initial_tr_radius": FIRST_RADIUS,
            "final_tr_radius": LAST_RADIUS,
        },
    )
    return job.recovered(Status.CONVERGED if ended.success else Status.BUDGET)


def bilevel_gauss_newton(
    solve: Solve,
    n_objectives: int,
    *,
    start: Array | None = None,
    max_solves: int = 40,
    min_weight: float = 0.005,
    tol: float = 1e-4,
) -> Recovered:
    """Weights of the nearest optimal movement, by Gauss-Newton steps on the simplex.

    Each step is a non-negative least squares problem in the weights; it is shortened until the
    movement comes nearer.

    Args:
        solve: The forward problem, with the slope of its answer.
        n_objectives: K.
        start: First weights, shape (K,); even ones by default.
        max_solves: Budget of forward solves.
        min_weight: Least weight.
        tol: Largest change of a weight that counts as none.

    Returns:
        Weights; ``objective`` is the least distance after each forward solve. Status STALLED: no
        shorter step came nearer, so there is a kink, or the slope is that of another minimum.
    """
    _check(n_objectives, max_solves, min_weight)
    positive(tol=tol)
    job = _Counted(solve)
    w = np.full(n_objectives, 1 / n_objectives) if start is None else np.asarray(start, float)
    job(w)
    while job.n < max_solves:
        assert job.best is not None
        here, before = job.best, job.distance
        step = _step(here, w, min_weight)
        share = 1.0
        for _ in range(MAX_HALVINGS):
            if np.abs(step).max() * share < tol:
                return job.recovered(Status.CONVERGED)
            job(w + share * step)
            if job.distance < before or job.n == max_solves:
                break
            share *= SHRINK
        if not job.distance < before:
            return job.recovered(Status.BUDGET if job.n == max_solves else Status.STALLED)
        w = w + share * step
    return job.recovered(Status.BUDGET)


def _step(here: Fit, w: Array, least: float) -> Array:
    """Change of the weights that brings the linearised movement nearest, on the simplex."""
    S, K = here.slope(), len(w)
    heavy = HEAVY * max(float(np.linalg.norm(S)), 1e-300)
    rows = np.vstack([S, heavy * np.ones((1, K))])
    v, _ = nnls(rows, np.r_[here.residual + S @ (w - least), heavy * (1 - K * least)])
    to = least + v * (1 - K * least) / v.sum()
    return np.asarray(to - w)


def _rms(residual: Array) -> float:
    return float(np.sqrt(np.mean(np.square(residual))))


def _check(K: int, max_solves: int, least: float) -> None:
    positive(max_solves=max_solves)
    if not 0 <= least * K < 1:
        raise InvalidInputError(f"min_weight must be in [0, 1/{K}), got {least}")
