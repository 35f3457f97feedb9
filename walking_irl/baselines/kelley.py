"""Kelley's cutting planes on the regret: each query is the minimax program's (our addition).

J. Kelley, The cutting-plane method for solving convex programs (1960); on matrix games the same
queries are known as the double oracle method (McMahan, Gordon & Blum 2003).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.apprentice import Apprentice, checked_budget
from walking_irl.geometry.game import game_lp
from walking_irl.types import Expert, Forward, Response, Status


def kelley(
    forward: Forward, expert: Expert, *, tol: float = 1e-6, max_solves: int = 60
) -> Iterator[Apprentice]:
    """Ask for the weights at which the mixture found so far does worst.

    w_{k+1} = argmax_w min_i w.(mu_E - mu_i) over the simplex, starting from its centre. The value
    t_k and the smallest regret bracket the game's value: it stops once they meet.

    Args:
        forward: Best policy for weights of the simplex.
        expert: The expert; only ``mu`` is used.
        tol: Gap that counts as closed, relative to max |mu_E|.
        max_solves: Budget of forward solves.

    Yields:
        One apprentice per forward solve; the last has a status other than CUT.
    """
    checked_budget(max_solves, tol)
    K, scale = len(expert.mu), float(np.abs(expert.mu).max())
    w, regret = np.full(K, 1 / K), np.inf
    W: list[Array] = []
    responses: list[Response] = []
    for k in range(max_solves):
        W.append(w)
        responses.append(forward(w))
        D = np.array([r.mu for r in responses]) - expert.mu
        regret = min(regret, float(w @ D[-1]))
        game = game_lp(D)
        is_closed = regret + game.value <= tol * scale
        status = Status.GAP_CLOSED if is_closed else Status.CUT
        if k == max_solves - 1 and not is_closed:
            status = Status.BUDGET
        mixture = np.maximum(game.mixture, 0.0)
        mixture /= mixture.sum()
        yield Apprentice(np.array(W), tuple(responses), mixture, expert.mu, status)
        if is_closed:
            return
        w = game.w
