"""Bare cutting planes with any centre: for table rows that need another sampling of it.

:func:`walking_irl.cpirl.loop.cpirl` is the method to use.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from walking_irl.cpirl.algorithm3 import STALL, Step, centre_of_the_rest
from walking_irl.geometry.centres import CentreRule
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.types import Expert, Forward


def cutting_planes(
    forward: Forward,
    expert: Expert,
    centre: CentreRule,
    *,
    rng: np.random.Generator,
    max_solves: int,
) -> Iterator[Step]:
    """Query centres until the weights left are empty, flat or repeat themselves.

    Args:
        forward: Best policy for weights of the simplex.
        expert: The expert; only ``mu`` is used.
        centre: Rule of the next query.
        rng: Randomness of sampling centres.
        max_solves: Budget of forward solves.
    """
    P = WeightPolyhedron.simplex(len(expert.mu))
    w, M = centre(P, rng=rng).w, np.empty((0, len(expert.mu)))
    for _ in range(max_solves):
        response = forward(w)
        M = np.vstack([M, response.mu])
        yield Step(w, response, P)
        following = centre_of_the_rest(M - expert.mu, centre, rng)
        if following is None or np.abs(following[1] - w).max() <= STALL:
            return
        P, w = following
