"""Max-margin method (P. Abbeel & A. Ng, Apprenticeship learning via IRL, ICML 2004, section 3)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.apprentice import Apprentice, closest_mixture
from walking_irl.baselines.loop import USUAL, Move, Setting, apprentices
from walking_irl.baselines.projection import towards
from walking_irl.types import Expert, Forward


def max_margin(
    forward: Forward,
    expert: Expert,
    *,
    rng: np.random.Generator,
    setting: Setting = USUAL,
    tol: float = 1e-6,
    max_solves: int = 60,
) -> Iterator[Apprentice]:
    """Ask for the weights under which the expert beats all policies found by the widest margin.

    max t subject to w.mu_E >= w.mu_j + t for all j, |w|_2 <= 1. Its dual is the mixing program:
    the optimal w points from the closest mixture to the expert, and t is their distance; it ends
    where t <= tol |mu_E|_2. The first weights are drawn (the original draws a first policy).
    Without ``setting.is_signed``, w >= 0 is added. Arguments: see :class:`~.loop.Baseline`.
    """
    is_signed = setting.is_signed

    def rule(W: Array, M: Array) -> Move:
        mixture = closest_mixture(M, expert.mu, is_signed=is_signed)
        gap = expert.mu - mixture @ M
        gap = gap if is_signed else np.maximum(gap, 0.0)
        return towards(gap, mixture, tol * float(np.linalg.norm(expert.mu)))

    first = rng.dirichlet(np.ones(len(expert.mu)))
    return apprentices(forward, expert, first, rule, tol=tol, max_solves=max_solves)
