"""Multiplicative weights (U. Syed & R. Schapire, A game-theoretic approach, NIPS 2007)."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.apprentice import Apprentice
from walking_irl.baselines.loop import USUAL, Move, Setting, apprentices
from walking_irl.errors import InvalidInputError
from walking_irl.types import Expert, Forward


def mwal(
    forward: Forward,
    expert: Expert,
    *,
    rng: np.random.Generator,
    setting: Setting = USUAL,
    tol: float = 0.0,
    max_solves: int = 60,
) -> Iterator[Apprentice]:
    """Play the game min_w max_pi w.(mu(pi) - mu_E): weights fall where the policy does well.

    w_i <- w_i beta^G_i with G = ((mu - mu_E) / span + 1) / 2 in [0, 1] and
    beta = 1 / (1 + sqrt(2 ln K / T)) (MWAL, steps 4 to 8). Features in [-1, 1] give
    span = 2 / (1 - gamma), hence the paper's ((1 - gamma)(mu - mu_E) + 2) / 4. The answer is the
    even mixture of all T policies; T = ``max_solves`` must be fixed in advance, so nothing ends it
    early. Whether it is MWAL-VI or MWAL-PI is a matter of the forward solver. Arguments: see
    :class:`~.loop.Baseline`; nothing is drawn.

    Raises:
        InvalidInputError: If ``setting.span`` is not positive, or a policy exceeds it.
    """
    span = setting.span
    if span is None or not span > 0:
        raise InvalidInputError(f"span must be positive, got {span}")
    K = len(expert.mu)
    beta = 1 / (1 + math.sqrt(2 * math.log(K) / max(max_solves, 1)))
    log_w = np.zeros(K)

    def rule(W: Array, M: Array) -> Move:
        nonlocal log_w
        d, t = M[-1] - expert.mu, len(M)
        if np.abs(d).max() > span * (1 + 1e-9):
            raise InvalidInputError(
                f"span {span:.3g} is too small: a policy differs by {np.abs(d).max():.3g}"
            )
        log_w = log_w + math.log(beta) * (d / span + 1) / 2
        w = np.exp(log_w - log_w.max())
        return Move(np.full(t, 1 / t), w / w.sum())

    return apprentices(forward, expert, np.full(K, 1 / K), rule, tol=tol, max_solves=max_solves)


def regret_bound(K: int, n_rounds: int, span: float) -> float:
    """How far the even mixture is from the game's value at most (Syed & Schapire 2007, Theorem 2).

    2 span (sqrt(2 ln K / T) + ln K / T), with exact solves and expert: losses G in [0, 1]
    stand for differences of 2 span.
    """
    rate = math.log(K) / n_rounds
    return 2 * span * (math.sqrt(2 * rate) + rate)
