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
from walking_irl.baselines.ng_russell_2 import PENALTY, margin_program
from walking_irl.baselines.recovered import not_negative, positive
from walking_irl.types import Expert, Forward, Response, Status

REPEATED = 1e-9


def ng_russell_3(
    forward: Forward,
    expert: Expert,
    *,
    rng: np.random.Generator,
    penalty: float = PENALTY,
    tol: float = 1e-9,
    max_solves: int = 40,
    is_simplex: bool = False,
) -> Iterator[Apprentice]:
    """Ask for the weights under which the expert beats all policies found by most.

    Args:
        forward: Best policy for weights; must take negative ones unless ``is_simplex``.
        expert: The expert; only ``mu`` is used.
        rng: Draws the first weights.
        penalty: How much harder a policy counts that beats the expert.
        tol: Value of the program that counts as none, relative to max |mu_E|.
        max_solves: Budget of forward solves.
        is_simplex: Whether w >= 0 and sum w = 1; else |w_j| <= 1.

    Yields:
        One apprentice per forward solve; the last has a status other than CUT: MATCHED (no
        weights tell the expert from the policies), STALLED (weights repeat) or BUDGET.
    """
    positive(max_solves=max_solves)
    not_negative(tol=tol)
    K, scale = len(expert.mu), max(float(np.abs(expert.mu).max()), 1e-300)
    w = rng.dirichlet(np.ones(K)) if is_simplex else rng.uniform(-1, 1, K)
    W: list[Array] = []
    responses: list[Response] = []
    status = Status.CUT
    while status is Status.CUT:
        W.append(w)
        responses.append(forward(w))
        M = np.array([r.mu for r in responses])
        n = len(M)
        w, value = margin_program(
            expert.mu - M, np.arange(n), penalty=penalty, is_simplex=is_simplex
        )
        if value <= tol * scale:
            status = Status.MATCHED
        elif any(np.abs(w - v).max() <= REPEATED for v in W):
            status = Status.STALLED
        elif n == max_solves:
            status = Status.BUDGET
        mixture = closest_mixture(M, expert.mu, is_signed=not is_simplex)
        yield Apprentice(np.array(W), tuple(responses), mixture, expert.mu, status)
