"""Kelley's cutting planes on the regret: each query is the minimax program's (our addition).

J. Kelley, The cutting-plane method for solving convex programs (1960); on matrix games the same
queries are known as the double oracle method (McMahan, Gordon & Blum 2003).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.apprentice import Apprentice
from walking_irl.baselines.loop import USUAL, Move, Setting, apprentices
from walking_irl.geometry.game import game_lp
from walking_irl.types import Expert, Forward, Status


def kelley(
    forward: Forward,
    expert: Expert,
    *,
    rng: np.random.Generator,
    setting: Setting = USUAL,
    tol: float = 1e-6,
    max_solves: int = 60,
) -> Iterator[Apprentice]:
    """Ask for the weights at which the mixture found so far does worst.

    w_{k+1} = argmax_w min_i w.(mu_E - mu_i) over the simplex, starting from its centre. The value
    t_k and the smallest regret bracket the game's value: it stops once they meet, to ``tol``
    relative to max |mu_E|. Arguments: see :class:`~.loop.Baseline`; nothing is drawn.
    """
    K, scale = len(expert.mu), float(np.abs(expert.mu).max())

    def rule(W: Array, M: Array) -> Move:
        D = M - expert.mu
        regret = float(np.einsum("ij,ij->i", W, D).min())
        game = game_lp(D)
        is_closed = regret + game.value <= tol * scale
        mixture = np.maximum(game.mixture, 0.0)
        status = Status.GAP_CLOSED if is_closed else Status.CUT
        return Move(mixture / mixture.sum(), game.w, status)

    return apprentices(forward, expert, np.full(K, 1 / K), rule, tol=tol, max_solves=max_solves)
