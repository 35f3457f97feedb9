"""The next query where Newton's method has none: Kelley's, or a centre, nudged if it repeats."""

from __future__ import annotations

import numpy as np

from walking_irl.cpirl.bundle import Bundle
from walking_irl.cpirl.levels import Levels
from walking_irl.cpirl.outlook import DeadEnd, Outlook, Query
from walking_irl.errors import EmptyPolyhedronError
from walking_irl.geometry.centres import CentreRule
from walking_irl.types import Rule

_MOST_NUDGES = 2


def kelley(outlook: Outlook) -> Query | None:
    """Where the policies found leave the least regret, if the newest is one that was known.

    Levels shrink towards an unknown minimum for ever where few policies meet in it; there the
    policies that are known either close the gap or are joined by a new one.
    """
    bundle = outlook.bundle
    if outlook.levels.has_known_minimum or len(bundle.M) < 2:
        return None
    if np.abs(bundle.M[:-1] - bundle.M[-1]).max(axis=1).min() > 1e-12 * bundle.unit:
        return None
    w = bundle.bounded_game.w
    if bundle.is_asked(w):
        return None
    return Query(w, Rule.KELLEY, outlook.levels.polyhedron(bundle))


class Centres:
    """Asks at centres of the polyhedron; one that repeats itself is nudged towards a corner.

    Args:
        rule: The centre.
        rng: Of sampling centres and of nudges.
    """

    def __init__(self, rule: CentreRule, rng: np.random.Generator) -> None:
        self.rule, self.rng = rule, rng
        self._n_nudges = 0

    def first(self, bundle: Bundle, levels: Levels) -> Query:
        """The centre of all weights."""
        P = levels.polyhedron(bundle)
        return Query(self.rule(P, rng=self.rng).w, Rule.CENTRE, P)

    def query(self, outlook: Outlook) -> Query | DeadEnd:
        """The centre of the weights that are left, or why there is none to ask."""
        P = outlook.levels.polyhedron(outlook.bundle)
        try:
            centre = self.rule(P, rng=self.rng).w
        except EmptyPolyhedronError as error:
            return DeadEnd(error)
        if not outlook.bundle.is_asked(centre):
            return Query(centre, Rule.CENTRE, P, centre)
        self._n_nudges += 1
        if self._n_nudges > _MOST_NUDGES:
            return DeadEnd(None, centre)
        v = self.rng.dirichlet(np.ones(outlook.bundle.K))
        corner = P.support(v - v.mean())[1]
        return Query(0.8 * centre + 0.2 * corner, Rule.CENTRE, P, centre)
