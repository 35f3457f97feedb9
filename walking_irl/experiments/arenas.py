"""What a table's cell must know of each domain: the tables' own registry."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from walking_irl.baselines.loop import Setting
from walking_irl.domains import load
from walking_irl.domains.contract import INTERIOR, Demonstration, Learner, Request
from walking_irl.errors import InvalidInputError
from walking_irl.types import Expert, Forward


@dataclass(frozen=True)
class Arena:
    """How the methods of a table meet on one domain.

    Attributes:
        population: Whose experts they are to explain.
        is_finite: Whether it is a finite MDP: its solver takes signed weights, LPAL applies, and
            the discount bounds how far features in [0, 1] differ.
        floor: Share of equal weights in every query of a baseline.
        is_slow: Whether experts are kept, because finding one takes longer than a row; nothing is
            solved before the clock starts then.
    """

    population: str = "uniform"
    is_finite: bool = False
    floor: float = 0.0
    is_slow: bool = False

    def setting(self, domain: Any, oracle: Forward, expert: Expert, needs_span: bool) -> Setting:
        """What baselines are told of the domain; a span from its corners costs K solves."""
        if self.is_finite:
            return Setting(True, 1 / (1 - domain.mdp.discount), domain.mdp)
        corners: Any = np.eye(len(expert.mu)) if needs_span else []
        spans = [float(np.abs(oracle(w).mu - expert.mu).max()) for w in corners]
        return Setting(False, max(spans, default=None))

    def solver(self, domain: Any, expert: Expert) -> Forward:
        """The learner's; that of a finite MDP takes any weights."""
        if self.is_finite:
            forward: Forward = domain.solve
            return forward
        learner: Learner = domain.learner(expert, {}, rng=_rng(0))  # exact: nothing is measured
        return learner.forward

    def oracle(self, forward: Forward) -> Forward:
        """The solver that baselines ask: it moves weights off the faces of the simplex."""
        if self.floor == 0.0:
            return forward
        return lambda w: forward((1 - self.floor) * w + self.floor / len(w))


ARENAS = {
    "gridworld": Arena("sparse", is_finite=True),
    "driving": Arena(is_finite=True),
    "lqr": Arena(),
    "walking-path": Arena("interior", floor=INTERIOR),
    "humanoid": Arena("typical", floor=INTERIOR, is_slow=True),
    "humanoid-planar": Arena("typical", floor=INTERIOR, is_slow=True),
}


def arena_of(name: str) -> Arena:
    """The arena of a domain.

    Raises:
        InvalidInputError: If tables know none of that name.
    """
    if name not in ARENAS:
        raise InvalidInputError(f"unknown domain {name!r}; choose from {', '.join(ARENAS)}")
    return ARENAS[name]


def drawn(
    name: str, domain: Any, expert: str, seed: int, rng: np.random.Generator
) -> Demonstration:
    """A random expert of a domain, known exactly."""
    arena = arena_of(name)
    if arena.is_slow:
        return _kept(name, expert, seed)
    given = {"population": arena.population} if domain.options else {}
    shown: Demonstration = domain.demonstrate(Request(None, expert, given), rng=rng)
    return shown


@lru_cache(maxsize=32)
def _kept(name: str, expert: str, seed: int) -> Demonstration:
    options: dict[str, Any] = {"population": ARENAS[name].population}
    if expert == "optimal":
        options["rollouts"] = 0
    return load(name).demonstrate(Request(None, expert, options), rng=_rng(seed))


def _rng(seed: int) -> np.random.Generator:
    """Of the expert of a seed."""
    return np.random.default_rng([seed, 7])
