"""How often intervals hold the truth: containment, coverage by nominal level, binomial intervals.

Intervals of a run hold all K weights at once at 95 %. Those of one weight at a nominal level are
made from them: the part of a half width that comes from noise goes with Student's quantile; what
an expert's possible sub-optimality allows is no matter of chance, and the same at every level: so
are all intervals of an expert that is known exactly. Where a recorded expert's run does not tell
the parts, the whole half width is scaled. Binomial intervals are those of Clopper and Pearson,
Biometrika 26 (1934).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta

from walking_irl.arrays import Array
from walking_irl.expert import student_quantile

Marks = NDArray[np.bool_]

LEVELS = (0.5, 0.8, 0.9, 0.95, 0.99)
"""Nominal levels of a calibration."""
REPORTED = 0.95
"""Nominal level of a run's intervals, for all weights at once."""
ROUNDING = 1e-9
"""By how much an interval may miss: what a report of one run grants as well."""


class Share(NamedTuple):
    """A measured share and its 95 % interval."""

    value: float
    low: float
    high: float


def binomial_share(k: float, n: int) -> Share:
    """K of n, with the exact binomial interval of Clopper and Pearson at 95 %.

    >>> [round(v, 4) for v in binomial_share(97, 100)]
    [0.97, 0.9148, 0.9938]
    """
    if n == 0:
        return Share(float("nan"), 0.0, 1.0)
    low = float(beta.ppf(0.025, k, n - k + 1)) if k > 0 else 0.0
    high = float(beta.ppf(0.975, k + 1, n - k)) if k < n else 1.0
    return Share(k / n, low, high)


def pooled_share(hits: Marks) -> Share:
    """Share of true entries of (N, K), its interval as wide as that of N entries.

    The K weights of one expert sum to one and share their errors, so that they count as one draw.
    """
    n = len(hits) if hits.size else 0
    return binomial_share(float(hits.mean()) * n if n else 0.0, n)


class Scored(NamedTuple):
    """Errors and half widths of the experts of a study that have weights, N x K each."""

    error: Array
    """|w - w_E|."""
    half: Array
    """Distance from w to the bound on the side of w_E; the wider side's where it is clipped."""
    inside: Marks
    """Whether w_E lies inside the run's interval."""
    statistical: Array
    """Part of the half width that comes from noise: none of an exact expert's."""
    n_samples: Array
    """Rollouts behind each expert, shape (N,); 0 where it is exact."""


def scored(outcomes: Sequence[Mapping[str, Any]]) -> Scored:
    """Arrays of the outcomes that have weights."""
    found = [o for o in outcomes if "w" in o]
    K = len(found[0]["w"]) if found else 0
    w, w_E = (np.array([o[name] for o in found]).reshape(-1, K) for name in ("w", "w_expert"))
    low, high = np.moveaxis(np.array([o["intervals"] for o in found]).reshape(-1, K, 2), 2, 0)
    least = np.array([o["least"] for o in found])[:, None]
    wider = np.maximum(w - low, high - w)
    is_clipped = np.where(w_E < w, low <= least + ROUNDING, high >= 1.0 - ROUNDING)
    half = np.where(is_clipped, wider, np.where(w_E < w, w - low, high - w))
    n_samples = np.array([o["n_samples"] for o in found], dtype=int)
    return Scored(
        error=np.abs(w - w_E),
        half=half,
        inside=(w_E >= low - ROUNDING) & (w_E <= high + ROUNDING),
        statistical=np.array([_from_noise(o, h) for o, h in zip(found, half, strict=True)]),
        n_samples=n_samples,
    )


def _from_noise(outcome: Mapping[str, Any], half: Array) -> Array:
    """Part of one expert's half widths that comes from noise."""
    if outcome["n_samples"] == 0:
        return np.zeros_like(half)
    parts = outcome.get("parts")
    return half if parts is None else np.minimum(parts["noise"], half)


def inside_at(level: float, found: Scored) -> Marks:
    """Whether each truth lies inside the interval of its own at a nominal level, (N, K)."""
    n, K = found.n_samples, found.error.shape[1]
    q = student_quantile(level, n) / student_quantile(REPORTED, n, K)
    half = found.half + (q[:, None] - 1.0) * found.statistical
    within: Marks = found.error <= half + ROUNDING
    return within


def calibration(found: Scored) -> dict[float, Share]:
    """Measured coverage by one weight's intervals of each nominal level, all weights together."""
    return {level: pooled_share(inside_at(level, found)) for level in LEVELS}


def strain(found: Scored) -> Array:
    """Error over half width of each weight, (N, K): above 1 the truth is outside."""
    ratio: Array = found.error / np.maximum(found.half, ROUNDING)
    return ratio
