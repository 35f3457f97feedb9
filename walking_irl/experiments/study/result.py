"""What a study found: containment, coverage, errors, widths, cost, endings, the worst experts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.experiments.study.command import recover_command
from walking_irl.experiments.study.coverage import (
    ROUNDING,
    Scored,
    Share,
    binomial_share,
    calibration,
    pooled_share,
    scored,
    strain,
)
from walking_irl.run.setup import Setup

QUANTILES = (0.5, 0.9, 1.0)
"""Of errors, half widths, solves and seconds; the last is the largest."""
CAUSES = {
    "noise": "from noise",
    "gap": "from the expert's possible sub-optimality",
    "solver": "from the solver",
}
"""Parts of a half width."""
N_WORST = 3


class Weight(NamedTuple):
    """One objective over all experts."""

    objective: str
    inside: Share
    errors: tuple[float, ...]
    """Quantiles of |w - w_E|."""
    half_widths: tuple[float, ...]
    """Quantiles of half the interval's width."""
    beyond_half: Share
    """Truths beyond half of the half width."""


class Worst(NamedTuple):
    """An expert to look at."""

    seed: int
    what: str
    command: str


@dataclass(frozen=True)
class Result:
    """A study's outcomes, and the figures that follow from them.

    Attributes:
        setup: Of the first expert.
        outcomes: One for each expert, by seed; see :class:`ExpertJob`.
    """

    setup: Setup
    outcomes: tuple[Mapping[str, Any], ...]

    @property
    def n(self) -> int:
        """Experts in all; one that failed counts as not contained."""
        return len(self.outcomes)

    @property
    def recovered(self) -> list[Mapping[str, Any]]:
        """Outcomes that have weights."""
        return [o for o in self.outcomes if "w" in o]

    @property
    def objectives(self) -> tuple[str, ...]:
        """Names of the objectives."""
        return tuple(self.recovered[0]["objectives"]) if self.recovered else ()

    @cached_property
    def scored(self) -> Scored:
        """Errors and half widths of those that have weights."""
        return scored(self.outcomes)

    @property
    def experts_inside(self) -> Share:
        """Experts all of whose weights lie inside their intervals."""
        return binomial_share(int(self.scored.inside.all(axis=1).sum()), self.n)

    @property
    def weights_inside(self) -> Share:
        """Weights inside their intervals, among experts that have some."""
        return pooled_share(self.scored.inside)

    @property
    def beyond_half(self) -> Share:
        """Truths beyond half of the half width: hardly any where intervals are needlessly wide."""
        return pooled_share(strain(self.scored) > 0.5)

    @property
    def inside_if_vouched(self) -> Share:
        """Experts whose weights would all lie inside had they been taken for optimal."""
        told = self._strain_if_vouched
        return binomial_share(int((told <= 1.0).all(axis=1).sum()), len(told))

    @property
    def beyond_half_if_vouched(self) -> Share:
        """Truths beyond half of the half width had experts been taken for optimal."""
        return pooled_share(self._strain_if_vouched > 0.5)

    @property
    def successes(self) -> Share:
        """Runs that end with an answer."""
        return binomial_share(sum(bool(o.get("is_success")) for o in self.outcomes), self.n)

    @property
    def calibration(self) -> dict[float, Share]:
        """Measured coverage by nominal level."""
        return calibration(self.scored)

    @property
    def weights(self) -> list[Weight]:
        """One row for each objective."""
        half, ratio = self._half_widths, strain(self.scored)
        return [
            Weight(
                name,
                binomial_share(int(self.scored.inside[:, j].sum()), len(half)),
                quantiles(self.scored.error[:, j]),
                quantiles(half[:, j]),
                binomial_share(int((ratio[:, j] > 0.5).sum()), len(half)),
            )
            for j, name in enumerate(self.objectives)
        ]

    @property
    def spreads(self) -> dict[str, tuple[float, ...]]:
        """Quantiles of what is measured once an expert, by name; half widths of all weights."""
        named = (
            ("L1 error", "l1_error"),
            ("relative loss", "loss"),
            ("forward solves", "solves"),
            ("probes", "probes"),
            ("CPU seconds", "cpu_seconds"),
        )
        found = {title: quantiles(self._column(name)) for title, name in named}
        whole = {"half width of a weight": quantiles(self._half_widths.ravel())}
        parts = {f"of it {what}": quantiles(self._part(name)) for name, what in CAUSES.items()}
        return {**whole, **{what: told for what, told in parts.items() if told}, **found}

    @property
    def endings(self) -> list[tuple[str, int, str]]:
        """How runs end, how many do, and an example in words; the most frequent one first."""
        counts = Counter(str(o["ending"]) for o in self.outcomes)
        example = {str(o["ending"]): str(o["status"]) for o in reversed(self.outcomes)}
        return [(name, n, example[name]) for name, n in counts.most_common()]

    @property
    def worst(self) -> list[Worst]:
        """Experts that failed; then those whose truth lies farthest out for its half width."""
        failed = [o for o in self.outcomes if "w" not in o]
        ratio = strain(self.scored)
        found = [self._worst(o, f"failed: {o['error']}") for o in failed]
        for i in np.argsort(-ratio.max(axis=1, initial=0.0), kind="stable")[:N_WORST]:
            j, outcome = int(ratio[i].argmax()), self.recovered[i]
            error, half = self.scored.error[i, j], self.scored.half[i, j]
            place = "inside" if self.scored.inside[i].all() else "OUTSIDE"
            what = (
                f"{self.objectives[j]} off by {error:.2g} with a half width of {half:.2g} "
                f"({place}), L1 error {outcome['l1_error']:.2g}, {outcome['ending']}"
            )
            found.append(self._worst(outcome, what))
        return found[:N_WORST]

    def _worst(self, outcome: Mapping[str, Any], what: str) -> Worst:
        seed = int(outcome["seed"])
        return Worst(seed, what, recover_command(replace(self.setup, seed=seed)))

    @property
    def _half_widths(self) -> Array:
        K = len(self.objectives)
        bounds = np.array([o["intervals"] for o in self.recovered]).reshape(-1, K, 2)
        half: Array = np.diff(bounds, axis=2)[:, :, 0] / 2
        return half

    def _part(self, name: str) -> Array:
        """One part of all weights' half widths, of runs that tell it."""
        told = [o["parts"][name] for o in self.recovered if o.get("parts")]
        return np.array(told).ravel()

    @property
    def _strain_if_vouched(self) -> Array:
        """Error over the half width without the part from sub-optimality, (N, K)."""
        told = [o for o in self.recovered if o.get("parts")]
        half = [np.add(o["parts"]["noise"], o["parts"]["solver"]) for o in told]
        error = [np.abs(np.subtract(o["w"], o["w_expert"])) for o in told]
        ratio = np.array(error) / np.maximum(half, ROUNDING)
        return ratio.reshape(-1, len(self.objectives))

    def _column(self, name: str) -> Array:
        return np.array([o[name] for o in self.outcomes if o.get(name) is not None], dtype=float)


def quantiles(values: Array) -> tuple[float, ...]:
    """Median, 90 % and largest; nothing of no values."""
    if not values.size:
        return ()
    return tuple(float(q) for q in np.quantile(values, QUANTILES))
