"""Bare cutting planes with any centre, and the thesis's Algorithm 3 (utopia) for comparison.

:func:`walking_irl.cpirl.loop.cpirl` is the method to use; this loop only serves table rows that
need another reference or another sampling of the centre.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog

from walking_irl.arrays import Array
from walking_irl.errors import EmptyPolyhedronError
from walking_irl.geometry.centres.centre import CentreRule
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.types import Expert, Forward, Response

STALL = 1e-10


class Step(NamedTuple):
    """One forward solve."""

    w: Array
    response: Response
    polyhedron: WeightPolyhedron


def cutting_planes(
    forward: Forward,
    expert: Expert,
    centre: CentreRule,
    *,
    rng: np.random.Generator,
    max_solves: int,
    has_utopia: bool = False,
) -> Iterator[Step]:
    """Query centres until the weights left are empty, flat or repeat themselves.

    Args:
        forward: Best policy for weights of the simplex.
        expert: The expert; only ``mu`` is used.
        centre: Rule of the next query.
        rng: Randomness of sampling centres.
        max_solves: Budget of forward solves.
        has_utopia: Algorithm 3: once the cuts at the expert leave nothing, cut at a Pareto-maximal
            point of the outer approximation instead, as the thesis's code does.
    """
    P = WeightPolyhedron.simplex(len(expert.mu))
    w = centre(P, rng=rng).w
    W: list[Array] = []
    M: list[Array] = []
    is_utopian = False
    for _ in range(max_solves):
        response = forward(w)
        W.append(w)
        M.append(response.mu)
        yield Step(w, response, P)
        reference = utopia(np.array(W), np.array(M), expert.mu) if is_utopian else expert.mu
        try:
            P, v = _queried(np.array(M) - reference, centre, rng)
        except EmptyPolyhedronError:
            if not has_utopia or is_utopian:
                return
            is_utopian = True
            reference = utopia(np.array(W), np.array(M), expert.mu)
            try:
                P, v = _queried(np.array(M) - reference, centre, rng)
            except EmptyPolyhedronError:
                return
        if np.abs(v - w).max() <= STALL:
            return
        w = v


def _queried(
    D: Array, centre: CentreRule, rng: np.random.Generator
) -> tuple[WeightPolyhedron, Array]:
    says = np.abs(D).max(axis=1) > 1e-12 * max(float(np.abs(D).max()), 1e-300)
    P = WeightPolyhedron.simplex(D.shape[1]).cut_all(D[says])
    return P, centre(P, rng=rng).w


def utopia(W: Array, M: Array, mu_E: Array) -> Array:
    """argmax {sum x : w_i.x <= w_i.mu_i, x >= mu_E}: what Algorithm 3 takes for the expert."""  # noqa: D403
    result = linprog(
        -np.ones(len(mu_E)),
        A_ub=W,
        b_ub=(W * M).sum(axis=1) + 1e-12,
        bounds=[(float(m), None) for m in mu_E],
        method="highs",
    )
    return np.asarray(result.x) if result.status == 0 else mu_E
