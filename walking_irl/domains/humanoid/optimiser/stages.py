"""How a solve goes: a homotopy in the root penalty, from soft to full."""

from __future__ import annotations

from typing import NamedTuple

from walking_irl.domains.humanoid.optimiser.transcription import ROOT_PENALTY


class Stage(NamedTuple):
    """One stage of a homotopy in the root penalty."""

    penalty: float
    max_iter: int
    tol: float
    """Relative decrease of the cost that counts as none; three in a row end the stage."""
    tether: float = 0.0
    """Weight of the squared distance from the start of the solve, for starts that do not walk."""


def stage(raw_penalty: float, max_iter: int, tol: float, tether: float = 0.0) -> Stage:
    """Stage with its penalty stated relative to the full one (1e6)."""
    return Stage(ROOT_PENALTY * raw_penalty / 1e6, max_iter, tol, tether)


DIRECT = (stage(1e6, 150, 1e-7),)
"""From a gait of similar weights."""
LADDER = (stage(1e4, 100, 1e-5), stage(1e5, 60, 1e-5), stage(1e6, 150, 1e-6))
"""From a gait of other weights."""
