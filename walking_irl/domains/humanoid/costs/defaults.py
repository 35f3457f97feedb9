"""The six costs of the shipped walkers, and the fixed part that they share."""

from __future__ import annotations

import numpy as np

from walking_irl.domains.humanoid.costs.base import Cost, SharedCost
from walking_irl.domains.humanoid.costs.effort import Effort
from walking_irl.domains.humanoid.costs.gap import LegGap
from walking_irl.domains.humanoid.costs.impact import Impact
from walking_irl.domains.humanoid.costs.limits import JointLimits
from walking_irl.domains.humanoid.costs.skid import Skid
from walking_irl.domains.humanoid.costs.smooth import Smoothness
from walking_irl.domains.humanoid.costs.stability import Stability
from walking_irl.domains.humanoid.costs.time import Time
from walking_irl.domains.humanoid.costs.work import Work

Costs = tuple[Cost | SharedCost, ...]

PER_METRE: tuple[Cost, ...] = (Effort(), Work(), Smoothness(), Stability(), Impact(), Time())
SHARED: tuple[SharedCost, ...] = (Skid(), LegGap(), JointLimits())
DEFAULT_COSTS: Costs = (*PER_METRE, *SHARED)
"""What a walker may walk for, and what all walkers avoid."""

OBJECTIVES = tuple(c.objective for c in PER_METRE)
REFERENCE_RAW = np.array([c.reference for c in PER_METRE], dtype=float)
"""Coefficients of the unscaled costs that give the most human gait known."""
UNIT = float(REFERENCE_RAW @ [c.scale for c in PER_METRE])
"""Sum of the raw coefficients in scaled units; the fixed part is stated in raw units."""
REFERENCE_WEIGHTS = REFERENCE_RAW * [c.scale for c in PER_METRE] / UNIT
"""Reference weights on the simplex, shape (6,)."""
