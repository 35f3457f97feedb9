"""How a solve goes: a homotopy in the root penalty, from soft to full."""

from __future__ import annotations

from typing import NamedTuple

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.optimiser.transcription import ROOT_PENALTY


class Stage(NamedTuple):
    """One stage of a homotopy in the root penalty."""

    penalty: float
    max_iter: int
    tol: float
    """Relative Newton decrement at which a gait counts as a minimum."""
    tether: float | Array = 0.0
    """Weight of the squared distance from the anchor, the start of the solve by default: one for
    all knots' unknowns, or one each, step length and half period included, shape (N nv + 2,)."""


def stage(raw_penalty: float, max_iter: int, tol: float, tether: float | Array = 0.0) -> Stage:
    """Stage with its penalty stated relative to the full one (1e6)."""
    return Stage(ROOT_PENALTY * raw_penalty / 1e6, max_iter, tol, tether)


DIRECT = (stage(1e6, 40, 1e-10),)
"""From a gait of similar weights."""
LADDER = (stage(1e4, 25, 1e-5), stage(1e6, 60, 1e-10))
"""From a gait of other weights."""
TETHERS = (1e5, 1e3, 1e1, 1e-1)
"""To be tried in turn until the tethered gait is physical: the first holds the mean of recorded
cycles, whose deviations are small, the last a gait that was perturbed by degrees."""


def nearby(tether: float) -> tuple[Stage, ...]:
    """To a physical gait near the start, whatever it costs; its root forces are what is left."""
    return tuple(stage(p, 12, 1e-4, tether) for p in (1e4, 1e5, 1e6))
