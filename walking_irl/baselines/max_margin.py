"""Max-margin method (P. Abbeel & A. Ng, Apprenticeship learning via IRL, ICML 2004, section 3)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.apprentice import Apprentice, checked_budget, closest_mixture
from walking_irl.types import Expert, Forward, Response, Status


def max_margin(
    forward: Forward,
    expert: Expert,
    *,
    rng: np.random.Generator,
    tol: float = 1e-6,
    max_solves: int = 60,
    is_signed: bool = True,
) -> Iterator[Apprentice]:
    """Ask for the weights under which the expert beats all policies found by the widest margin.

    max t subject to w.mu_E >= w.mu_j + t for all j, |w|_2 <= 1. Its dual is the mixing program:
    the optimal w points from the closest mixture to the expert, and t is their distance.

    Args:
        forward: Best policy for weights; must take negative ones where ``is_signed``.
        expert: The expert; only ``mu`` is used.
        rng: Draws the first weights (the original draws a first policy).
        tol: Margin that counts as none, relative to |mu_E|_2.
        max_solves: Budget of forward solves.
        is_signed: Whether weights may be negative, as in the original; else w >= 0 is added.

    Yields:
        One apprentice per forward solve; the last has a status other than CUT.
    """
    checked_budget(max_solves, tol)
    w = rng.dirichlet(np.ones(len(expert.mu)))
    W: list[Array] = []
    responses: list[Response] = []
    for _ in range(max_solves):
        W.append(w)
        responses.append(forward(w))
        M = np.array([r.mu for r in responses])
        mixture = closest_mixture(M, expert.mu, is_signed=is_signed)
        gap = expert.mu - mixture @ M
        gap = gap if is_signed else np.maximum(gap, 0.0)
        is_close = np.linalg.norm(gap) <= tol * np.linalg.norm(expert.mu)
        is_last = len(W) == max_solves
        status = Status.MATCHED if is_close else Status.BUDGET if is_last else Status.CUT
        yield Apprentice(np.array(W), tuple(responses), mixture, expert.mu, status)
        if is_close:
            return
        w = gap / np.abs(gap).sum()
