"""Multiplicative weights (U. Syed & R. Schapire, A game-theoretic approach, NIPS 2007)."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.apprentice import Apprentice, checked_budget
from walking_irl.errors import InvalidInputError
from walking_irl.types import Expert, Forward, Response, Status


def mwal(
    forward: Forward, expert: Expert, *, span: float, max_solves: int = 60
) -> Iterator[Apprentice]:
    """Play the game min_w max_pi w.(mu(pi) - mu_E): weights fall where the policy does well.

    w_i <- w_i beta^G_i with G = ((mu - mu_E) / span + 1) / 2 in [0, 1] and
    beta = 1 / (1 + sqrt(2 ln K / T)) (MWAL, steps 4 to 8). Features in [-1, 1] give
    span = 2 / (1 - gamma), hence the paper's ((1 - gamma)(mu - mu_E) + 2) / 4. The answer is the
    even mixture of all T policies; T = ``max_solves`` must be fixed in advance. Whether it is
    MWAL-VI or MWAL-PI is a matter of the forward solver.

    Args:
        forward: Best policy for weights of the simplex.
        expert: The expert; only ``mu`` is used.
        span: Bound on |mu_i - mu_E_i| of every policy and feature.
        max_solves: T, the number of rounds.

    Yields:
        One apprentice per forward solve; the last has a status other than CUT.

    Raises:
        InvalidInputError: If ``span`` is not positive, or a policy exceeds it.
    """
    checked_budget(max_solves, 0.0)
    if not span > 0:
        raise InvalidInputError(f"span must be positive, got {span}")
    K = len(expert.mu)
    beta = 1 / (1 + math.sqrt(2 * math.log(K) / max_solves))
    W: list[Array] = []
    responses: list[Response] = []
    log_w = np.zeros(K)
    for t in range(1, max_solves + 1):
        w = np.exp(log_w - log_w.max())
        W.append(w / w.sum())
        responses.append(forward(W[-1]))
        d = responses[-1].mu - expert.mu
        if np.abs(d).max() > span * (1 + 1e-9):
            raise InvalidInputError(
                f"span {span:.3g} is too small: a policy differs by {np.abs(d).max():.3g}"
            )
        log_w = log_w + math.log(beta) * (d / span + 1) / 2
        status = Status.BUDGET if t == max_solves else Status.CUT
        yield Apprentice(np.array(W), tuple(responses), np.full(t, 1 / t), expert.mu, status)


def regret_bound(K: int, n_rounds: int, span: float) -> float:
    """How far the even mixture is from the game's value at most (Syed & Schapire 2007, Theorem 2).

    2 span (sqrt(2 ln K / T) + ln K / T), with exact solves and expert: losses G in [0, 1]
    stand for differences of 2 span.
    """
    rate = math.log(K) / n_rounds
    return 2 * span * (math.sqrt(2 * rate) + rate)
