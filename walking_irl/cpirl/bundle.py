"""All that CPIRL has learnt: the policies evaluated, and what is known of the expert."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from walking_irl.arrays import Array
from walking_irl.cpirl.gauge import SAME, has_constant_sum
from walking_irl.errors import EmptyPolyhedronError, InvalidInputError, SolverError
from walking_irl.expert import student_quantile
from walking_irl.geometry.game import Game, game_lp
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.types import Expert, Response

_CONFIDENCE = 0.95
_ROUNDING = 1e-9
"""Of returns, whose features are of order 1 where they are not all zero."""
_ZERO_MATTERS = 10.0
"""How far from its zero, in differences of policies, a feature still is measured from there."""
_UNREACHED = 0.02
"""By how much, relative to |w.mu_E|, an expert may beat every policy: noise or a local solver."""


@dataclass(frozen=True, eq=False)
class Bundle:
    """Queries, policies and the expert's corner; immutable, :meth:`add` returns a new one.

    Every cut is rebuilt from it, and what it implies is computed once.

    Attributes:
        expert: What the run was given.
        min_weight: Lower bound of every weight.
        mu: The expert's feature expectations, less the measured defect; shape (K,).
        error: Their confidence half-widths, shape (K,).
        covariance: Of ``mu``, shape (K, K), or None where the expert is exact.
        responses: The forward solver's answers, one for each query.
        W: Queries, shape (n, K).
        extra: Features of the other policies that the solver evaluated, shape (p, K).
    """

    expert: Expert
    min_weight: float
    mu: Array
    error: Array
    covariance: Array | None
    responses: tuple[Response, ...]
    W: Array
    extra: Array

    @classmethod
    def of(cls, expert: Expert, min_weight: float = 0.0) -> Bundle:
        """Before the first query."""
        mu, error = (np.asarray(v, dtype=np.float64) for v in (expert.mu, expert.error))
        none = np.empty((0, len(mu)))
        return cls(expert, min_weight, mu, error, expert.covariance, (), none, none)

    def add(self, w: Array, response: Response) -> Bundle:
        """With one more query and every policy evaluated for it.

        Raises:
            InvalidInputError: If the response's ``mu`` is not finite with shape (K,), or no policy
                comes near the expert: then its features are not what a policy can achieve.
        """
        response = _checked(response, self.K)
        extra = self.extra
        if len(response.evaluated):
            evaluated = np.asarray(response.evaluated, dtype=np.float64)
            extra = np.r_[extra, evaluated[np.isfinite(evaluated).all(axis=1)]]
        W = np.vstack([self.W, w])
        bundle = replace(self, responses=(*self.responses, response), W=W, extra=extra)
        best, claimed = float(bundle.values(w)), float(w @ (self.mu - self.error))
        allowed = _UNREACHED * float(w @ np.maximum(np.abs(self.mu), 1e-3 * np.abs(bundle.M).max()))
        if best < claimed - allowed - _ROUNDING:
            raise InvalidInputError(
                f"no policy achieves the expert's features: for the weights {np.round(w, 4)} the "
                f"best policy's return is {best:.6g}, the expert's {claimed:.6g}; check the "
                "features' sign, scale and discount"
            )
        return bundle

    def corrected(self, defect: Array, covariance: Array) -> Bundle:
        """With the expert's mean lowered by a measured defect, its error widened by the defect's.

        Args:
            defect: Measured mean minus the solver's mu of one policy, shape (K,).
            covariance: Of that mean, shape (K, K).
        """
        assert self.expert.covariance is not None
        own = self.quantile(self.K) ** 2 * np.maximum(np.diag(covariance), 0.0)
        return replace(
            self,
            mu=self.expert.mu - defect,
            covariance=self.expert.covariance + covariance,
            error=np.sqrt(self.expert.error**2 + own),
        )

    @property
    def K(self) -> int:
        """Number of objectives."""
        return len(self.mu)

    @property
    def is_exact(self) -> bool:
        """Whether the expert's features are no sample mean."""
        return self.covariance is None

    @cached_property
    def M(self) -> Array:
        """Feature expectations of the queries' policies, shape (n, K)."""
        return np.array([r.mu for r in self.responses]).reshape(-1, self.K)

    @cached_property
    def policies(self) -> Array:
        """Feature expectations of all policies evaluated, the queries' first; shape (n + p, K)."""
        return np.asarray(np.r_[self.M, self.extra])

    @cached_property
    def differences(self) -> Array:
        """Robust d_i = mu_i - (mu_E + e_E) of all policies, queries first; shape (n + p, K)."""
        rows: Array = self.policies - (self.mu + self.error)
        return rows

    @cached_property
    def game(self) -> Game:
        """Minimax program over the whole simplex: its value is the certificate t_k."""
        return game_lp(self.differences)

    @cached_property
    def bounded_game(self) -> Game:
        """The same over the weights that are allowed: its value is -min f or below."""
        return game_lp(self.differences, self.min_weight) if self.min_weight else self.game

    @cached_property
    def nominal_game(self) -> Game:
        """As :attr:`bounded_game`, against the expert's mean without its error bars."""
        if not self.error.any():
            return self.bounded_game
        return game_lp(self.policies - self.mu, self.min_weight)

    @cached_property
    def spread(self) -> float:
        """By how much a query's policy differs from the expert in a feature; its size if none."""
        size, apart = (float(np.abs(v).max(initial=0.0)) for v in (self.mu, self.M - self.mu))
        return max(apart if apart > _ROUNDING * size else size, 1e-300)

    @cached_property
    def units(self) -> Array:
        """Units of relative tolerances, shape (K,): |mu_E|, or the policies' differences.

        A constant that is added to a feature of all policies changes no answer, so that it must not
        loosen a tolerance: ten times what policies differ by is the most.
        """
        units: Array = np.minimum(np.abs(self.mu), _ZERO_MATTERS * self.spread)
        return units

    @cached_property
    def unit(self) -> float:
        """The largest of the :attr:`units`: the unit of returns whatever the weights."""
        return max(float(self.units.max()), 1e-300)

    def scale(self, w: Array) -> Array:
        """The unit of relative tolerances under weights ``w``; (..., K) -> (...).

        At least a thousandth of what policies differ by: an expert's features may all be zero.
        """
        unit: Array = np.maximum(w @ self.units, 1e-3 * self.spread)
        return unit

    def values(self, w: Array) -> Array:
        """V(w) = max_i w.mu_i over all policies evaluated; (..., K) -> (...)."""
        best: Array = (w @ self.policies.T).max(axis=-1)
        return best

    def regrets(self, W: Array) -> Array:
        """f(w) = V(w) - w.mu_E over all policies evaluated, for rows of ``W``; shape (n,)."""
        f: Array = self.values(W) - W @ self.mu
        return f

    def robust_regrets(self, W: Array) -> Array:
        """Regrets against the expert's upper corner mu_E + e_E; shape (n,)."""
        f: Array = self.values(W) - W @ (self.mu + self.error)
        return f

    @cached_property
    def least_robust_regret(self) -> float:
        """Of the queries."""
        return float(self.robust_regrets(self.W).min())

    @cached_property
    def relative_regrets(self) -> Array:
        """Of the queries, in units of |w.mu_E|; shape (n,)."""
        relative: Array = self.regrets(self.W) / np.maximum(self.scale(self.W), 1e-300)
        if self.has_gauge:  # f is linear from 0 at 1/K outwards
            distance = 1.0 - self.K * self.W.min(axis=1)
            relative = np.where(distance > SAME, relative / np.maximum(distance, SAME), np.inf)
        return relative

    @cached_property
    def is_match(self) -> NDArray[np.bool_]:
        """Which queries' policies are the demonstration itself, shape (n,)."""
        same: NDArray[np.bool_] = np.all(self.M == self.expert.mu, axis=1)
        return same

    @cached_property
    def has_gauge(self) -> bool:
        """Whether all policies' features sum to the expert's, so that 1/K explains everything."""
        return has_constant_sum(self.policies - self.expert.mu)

    def is_asked(self, w: Array) -> bool:
        """Whether these weights were a query before."""
        return bool(np.abs(self.W - w).max(axis=1).min() <= SAME)

    def rows(self, level: Array) -> Array:
        """Cuts (d_i - eps_E - level).w <= 0 of all policies evaluated, shape (n + p, K)."""
        rows: Array = self.differences - self.expert.suboptimality - level
        return rows

    def polyhedron(self, level: Array) -> WeightPolyhedron:
        """Weights that satisfy every cut; an evaluated policy's is lazy unless it was queried.

        A policy with the expert's own features (within rounding) says nothing and is left out.
        """
        P = WeightPolyhedron.simplex(self.K, self.min_weight)
        if not self.responses:
            return P
        says = np.abs(self.differences + self.error).max(axis=1) > 1e-12 * self.unit
        is_lazy = np.arange(len(says)) >= len(self.responses)
        return P.cut_all(self.rows(level)[says], is_lazy[says])

    def intervals(self, level: Array, estimate: Array) -> Array:
        """Per-weight bounds, shape (K, 2).

        Where the cuts leave nothing, the level is raised to the estimate's regret: then the weights
        are those for which the expert is at least as close to optimal as for the estimate.
        """
        f = max(float(self.values(estimate) - estimate @ (self.mu + self.error)), 0.0)
        f -= self.expert.suboptimality  # which the cuts grant
        for least in (-np.inf, f, f + 1e-6 * self.unit):
            try:
                return self.polyhedron(np.maximum(level, least)).intervals()
            except (EmptyPolyhedronError, SolverError):
                continue
        return np.tile([self.min_weight, 1.0], (self.K, 1))

    def quantile(self, n_tests: int) -> float:
        """Student's two-sided quantile for ``n_tests`` simultaneous intervals."""
        n = self.expert.n_samples or 10**6 + 1  # of a covariance alone: as good as known
        return float(student_quantile(_CONFIDENCE, n, n_tests))


def _checked(response: Response, K: int) -> Response:
    """The response, without a sensitivity that says nothing."""
    mu, S = np.asarray(response.mu), response.sensitivity
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
