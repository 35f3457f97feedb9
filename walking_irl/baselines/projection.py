"""Projection method (P. Abbeel & A. Ng, Apprenticeship learning via IRL, ICML 2004, sec. 3.1)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.apprentice import Apprentice, closest_mixture
from walking_irl.baselines.loop import USUAL, Move, Setting, apprentices
from walking_irl.types import Expert, Forward, Status


def projection(
    forward: Forward,
    expert: Expert,
    *,
    rng: np.random.Generator,
    setting: Setting = USUAL,
    tol: float = 1e-6,
    max_solves: int = 60,
) -> Iterator[Apprentice]:
    """Move a point of the hull of the policies towards the expert, one line at a time.

    mu_bar_i = mu_bar_{i-1} + ((d.(mu_E - mu_bar_{i-1})) / d.d) d with d = mu_i - mu_bar_{i-1}, and
    w_{i+1} = mu_E - mu_bar_i. The step is kept within [0, 1], so that mu_bar stays in the hull.
    Queries are scaled to sum |w| = 1. The answer is the mixture of all policies found that is
    closest to the expert (their section 3, a quadratic program), not mu_bar, which is farther. It
    ends where |mu_E - mu_bar|_2 <= tol |mu_E|_2. The first weights are drawn (the original draws a
    first policy). Without ``setting.is_signed`` only the positive part of mu_E - mu_bar counts, for
    domains whose solver needs w >= 0. Arguments: see :class:`~.loop.Baseline`.
    """
    is_signed = setting.is_signed
    point = expert.mu

    def rule(W: Array, M: Array) -> Move:
        nonlocal point
        d, gap = M[-1] - point, expert.mu - point
        point = M[-1] if len(M) == 1 else point + _step(d, gap, is_signed) * d
        mixture = closest_mixture(M, expert.mu, is_signed=is_signed)
        gap = expert.mu - point if is_signed else np.maximum(expert.mu - point, 0.0)
        return towards(gap, mixture, tol * float(np.linalg.norm(expert.mu)))

    first = rng.dirichlet(np.ones(len(expert.mu)))
    return apprentices(forward, expert, first, rule, tol=tol, max_solves=max_solves)


def towards(gap: Array, mixture: Array, least: float) -> Move:
    """Ask for weights along the gap to the expert, or be content where it is small, shape (K,)."""
    if np.linalg.norm(gap) <= least:
        return Move(mixture, gap, Status.MATCHED)
    return Move(mixture, gap / np.abs(gap).sum())


def _step(d: Array, gap: Array, is_signed: bool) -> float:
    """Minimiser over [0, 1] of |gap - s d|_2, or of the norm of its positive part."""
    if not d.any():
        return 0.0
    if is_signed:
        return float(np.clip(d @ gap / (d @ d), 0.0, 1.0))
    lo, hi = 0.0, 1.0  # the derivative -d.(gap - s d)_+ rises with s: bisection to rounding
    for _ in range(60):
        s = 0.5 * (lo + hi)
        lo, hi = (s, hi) if d @ np.maximum(gap - s * d, 0.0) > 0 else (lo, s)
    return 0.5 * (lo + hi)
