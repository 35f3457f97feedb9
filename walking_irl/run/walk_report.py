"""What is told of a recorded walk's explanation besides its weights."""

from __future__ import annotations

from typing import Any

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.gait.realism import ON_GROUND, gait_cycle
from walking_irl.run.walk import Explanation


def force_apart(walker: Walker, gait: Gait, vertical: Array) -> float:
    """Vertical force of a gait against a measured one, root mean square over stance.

    Args:
        walker: The body.
        gait: Its gait.
        vertical: Measured under the right foot over the whole cycle, shape (n,) [body weights].

    Returns:
        The difference at equal shares of stance [body weights].
    """
    share = np.linspace(0.02, 0.98, 49)
    curves = []
    for force in (gait_cycle(walker, gait).force[:, 0], vertical):
        on = force > ON_GROUND
        start = int(np.flatnonzero(on & ~np.roll(on, 1) & np.roll(on, -3))[0])
        rolled = np.roll(force, -start)
        n = int(np.flatnonzero(rolled > ON_GROUND)[-1]) + 1
        curves.append(np.interp(share * (n - 1), np.arange(n), rolled[:n]))
    return float(np.sqrt(np.mean((curves[0] - curves[1]) ** 2)))


def explanation_json(found: Explanation, shown: Gait) -> dict[str, Any]:
    """An explanation as plain JSON types."""
    end = found.end
    return {
        "nearest": {
            "sagittal": end.near.sagittal,
            "degrees": end.near.degrees,
            "root": end.near.root,
            "cost": end.cost,
        },
        "suboptimality": list(found.bracket),
        "bracket_solves": found.solves,
        "w": found.w.tolist(),
        "half_widths": found.half.tolist(),
        "intervals": found.intervals.tolist(),
        "from_walk": found.allowed.tolist(),
        "from_starts": found.starts.tolist(),
        "from_trials": found.trials.tolist(),
        "gap": end.gap,
        "best": {"sagittal": found.sagittal, "degrees": found.apart, **_paces(end.gait)},
        "shown": _paces(shown),
        "steps": [{"w": p.w.tolist(), "gap": p.gap} for p in found.fit.points],
        "other_starts": [{"w": p.w.tolist(), "gap": p.gap} for p in found.others],
    }


def _paces(gait: Gait) -> dict[str, float]:
    return {
        "speed": gait.speed,
        "step_length": gait.step_length,
        "half_period": gait.half_period,
    }
