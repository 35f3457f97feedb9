"""Which cuts of a polyhedron matter: those that no others imply, and those nearest its centre."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from walking_irl.errors import InvalidInputError
from walking_irl.geometry.polyhedron import WeightPolyhedron


def pruned(P: WeightPolyhedron) -> WeightPolyhedron:
    """The same set without implied cuts (the bounds of the weights always stay).

    The analytic centre depends on the rows, so pruning moves it; the set does not change.

    Raises:
        EmptyPolyhedronError: If the set is empty or flat.
    """
    K, active = P.n_objectives, P.whitened.active_rows()
    keep = active[active >= K] - K
    return replace(P, cuts=P.cuts[keep], is_lazy=P.is_lazy[keep])


def with_relevant(P: WeightPolyhedron, most: int) -> WeightPolyhedron:
    """The same set with all but the ``most`` most relevant cuts lazy.

    Nothing is dropped: a lazy cut enters the barrier where it cuts off its centre, and the bounds
    of the weights are always in it.

    Raises:
        InvalidInputError: If ``most`` is negative.
        EmptyPolyhedronError: If the set is empty or flat.
    """
    if most < 0:
        raise InvalidInputError(f"most must not be negative, got {most}")
    is_lazy = np.ones(len(P.cuts), dtype=bool)
    relevance = P.whitened.relevance()[P.n_objectives :]
    is_lazy[np.argsort(relevance, kind="stable")[:most]] = False
    return replace(P, is_lazy=is_lazy)
