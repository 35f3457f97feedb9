r"""How sure the weights are, and why: one theory for exact, recorded and perturbed experts.

Near its minimum at :math:`\hat w` the regret is
:math:`f(w) = f^* + (w - \hat w)^T H (w - \hat w)/2` with the Hessian :math:`H` of the plane of
weights; let :math:`C = U H^{-1} U^T`. Three things keep the expert's own weights away from
:math:`\hat w`, and their half widths add up:

* **noise** in its features, of covariance :math:`S`: :math:`t \sqrt{(C S C)_{jj}}`, since
  :math:`\delta w = C \, \delta\mu`; :math:`t` is Student's quantile for all K weights at once
  (Bonferroni);
* **its own sub-optimality** :math:`\delta_E = f(w_E)`: :math:`w_E` lies in the ellipsoid
  :math:`\{f \le \delta_E\}`, whose half widths are
  :math:`\sqrt{2 (\delta_E - f^*) C_{jj}}`. Of :math:`\delta_E` only :math:`f^* \le \delta_E` can be
  measured. An upper bound :math:`\epsilon` on :math:`f^*` in place of :math:`\delta_E - f^*` covers
  every expert that is at most twice as sub-optimal as its best explanation, and every expert that
  is optimal among the policies near its own: its regret among those is 0 at :math:`w_E` and at most
  :math:`f^*` at :math:`\hat w`;
* **the solver**: the regret that the learner itself leaves, and by how much its answers are beaten
  by others that it knows: :math:`\sqrt{2 \delta C_{jj}}`.

The curvature in each weight's direction is measured by the probes at the ends of its interval:
where the regret rises by less than the model promises, the half widths grow with the root of the
ratio; where it rises more on one side than on the other, by how far the minimum is off.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.bundle import Bundle
from walking_irl.cpirl.outlook import Outlook
from walking_irl.cpirl.regret_model import RegretModel, standard_errors
from walking_irl.geometry.plane import plane_basis
from walking_irl.types import Bracket, Certainty, Gap

_MOST_STRETCHED = 16.0
"""Ratio of the promised to the measured rise of the regret from which on a probe tells nothing."""
_NEAR = 10.0
"""Queries whose regret is below so many times the level tell what the solver leaves."""


class Level(NamedTuple):
    """Regret of the weights that may be the expert's, in units of w.mu, and what it is made of."""

    gap: float
    """What is allowed for the expert's own sub-optimality, above min f."""
    source: Gap
    """Who says so."""
    solver: float
    """What the learner leaves: the best regret found, and what its answers lack."""
    none: float
    """Regret that counts as none."""
    bracket: Bracket
    """Bounds on min f."""

    @property
    def total(self) -> float:
        """Of everything; at least what counts as none."""
        return max(self.gap + self.solver, self.none)


def bracket_of(bundle: Bundle, w: Array) -> Bracket:
    """Bounds on min f; noise in the expert's features counts as it does at the weights ``w``."""
    noise = float(w @ bundle.error)
    if bundle.covariance is not None:
        noise = bundle.quantile(1) * math.sqrt(max(float(w @ bundle.covariance @ w), 0.0))
    upper = max(float(np.min(bundle.regrets(bundle.W))), 0.0) + noise  # no regret is below 0
    return Bracket(min(-bundle.nominal_game.value - noise, upper), upper)


def level_of(outlook: Outlook, w: Array, tol: float, asked: float | None = None) -> Level:
    """Level of the intervals around an estimate.

    The expert is allowed the upper end of what is measured; where noise hides more than it is
    granted, and nothing shows that it needs more, what it is granted. What a person vouches for
    counts, unless the lower end refutes it. A set of weights below a
    tolerance is cut out at that level, or at the one that is asked for.

    Args:
        outlook: What is known at the end.
        w: The estimate, shape (K,).
        tol: Regret that counts as none, relative.
        asked: Sub-optimality to allow instead, relative to |w.mu_E|, or None.
    """
    bundle = outlook.bundle
    none, bracket = tol * float(bundle.scale(w)), bracket_of(bundle, w)
    gap, source = _allowed(bundle, bracket)
    if asked is not None:
        gap, source = asked * abs(float(w @ bundle.mu)), Gap.ASKED
    is_refuted = bracket.lower > max(bundle.expert.suboptimality, none)
    if outlook.levels.is_set and not is_refuted:
        gap = gap if asked is not None else bundle.expert.suboptimality
        return Level(max(gap, none), Gap.ASKED, 0.0, none, bracket)
    left = bracket.upper if bundle.is_exact else 0.0
    solver = left + _beaten_by(bundle, _NEAR * max(gap + left, none))
    return Level(gap, source, solver, none, bracket)


def _allowed(bundle: Bundle, bracket: Bracket) -> tuple[float, Gap]:
    """How sub-optimal the expert may be above min f, and who says so."""
    granted = bundle.expert.suboptimality
    is_told = bool(bundle.expert.vouched_by)
    is_hidden = not bundle.is_exact and bracket.upper > granted
    if bracket.lower <= granted and (is_told or is_hidden):
        return granted, Gap.GRANTED
    return bracket.upper, Gap.MEASURED


def _beaten_by(bundle: Bundle, near: float) -> float:
    """By how much answers near the minimum are beaten at their own weights, in units of w.mu."""
    f, own = bundle.regrets(bundle.W), np.einsum("nk,nk->n", bundle.W, bundle.M)
    best = bundle.values(bundle.W)
    if bundle.is_exact:
        best = np.maximum(best, bundle.W @ bundle.mu)
    missed = np.where(f <= f.min() + near, best - own, 0.0)
    return max(float(missed.max()), 0.0)


def half_widths(outlook: Outlook, w: Array, level: Level, n_before: int) -> Certainty:
    """Half widths of all weights by cause.

    Args:
        outlook: What is known, with the answers to the probes; it has a model.
        w: The estimate, shape (K,).
        level: Of the intervals.
        n_before: Answers before the first probe.
    """
    bundle, model = outlook.bundle, outlook.model
    assert model is not None
    U = plane_basis(bundle.K)
    variance = np.maximum(np.diag(U @ np.linalg.solve(model.B, U.T)), 0.0)
    stretch, offset = _measured(bundle, model, w, n_before)
    errors = np.zeros(bundle.K)
    if bundle.covariance is not None:
        errors = stretch * standard_errors(model.B, bundle.covariance)
    gap = np.sqrt(2.0 * level.gap * stretch * variance)
    both = np.sqrt(2.0 * level.total * stretch * variance)
    return Certainty(
        from_noise=bundle.quantile(bundle.K) * errors,
        from_gap=gap,
        from_solver=both - gap + offset,
        standard_errors=errors,
        gap=level.gap,
        source=level.source,
    )


def _measured(bundle: Bundle, model: RegretModel, w: Array, n_before: int) -> tuple[Array, Array]:
    """Promised over measured curvature, and distance of the minimum, by weight; (K,) each.

    From pairs of probes on both sides of ``w``: with rises a and b of the regret at steps s and -s
    the curvature is a + b, and the minimum lies at s (b - a) / (2 (a + b)).
    """
    K = bundle.K
    stretch, offset = np.ones(K), np.zeros(K)
    W = bundle.W[n_before : n_before + 2 * K]
    if len(W) < 2 * K:
        return stretch, offset
    gradient = bundle.M[model.best] - bundle.mu
    U = plane_basis(K)
    H, start = U @ model.B @ U.T, bundle.W[model.best]

    def promised(V: Array) -> Array:
        Z = V - start
        rise: Array = Z @ gradient + 0.5 * np.einsum("nk,kl,nl->n", Z, H, Z)
        return rise

    here = float(promised(w[None])[0])
    base = float(bundle.regrets(start[None])[0]) + here
    rises, expected = bundle.regrets(W) - base, promised(W) - here
    for j in range(K):
        pair = slice(2 * j, 2 * j + 2)
        a, b = np.maximum(rises[pair], 0.0)
        is_even = np.abs(W[pair].sum(axis=0) - 2.0 * w).max() <= 1e-2 * np.abs(W[2 * j] - w).max()
        total, hoped = a + b, float(expected[pair].sum())
        stretch[j] = np.clip(hoped / max(total, 1e-300), 1.0, _MOST_STRETCHED)
        if is_even and total > 0.0:
            offset[j] = abs(W[2 * j, j] - w[j]) * abs(b - a) / (2.0 * total)
    return stretch, offset
