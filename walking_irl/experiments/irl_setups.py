"""How each IRL method is set up in table 3.1b; what is not said is the method's default."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.baselines.given import signed
from walking_irl.baselines.recovered import Recovered
from walking_irl.baselines.registry import METHODS, Needs, run_method
from walking_irl.experiments.irl_cases import Case
from walking_irl.types import Expert


class Line(NamedTuple):
    """A row of the table: a method and its settings."""

    label: str
    method: str
    """Name in the registry, or none for the expert itself."""
    options: Mapping[str, Any] = {}
    has_raw: bool = False
    """Whether it gets the raw features of states, as the option ``features``."""

    @property
    def is_complete(self) -> bool:
        """Whether it sees the expert's complete policy instead of demonstrations."""
        return bool(self.method) and METHODS[self.method].needs is Needs.POLICY


LINES: dict[str, Line] = {
    line.label: line
    for line in (
        Line("the expert itself", ""),
        Line("ng-russell-1", "ng-russell-1"),
        Line("ng-russell-2, box", "ng-russell-2", {"n_states": 30}),
        Line("ng-russell-2, simplex", "ng-russell-2", {"n_states": 30, "is_simplex": True}),
        Line("ng-russell-3", "ng-russell-3"),
        Line("projection", "projection"),
        Line("max-margin", "max-margin"),
        Line("mmp", "mmp"),
        Line("mmp-boost", "mmp-boost", has_raw=True),
        Line("neu-szepesvari", "neu-szepesvari"),
        Line("mwal", "mwal"),
        Line("lpal", "lpal"),
        Line("maxent, algorithm 1", "maxent", {"visits": "dynamics"}),
        Line("maxent, path measure", "maxent"),
        Line("mce-likelihood", "mce-likelihood"),
        Line("mce-matching", "mce-matching"),
        Line("relative-entropy", "relative-entropy"),
        Line("policywalk", "policywalk", {"n_samples": 1500}),
        Line("gpirl", "gpirl", has_raw=True),
        Line("kelley", "kelley"),
        Line("cpirl", "cpirl"),
        Line("cpirl-actions", "cpirl-actions"),
    )
}
ON_SIMPLEX = ("kelley", "cpirl", "cpirl-actions")
"""Methods whose weights are >= 0: where the true ones may be negative, features come twice."""


def answer(line: Line, case: Case, rng: np.random.Generator) -> Recovered:
    """What a method makes of a case; of the case it sees no reward."""
    if not line.method:
        return Recovered(policy=case.policy)
    options = {**line.options, **({"features": case.raw} if line.has_raw else {})}
    world = case.mdp
    if line.method in ON_SIMPLEX and not case.is_nonnegative:
        world = signed(world)
    data = _complete(case) if line.is_complete else case.demonstrations
    return run_method(line.method, world, data, rng=rng, **options)


def _complete(case: Case) -> Expert:
    mu: Array = case.mdp.feature_expectations(case.policy)
    return Expert(mu, np.zeros_like(mu), demonstration=case.policy)
