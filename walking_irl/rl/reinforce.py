"""REINFORCE: policy gradients from whole returns (R. Williams 1992), for all features at once."""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.rl.episodes import Episodes


def reinforce(episodes: Episodes, discount: float, *, has_baseline: bool = True) -> Array:
    """Estimate of d mu / d theta: mean over episodes of (sum_t score_t) (R_k - b), shape (P, K).

    The baseline b[p, k] = E[S_p^2 R_k] / E[S_p^2], S = sum_t score_t, is the one of least variance
    for each parameter (Peters & Schaal 2008, table 1); estimated from the same episodes it has a
    bias of order 1/n. Leave it out only to measure what it is worth.

    Args:
        episodes: n episodes.
        discount: gamma.
        has_baseline: Whether the baseline is subtracted.
    """
    g = discount ** np.arange(episodes.features.shape[1])
    R = np.einsum("t,ntk->nk", g, episodes.features)
    S = episodes.scores.sum(axis=1)
    gradient: Array = S.T @ R / len(R)
    if has_baseline:
        square = (S**2).sum(axis=0)[:, None]
        b = np.divide((S**2).T @ R, square, out=np.zeros_like(gradient), where=square > 0)
        gradient = gradient - S.mean(axis=0)[:, None] * b
    return gradient
