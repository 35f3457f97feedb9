"""The thesis's Algorithm 3 for sub-optimal experts, as its authors' code has it; for comparison.

1. Ask at the centre of all weights.
2. Find the best policy for the query.
3. Cut by (mu_i - mu_ref).w <= 0 for all policies found; mu_ref is the expert's mu_E.
4. Ask at the centre of what is left, and go on with 2.
5. Once nothing is left, mu_ref is the utopia instead, in every iteration from then on: the largest
   point, in the sum of its features, above mu_E that the policies found do not rule out.
6. Stop where that leaves nothing either (a mixture of the policies found beats the expert), or the
   query repeats itself.

Asking the loop of :mod:`walking_irl.cpirl.loop` for the least regret (``mode="minimise"``) needs no
utopia, and fewer solves; :mod:`walking_irl.experiments` compares the two.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import EmptyPolyhedronError
from walking_irl.geometry.centres import CentreRule, OwnCentre, centre_rule
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.types import Expert, Forward, Response

STALL = 1e-10
"""Largest change of a weight that counts as none."""


class Step(NamedTuple):
    """One forward solve."""

    w: Array
    response: Response
    polyhedron: WeightPolyhedron


def algorithm3(
    forward: Forward,
    expert: Expert,
    *,
    centre: str | OwnCentre = "ac",
    rng: np.random.Generator,
    max_solves: int = 60,
) -> Iterator[Step]:
    """Query centres until the weights left are empty, flat or repeat themselves.

    Args:
        forward: Best policy for weights of the simplex.
        expert: The expert; only ``mu`` is used.
        centre: Rule of the next query, see :func:`~walking_irl.cpirl.loop.cpirl`.
        rng: Randomness of sampling centres.
        max_solves: Budget of forward solves.

    Raises:
        InvalidInputError: If there is no such centre.
    """
    rule = centre_rule(centre)
    P = WeightPolyhedron.simplex(len(expert.mu))
    w, W, M = rule(P, rng=rng).w, np.empty((0, len(expert.mu))), np.empty((0, len(expert.mu)))
    is_utopian = False
    for _ in range(max_solves):
        response = forward(w)  # steps 1 and 2
        W, M = np.vstack([W, w]), np.vstack([M, response.mu])
        yield Step(w, response, P)
        following = None
        if not is_utopian:
            following = centre_of_the_rest(M - expert.mu, rule, rng)  # steps 3 and 4
            is_utopian = following is None
        if is_utopian:
            following = centre_of_the_rest(M - utopia(W, M, expert.mu), rule, rng)  # step 5
        if following is None or np.abs(following[1] - w).max() <= STALL:  # step 6
            return
        P, w = following


def centre_of_the_rest(
    D: Array, rule: CentreRule, rng: np.random.Generator
) -> tuple[WeightPolyhedron, Array] | None:
    """What the cuts D w <= 0 leave, and its centre; None where it has no interior.

    Args:
        D: Differences of policies to the reference, shape (n, K); zero rows say nothing.
        rule: The centre.
        rng: Of sampling centres.
    """
    says = np.abs(D).max(axis=1) > 1e-12 * max(float(np.abs(D).max()), 1e-300)
    P = WeightPolyhedron.simplex(D.shape[1]).cut_all(D[says])
    try:
        return P, rule(P, rng=rng).w
    except EmptyPolyhedronError:
        return None


def utopia(W: Array, M: Array, mu_E: Array) -> Array:
    """The point argmax {sum x : w_i.x <= w_i.mu_i, x >= mu_E} that step 5 takes for the expert.

    Args:
        W: Queries, shape (n, K).
        M: Features of their policies, shape (n, K).
        mu_E: The expert's, shape (K,); returned where there is no such point.
    """
    from scipy.optimize import linprog  # takes .3 s, and is needed by this algorithm alone

    result = linprog(
        -np.ones(len(mu_E)),
        A_ub=W,
        b_ub=(W * M).sum(axis=1) + 1e-12,
        bounds=[(float(m), None) for m in mu_E],
        method="highs",
    )
    return np.asarray(result.x) if result.status == 0 else mu_E
