"""All that CPIRL has learnt: the policies evaluated, and what is known of the expert."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from walking_irl.arrays import Array
from walking_irl.cpirl.gauge import has_constant_sum
from walking_irl.errors import EmptyPolyhedronError, InvalidInputError, SolverError
from walking_irl.geometry.game import Game, game_lp
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.types import Expert, Response

CONFIDENCE = 0.95
ROUNDING = 1e-9
"""Of returns, whose features are of order 1 where they are not all zero."""
UNREACHED = 0.02
"""By how much, relative to |w.mu_E|, an expert may beat every policy: noise or a local solver."""


class Archive:
    """Queries, policies and the expert's corner; every cut is rebuilt from it.

    Attributes:
        mu: The expert's feature expectations, less the measured defect; shape (K,).
        error: Their confidence half-widths, shape (K,).
        covariance: Of ``mu``, shape (K, K), or None where the expert is exact.
        responses: The forward solver's answers, one for each query.
    """

    def __init__(self, expert: Expert, min_weight: float) -> None:
        self.expert = expert
        self.min_weight = min_weight
        self.mu = np.asarray(expert.mu, dtype=np.float64)
        self.error = np.asarray(expert.error, dtype=np.float64)
        self.covariance = expert.covariance
        self.responses: list[Response] = []
        self._W: list[Array] = []
        self._spare = np.empty((0, len(self.mu)))
        self._largest = 0.0

    @property
    def K(self) -> int:
        """Number of objectives."""
        return len(self.mu)

    @property
    def W(self) -> Array:
        """Queries, shape (n, K)."""
        return np.array(self._W)

    @property
    def M(self) -> Array:
        """Feature expectations of the queries' policies, shape (n, K)."""
        return np.array([r.mu for r in self.responses])

    def add(self, w: Array, response: Response) -> None:
        """Remember a query and every policy evaluated for it.

        Raises:
            InvalidInputError: If the response's ``mu`` is not finite with shape (K,), or no policy
                comes near the expert: then its features are not what a policy can achieve.
        """
        response = self._checked(response)
        self._W.append(np.asarray(w, dtype=np.float64))
        self.responses.append(response)
        self._largest = max(self._largest, float(np.abs(response.mu).max()))
        if len(response.evaluated):
            spare = np.asarray(response.evaluated, dtype=np.float64)
            self._spare = np.r_[self._spare, spare[np.isfinite(spare).all(axis=1)]]
        best, claimed = float(self.values(w)), float(w @ (self.mu - self.error))
        if best < claimed - UNREACHED * float(self.scale(w)) - ROUNDING:
            raise InvalidInputError(
                f"no policy achieves the expert's features: for the weights {np.round(w, 4)} the "
                f"best policy's return is {best:.6g}, the expert's {claimed:.6g}; check the "
                "features' sign, scale and discount"
            )

    def _checked(self, response: Response) -> Response:
        """The response, without a sensitivity that says nothing."""
        K, mu, S = self.K, np.asarray(response.mu), response.sensitivity
        if mu.shape != (K,) or not np.isfinite(mu).all():
            raise InvalidInputError(f"forward solver returned mu {mu}; need {K} finite values")
        if len(response.evaluated) and np.shape(response.evaluated)[1:] != (K,):
            raise InvalidInputError(
                f"evaluated policies must have shape (n, {K}), got {np.shape(response.evaluated)}"
            )
        if S is None:
            return response
        if np.shape(S) != (K, K):
            raise InvalidInputError(f"a sensitivity must have shape ({K}, {K}), got {np.shape(S)}")
        says = bool(np.isfinite(S).all() and np.any(S))
        return response if says else replace(response, sensitivity=None)

    def values(self, w: Array) -> Array:
        """V(w) = max_i w.mu_i over all policies evaluated; (..., K) -> (...)."""
        best: Array = (w @ np.r_[self.M, self._spare].T).max(axis=-1)
        return best

    def scale(self, w: Array) -> Array:
        """|w.mu_E|, the unit of relative tolerances; (..., K) -> (...).

        At least a thousandth of the largest feature found: an expert's may all be zero.
        """
        unit: Array = np.maximum(w @ np.abs(self.mu), 1e-3 * self._largest)
        return unit

    def regrets(self, W: Array) -> Array:
        """f(w) = V(w) - w.mu_E over all policies evaluated, for rows of ``W``; shape (n,)."""
        f: Array = self.values(W) - W @ self.mu
        return f

    def is_match(self) -> NDArray[np.bool_]:
        """Which queries' policies are the demonstration itself, shape (n,)."""
        same: NDArray[np.bool_] = np.all(self.M == self.expert.mu, axis=1)
        return same

    def has_gauge(self) -> bool:
        """Whether all policies' features sum to the expert's, so that 1/K explains everything."""
        return has_constant_sum(np.r_[self.M, self._spare] - self.expert.mu)

    def robust_regrets(self, W: Array) -> Array:
        """Regrets against the expert's upper corner mu_E + e_E; shape (n,)."""
        f: Array = self.values(W) - W @ (self.mu + self.error)
        return f

    def game(self) -> Game:
        """Minimax program over the weights that are allowed: its value is -min f or below."""
        return game_lp(self.differences(), self.min_weight)

    def differences(self) -> Array:
        """Robust d_i = mu_i - (mu_E + e_E) of all policies, queries first; shape (n, K)."""
        rows: Array = np.r_[self.M, self._spare] - (self.mu + self.error)
        return rows

    def rows(self, lift: Array) -> Array:
        """Cuts (d_i - eps_E - lift).w <= 0 of all policies evaluated, shape (n, K)."""
        rows: Array = self.differences() - self.expert.suboptimality - lift
        return rows

    def polyhedron(self, lift: Array) -> WeightPolyhedron:
        """Weights that satisfy every cut; an evaluated policy's is lazy unless it was queried.

        A policy with the expert's own features (within rounding) says nothing and is left out.
        """
        P = WeightPolyhedron.simplex(self.K, self.min_weight)
        if not self.responses:
            return P
        d = self.differences() + self.error
        says = np.abs(d).max(axis=1) > 1e-12 * max(float(np.abs(self.mu).max()), 1e-300)
        is_lazy = np.arange(len(d)) >= len(self.responses)
        return P.cut_all(self.rows(lift)[says], is_lazy[says])

    def intervals(self, lift: Array, estimate: Array) -> Array:
        """Per-weight bounds, shape (K, 2).

        Where the cuts leave nothing, the level is raised to the estimate's regret: then the weights
        are those for which the expert is at least as close to optimal as for the estimate.
        """
        best = float(self.values(estimate) - estimate @ (self.mu + self.error))
        for level in (0.0, max(best, 0.0), max(best, 0.0) + 1e-6 * float(np.abs(self.mu).max())):
            try:
                return self.polyhedron(np.maximum(lift, level)).intervals()
            except (EmptyPolyhedronError, SolverError):
                continue
        return np.tile([self.min_weight, 1.0], (self.K, 1))

    def quantile(self, n_tests: int) -> float:
        """Student's two-sided quantile for ``n_tests`` simultaneous intervals."""
        df = max(self.expert.n_samples - 1, 1) if self.expert.n_samples else 10**6
        return float(student.ppf(1.0 - (1.0 - CONFIDENCE) / (2 * n_tests), df))

    def correct(self, defect: Array, covariance: Array) -> None:
        """Lower the expert's mean by a measured defect, and widen its error by the defect's own.

        Args:
            defect: Measured mean minus the solver's mu of one policy, shape (K,).
            covariance: Of that mean, shape (K, K).
        """
        assert self.expert.covariance is not None
        self.mu = self.expert.mu - defect
        self.covariance = self.expert.covariance + covariance
        own = self.quantile(self.K) ** 2 * np.maximum(np.diag(covariance), 0.0)
        self.error = np.sqrt(self.expert.error**2 + own)
