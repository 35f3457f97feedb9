"""Ng & Russell 3: weights from trajectories alone (ICML 2000, section 5).

w <- argmax sum_i p(w.(mu_E - mu_i)) over all policies found, then the best policy for w, and so
on. The program's vertex soon repeats itself: it stalls with a loss of some per cent. It is here as
history, not as a tool.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.apprentice import Apprentice, closest_mixture
from walking_irl.baselines.loop import USUAL, Move, Setting, apprentices
from walking_irl.baselines.ng_russell_2 import margin_program
from walking_irl.types import Expert, Forward, Status

REPEATED = 1e-9
"""Largest difference of weights that count as asked for before."""


def ng_russell_3(
    forward: Forward,
    expert: Expert,
    *,
    rng: np.random.Generator,
    setting: Setting = USUAL,
    tol: float = 1e-9,
    max_solves: int = 40,
) -> Iterator[Apprentice]:
    """Ask for the weights under which the expert beats all policies found by most.

    |w_j| <= 1, or w on the simplex without ``setting.is_signed``; the first weights are drawn. The
    last status is MATCHED (the program's value is at most ``tol`` max |mu_E|: no weights tell the
    expert from the policies), STALLED (weights repeat) or BUDGET. Arguments: see
    :class:`~.loop.Baseline`.
    """
    K, scale = len(expert.mu), max(float(np.abs(expert.mu).max()), 1e-300)
    is_signed = setting.is_signed

    def rule(W: Array, M: Array) -> Move:
        rows = np.arange(len(M))
        w, value = margin_program(expert.mu - M, rows, is_simplex=not is_signed)
        status = Status.CUT
        if value <= tol * scale:
            status = Status.MATCHED
        elif np.abs(W - w).max(axis=1).min() <= REPEATED:
            status = Status.STALLED
        return Move(closest_mixture(M, expert.mu, is_signed=is_signed), w, status)

    first = rng.uniform(-1, 1, K) if is_signed else rng.dirichlet(np.ones(K))
    return apprentices(forward, expert, first, rule, tol=tol, max_solves=max_solves)
