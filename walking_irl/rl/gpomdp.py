"""GPOMDP: policy gradients that charge no action for what came before it.

Source: J. Baxter & P. Bartlett, Infinite-horizon policy-gradient estimation (2001); baselines of
Peters & Schaal (2008), table 2.
"""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.rl.episodes import Episodes


def gpomdp(episodes: Episodes, discount: float, *, has_baseline: bool = True) -> Array:
    """Estimate of d mu / d theta: mean of sum_t gamma^t (phi_t - b_t) sum_{i<=t} score_i, (P, K).

    Each step has its own baseline of least variance, b[t, p, k] = E[C_tp^2 g^t phi_tk] / E[C_tp^2]
    with C_t = sum_{i<=t} score_i; its bias is of order 1/n.

    Args:
        episodes: n episodes.
        discount: gamma.
        has_baseline: Whether the baselines are subtracted.
    """
    C = np.cumsum(episodes.scores, axis=1)
    D = discount ** np.arange(C.shape[1])[None, :, None] * episodes.features
    by_step = np.einsum("ntp,ntk->tpk", C, D, optimize=True)
    if has_baseline:
        square = (C**2).sum(axis=0)[:, :, None]
        b = np.einsum("ntp,ntk->tpk", C**2, D, optimize=True)
        b = np.divide(b, square, out=np.zeros_like(b), where=square > 0)
        by_step = by_step - C.sum(axis=0)[:, :, None] * b
    gradient: Array = by_step.sum(axis=0) / len(C)
    return gradient
