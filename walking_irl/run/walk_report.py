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
    last = found.last
    return {
        "nearest": {
            "sagittal": last.near.sagittal,
            "degrees": last.near.degrees,
            "root": last.near.root,
            "way": last.near.way,
            "cost": last.cost,
        },
        "suboptimality": list(last.bracket),
        "w": found.w.tolist(),
        "half_widths": found.half.tolist(),
        "intervals": found.intervals.tolist(),
        "from_slack": found.allowed.tolist(),
        "from_starts": found.starts.tolist(),
        "from_trials": found.trials.tolist(),
        "best": {
            "sagittal": found.sagittal,
            "degrees": found.apart,
            "speed": last.best.speed,
            "step_length": last.best.step_length,
            "half_period": last.best.half_period,
        },
        "shown": {
            "speed": shown.speed,
            "step_length": shown.step_length,
            "half_period": shown.half_period,
        },
        "rounds": [
            {"w": r.w.tolist(), "gap": r.gap, "bracket": list(r.bracket), "solves": r.solves}
            for r in found.rounds
        ],
        "other_starts": [r.w.tolist() for r in found.others],
    }
