"""Projection method (P. Abbeel & A. Ng, Apprenticeship learning via IRL, ICML 2004, sec. 3.1)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.apprentice import Apprentice, checked_budget, closest_mixture
from walking_irl.types import Expert, Forward, Response, Status


def projection(
    forward: Forward,
    expert: Expert,
    *,
    rng: np.random.Generator,
    tol: float = 1e-6,
    max_solves: int = 60,
    is_signed: bool = True,
) -> Iterator[Apprentice]:
    """Move a point of the hull of the policies towards the expert, one line at a time.

    mu_bar_i = mu_bar_{i-1} + ((d.(mu_E - mu_bar_{i-1})) / d.d) d with d = mu_i - mu_bar_{i-1}, and
    w_{i+1} = mu_E - mu_bar_i. The step is kept within [0, 1], so that mu_bar stays in the hull.
    Queries are scaled to sum |w| = 1. The answer is the mixture of all policies found that is
    closest to the expert (their section 3, a quadratic program), not mu_bar, which is farther.

    Args:
        forward: Best policy for weights; must take negative ones where ``is_signed``.
        expert: The expert; only ``mu`` is used.
        rng: Draws the first weights (the original draws a first policy).
        tol: Distance |mu_E - mu_bar|_2 at which it stops, relative to |mu_E|_2.
        max_solves: Budget of forward solves.
        is_signed: Whether weights may be negative, as in the original. Else only the positive part
            of mu_E - mu_bar counts, for domains whose solver needs w >= 0.

    Yields:
        One apprentice per forward solve; the last has a status other than CUT.
    """
    checked_budget(max_solves, tol)
    w = rng.dirichlet(np.ones(len(expert.mu)))
    W: list[Array] = []
    responses: list[Response] = []
    point = expert.mu
    for _ in range(max_solves):
        W.append(w)
        responses.append(forward(w))
        mu = responses[-1].mu
        d, gap = mu - point, expert.mu - point
        point = mu if len(W) == 1 else point + _step(d, gap, is_signed) * d
        mixture = closest_mixture(
            np.array([r.mu for r in responses]), expert.mu, is_signed=is_signed
        )
        gap = expert.mu - point if is_signed else np.maximum(expert.mu - point, 0.0)
        is_close = np.linalg.norm(gap) <= tol * np.linalg.norm(expert.mu)
        is_last = len(W) == max_solves
        status = Status.MATCHED if is_close else Status.BUDGET if is_last else Status.CUT
        yield Apprentice(np.array(W), tuple(responses), mixture, expert.mu, status)
        if is_close:
            return
        w = gap / np.abs(gap).sum()


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
