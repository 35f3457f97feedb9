"""Experts who prefer better actions without always taking the best one."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.rl.soft import soft_policy
from walking_irl.types import Expert

SCALE = 20.0
"""Rewards in [0, 1] are multiplied by it: on random MDPs the soft expert then loses a fifth of
what the best policy gains over chance."""


def soft_expert(mdp: FiniteMDP, w_E: Array, scale: float = SCALE) -> Expert:
    """Expert that acts by the soft-optimal policy of reward ``scale`` w.phi, known exactly.

    Its demonstration is that policy, shape (S, A).
    """
    policy = soft_policy(mdp, scale * mdp.reward(w_E)).pi
    mu = mdp.feature_expectations(policy)
    return Expert(mu, np.zeros_like(mu), demonstration=policy)
