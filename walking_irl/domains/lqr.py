"""Linear-quadratic regulator with K decoupled axes: every answer in closed form.

x' = x + u per axis; objective i charges mostly the state of axis i and the inputs of the others:
Q_i = diag(e, .., 1-e at i, .., e), R_i = diag(1-e, .., e at i, .., 1-e). Benchmark of the thesis's
section 7.2; closed form by one scalar Riccati equation per axis.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.domains.contract import Compared
from walking_irl.domains.exact import ExactDomain
from walking_irl.domains.weights import checked_weights
from walking_irl.errors import SolverError
from walking_irl.types import Expert, Objective, Response

SAMPLED = (60, 30)
"""States, and deviations at each, of :meth:`LQR.advantages`."""
GAINS_OFF = 0.25
"""Relative error of a sub-optimal expert's gains."""
PICTURE_STEPS = 16
"""Of the trajectory that a picture shows."""


class LQRPicture(NamedTuple):
    """A trajectory of every axis from the start, without noise."""

    states: Array
    """Shape (T + 1, K)."""
    inputs: Array
    """Shape (T, K)."""


@dataclass(frozen=True)
class LQR(ExactDomain):
    """The problem.

    Attributes:
        n_objectives: K, the number of axes.
        mixing: e, how much of the other axes each objective charges.
        discount: Discount factor.
        start: Initial state of every axis.
        policy_noise: Variance of white noise on the input.
        perturbation: Relative error of a sub-optimal expert's gains; 0 for an optimal expert.
        objectives: One per axis.
    """

    n_objectives: int = 3
    mixing: float = 0.1
    discount: float = 0.9
    start: float = 10.0
    policy_noise: float = 0.0
    perturbation: float = 0.0
    objectives: tuple[Objective, ...] = field(init=False, repr=False)
    name = "lqr"
    view = "lqr"

    def __post_init__(self) -> None:
        meaning = "keep axis {} near zero, at the price of the others' inputs"
        objectives = tuple(
            Objective(f"axis {i + 1}", "1", 1.0, meaning.format(i + 1))
            for i in range(self.n_objectives)
        )
        object.__setattr__(self, "objectives", objectives)

    def gains(self, w: Array) -> Array:
        """Optimal feedback u = k x per axis for weights ``w``, shape (K,)."""
        return self._gains_and_slopes(w)[0]

    def _gains_and_slopes(self, w: Array) -> tuple[Array, Array]:
        """Gains k_j(w_j) and dk_j/dw_j by implicit differentiation of the Riccati equation."""
        e, g = self.mixing, self.discount
        q, r = e + (1 - 2 * e) * w, (1 - e) - (1 - 2 * e) * w
        b = g * q + (g - 1) * r
        root = np.sqrt(b * b + 4 * g * q * r)
        p = (b + root) / (2 * g)
        k = -g * p / (r + g * p)
        dq, dr = 1 - 2 * e, -(1 - 2 * e)
        db = g * dq + (g - 1) * dr
        dp = (db + (b * db + 2 * g * (dq * r + q * dr)) / root) / (2 * g)
        dk = -g * (dp * r - p * dr) / (r + g * p) ** 2
        return k, dk

    def evaluate(self, k: Array) -> Array:
        """Feature expectations of gains ``k``, shape (K,) -> (K,)."""
        Q, R = self._charges()
        P = (Q + R * k**2) / (1 - self.discount * (1 + k) ** 2)
        noise = self.policy_noise / (1 - self.discount) * (R + self.discount * P).sum(axis=1)
        mu: Array = -(self.start**2 * P).sum(axis=1) - noise
        return mu

    def _charges(self) -> tuple[Array, Array]:
        e, eye = self.mixing, np.eye(self.n_objectives)
        return e + (1 - 2 * e) * eye, (1 - e) - (1 - 2 * e) * eye

    def forward(self, w: Array) -> Response:
        """Optimal gains for ``w``, with d mu/d w = (d mu/d k) diag(dk/dw)."""
        k, slope = self._gains_and_slopes(checked_weights(w, self.n_objectives))
        noise = self.policy_noise * self.discount / (1 - self.discount)
        sensitivity = -(self.start**2 + noise) * self._slopes(k) * slope
        return Response(k, self.evaluate(k), 0.5 * (sensitivity + sensitivity.T))

    def _slopes(self, k: Array) -> Array:
        """Derivative of objective j's cost matrix on axis i in the gain of axis i, (K, K)."""
        Q, R = self._charges()
        g = self.discount
        closed = 1 - g * (1 + k) ** 2
        slopes: Array = 2 * R * k / closed + (Q + R * k**2) * 2 * g * (1 + k) / closed**2
        return slopes

    def policy_gradient(self, policy: Array) -> Array:
        """Gradient of each objective in each gain, d mu_j / d k_i at [i, j], shape (K, K)."""
        noise = self.policy_noise * self.discount / (1 - self.discount)
        return -(self.start**2 + noise) * self._slopes(np.asarray(policy, dtype=np.float64)).T

    def advantages(
        self, policy: Array, *, size: float, rng: np.random.Generator
    ) -> tuple[Array, Indices]:
        """By how much u = k x beats u + size |x| xi in each objective, at random states x.

        Args:
            policy: Gains k, shape (K,).
            size: Of the deviations, relative to the state.
            rng: Draws states and deviations.

        Returns:
            Advantages (n, K), and the state that each belongs to (n,).
        """
        k, K, g = np.asarray(policy, dtype=np.float64), self.n_objectives, self.discount
        Q, R = self._charges()
        P = (Q + R * k**2) / (1 - g * (1 + k) ** 2)
        states, rivals = SAMPLED
        x = np.repeat(self.start * rng.standard_normal((states, K)), rivals, axis=0)
        length = np.linalg.norm(x, axis=1, keepdims=True)
        u = k * x + size * length * rng.standard_normal(x.shape)

        def value(u: Array) -> Array:
            return np.asarray(-(u**2 @ R.T + g * (x + u) ** 2 @ P.T))

        return value(k * x) - value(u), np.repeat(np.arange(states), rivals)

    def nearest(self, policy: Array) -> Callable[[Array], Compared]:
        """Maps weights to their optimal gains beside the gains ``policy``, shape (K,)."""

        def compared(w: Array) -> Compared:
            k, slope = self._gains_and_slopes(checked_weights(w, self.n_objectives))
            return Compared(policy - k, lambda: np.diag(slope), k, self.evaluate(k))

        return compared

    def expert(self, w_E: Array, rng: np.random.Generator) -> Expert:
        """Exact features of the optimal gains, perturbed where ``perturbation`` > 0."""
        k = self.gains(checked_weights(w_E, self.n_objectives))
        if self.perturbation > 0.0:
            k = k * (1 + self.perturbation * rng.uniform(-1.0, 1.0, len(k)))
            k = np.clip(k, -0.99, -0.1)
        return Expert(self.evaluate(k), np.zeros(len(k)), demonstration=k)

    def suboptimal_expert(self, w_E: Array, rng: np.random.Generator) -> Expert:
        """Expert with gains up to 25 % off, if this domain perturbs none already."""
        return replace(self, perturbation=self.perturbation or GAINS_OFF).expert(w_E, rng)

    def advantage(self, mu: Array) -> float:
        """v* = min_w max_pi w.(mu(pi) - mu): by how much a policy beats ``mu`` in every feature.

        The regret is convex with gradient mu(w) - mu; SciPy's SLSQP minimises it on the simplex.

        Raises:
            SolverError: If it does not converge.
        """
        from scipy.optimize import minimize  # takes .3 s; other domains come by here, too

        K = self.n_objectives

        def regret(w: Array) -> tuple[float, Array]:
            d = self.forward(w / w.sum()).mu - mu  # steps leave the simplex by rounding
            return float(w @ d), d

        result = minimize(
            regret,
            np.full(K, 1 / K),
            jac=True,
            bounds=[(0.0, 1.0)] * K,
            constraints={"type": "eq", "fun": lambda w: w.sum() - 1, "jac": np.ones_like},
            method="SLSQP",
            options={"ftol": 1e-12, "maxiter": 200},
        )
        if result.status != 0:
            raise SolverError(f"the least regret was not found: {result.message}")
        return float(result.fun)

    def picture(self, policy: Array, n_steps: int = PICTURE_STEPS) -> LQRPicture:
        """``n_steps`` steps under gains ``policy``, shape (K,)."""
        k = np.asarray(policy, dtype=np.float64)
        states = self.start * (1 + k) ** np.arange(n_steps + 1.0)[:, None]
        return LQRPicture(states, k * states[:-1])
