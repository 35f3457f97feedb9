"""Summary of a run of CPIRL: the weights, how sure they are, and what limits them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from walking_irl.arrays import Array
from walking_irl.cpirl.gauge import freedom_in_words
from walking_irl.cpirl.regret_model import reduced
from walking_irl.cpirl.wording import ending_in_words, how_sure
from walking_irl.errors import InvalidInputError
from walking_irl.geometry.plane import plane_basis
from walking_irl.geometry.polyhedron import EXACT_OBJECTIVES, WeightPolyhedron
from walking_irl.types import Certainty, Expert, Iteration, Objective, Status

TOLERANCE = 1e-6
"""Regret that counts as none, relative to |w.mu_E|, unless a run is told otherwise."""
_ROUNDING = 1e-13
"""Returns below this, relative to the expert's largest feature, are reported as 0."""


@dataclass(frozen=True)
class Summary:
    """What a run found; see :func:`summarise`.

    Attributes:
        w: Representative weights, shape (K,).
        rule: How they were chosen, in words.
        intervals: Per-weight bounds, shape (K, 2), relative to the policies evaluated.
        physical_intervals: The same per raw unit of each cost, w_j / scale_j [1/unit], (K, 2).
        certificate: Some mixture of the policies found loses at most this much to the expert.
        bracket: Bounds on the least regret of any weights, noise in the expert's features included;
            0 inside means that the expert may be optimal.
        volume_ratio: Volume of the last polyhedron over the whole simplex's; above 7 weights an
            estimate, as a rule too small by a factor of 1.3 to 100.
        condition_number: Of the regret's Hessian, or None where no sensitivity is known.
        weakest: The trade-off that the behaviour reveals least, or None.
        gauge: Which changes of the weights no policy found can reveal, in words, or None.
        noise: Confidence half-widths of the expert's features, shape (K,).
        n_solves: Forward solves, probes included.
        status: Why the run ended.
        ending: The same in words, with figures.
        certainty: What the half widths of the weights are made of, or None where only cuts tell.
        how_sure: The same in words.
    """

    w: Array
    rule: str
    intervals: Array
    physical_intervals: Array
    certificate: float
    bracket: tuple[float, float]
    volume_ratio: float
    condition_number: float | None
    weakest: str | None
    gauge: str | None
    noise: Array
    n_solves: int
    status: Status
    ending: str
    certainty: Certainty | None
    how_sure: str


def summarise(
    iterations: Sequence[Iteration], expert: Expert, objectives: Sequence[Objective] = ()
) -> Summary:
    """Summary of the iterations of one run.

    Args:
        iterations: All that :func:`~walking_irl.cpirl.loop.cpirl` yielded, at least one.
        expert: The expert it was given.
        objectives: For names in words and scales; numbered, of scale 1, where missing.

    Raises:
        InvalidInputError: If there is no iteration.
    """
    if not iterations:
        raise InvalidInputError("nothing to summarise: no forward solve was finished")
    last = iterations[-1]
    K = len(last.w)
    names = [o.name for o in objectives] or [f"objective {i + 1}" for i in range(K)]
    scales = np.array([o.scale for o in objectives] or np.ones(K))
    condition, weakest = _identifiability(iterations, names)
    rounding = _ROUNDING * float(np.abs(expert.mu).max())
    certificate, low, high = (
        0.0 if abs(value) <= rounding else value for value in (last.certificate, *last.bracket)
    )
    whole = WeightPolyhedron.simplex(K, last.polyhedron.min_weight)
    return Summary(
        w=last.estimate,
        rule=_rule(iterations, has_model=condition is not None),
        intervals=last.intervals,
        physical_intervals=last.intervals / scales[:, None],
        certificate=certificate,
        bracket=(low, high),
        volume_ratio=last.polyhedron.volume() / whole.volume(),
        condition_number=condition,
        weakest=weakest,
        gauge=freedom_in_words(_differences(iterations, expert), names),
        noise=np.asarray(expert.error),
        n_solves=len(iterations),
        status=last.status,
        ending=ending_in_words(iterations, expert, TOLERANCE),
        certainty=last.certainty,
        how_sure=how_sure(last, expert),
    )


def estimate_name(found: Summary) -> str:
    """What the weights of a run are to be called: recovered, where it ended with some."""
    return "recovered" if found.status.has_weights else "best so far"


def per_unit(interval: Sequence[float], unit: str) -> str:
    """An interval of a weight per raw unit of its cost, in words.

    >>> per_unit((0.25, 0.5), "m^2/s^3"), per_unit((1.0, 1.0), "rad^2 s"), per_unit((0.0, 1.0), "1")
    ('0.25 - 0.5 per m^2/s^3', '1 - 1 per (rad^2 s)', '0 - 1')
    >>> per_unit((4e-17, 0.589), "s")  # a bound at zero, as a linear program leaves it
    '0 - 0.589 per s'
    """
    low, high = (0.0 if abs(x) <= _ROUNDING * max(map(abs, interval)) else x for x in interval)
    unit = f"({unit})" if " " in unit and not unit.startswith("(") else unit
    return f"{low:.3g} - {high:.3g}" + ("" if unit == "1" else f" per {unit}")


def volume_left(found: Summary) -> str:
    """Share of all weights' volume that is left, in words."""
    is_exact = len(found.w) <= EXACT_OBJECTIVES
    return f"{'' if is_exact else 'very roughly '}{found.volume_ratio:.1e} of the volume of all"


def noise_level(expert: Expert) -> str:
    """How well the expert's features are known, in words.

    >>> noise_level(Expert(np.array([2.0, 4.0]), np.array([0.1, 0.1]), n_samples=20))
    'known from 20 trajectories to within 5 % each'
    """
    if not np.any(expert.error):
        return "known exactly"
    size = np.abs(expert.mu)
    relative = 100 * np.max(expert.error / np.maximum(size, 1e-3 * max(size.max(), 1e-300)))
    seen = f" from {expert.n_samples} trajectories" if expert.n_samples else ""
    return f"known{seen} to within {relative:.2g} % each"


def _rule(iterations: Sequence[Iteration], has_model: bool) -> str:
    """How the last estimate came about."""
    last = iterations[-1]
    if any(np.array_equal(it.w, last.estimate) for it in iterations):
        return "the query of the least regret"
    if has_model:
        return "the minimum of the regret's quadratic model (a Newton step)"
    if last.status in (Status.GAP_CLOSED, Status.NOT_OPTIMAL):
        return "where the policies found leave the least regret"
    return "the centre of the weights that are left"


def _differences(iterations: Sequence[Iteration], expert: Expert) -> Array:
    """mu_i - mu_E of every policy evaluated, shape (n, K)."""
    K = len(expert.mu)
    found = [np.vstack([i.response.mu, i.response.evaluated.reshape(-1, K)]) for i in iterations]
    M = np.vstack(found)
    differences: Array = M[np.isfinite(M).all(axis=1)] - expert.mu
    return differences


def _identifiability(
    iterations: Sequence[Iteration], names: Sequence[str]
) -> tuple[float | None, str | None]:
    """Condition number of the Hessian nearest the estimate, and its weakest direction."""
    known = [i for i in iterations if i.response.sensitivity is not None]
    if not known:
        return None, None
    nearest = min(known, key=lambda i: float(np.abs(i.w - iterations[-1].estimate).sum()))
    assert nearest.response.sensitivity is not None
    values, vectors = np.linalg.eigh(reduced(nearest.response.sensitivity))
    direction = plane_basis(len(names)) @ vectors[:, 0]
    direction = direction * np.sign(direction[np.argmax(np.abs(direction))])
    for_, against = int(np.argmax(direction)), int(np.argmin(direction))
    condition = float(values[-1] / values[0]) if values[0] > 0.0 else np.inf
    return condition, f"{names[for_]} against {names[against]}"
