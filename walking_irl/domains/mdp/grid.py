"""Moves on a square grid whose actions are not always obeyed."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from walking_irl.arrays import Array, Indices


def grid_transitions(size: int, moves: Indices, obeyed: Array) -> sparse.csr_array:
    """Transitions of ``size`` x ``size`` cells; a step off the grid stays where it is.

    Args:
        size: Cells along a side; the state of cell (row, column) is ``row * size + column``.
        moves: (row, column) step of each action, shape (A, 2).
        obeyed: Probability that action i moves like action j, shape (A, A).

    Returns:
        Sparse matrix of shape (A * S, S), S = size^2, ordered as in :class:`FiniteMDP`.
    """
    S, A = size**2, len(moves)
    place = np.stack(np.divmod(np.arange(S), size), axis=1)
    target = np.clip(place + moves[:, None], 0, size - 1) @ np.array([size, 1])  # (A, S)
    rows = np.tile(np.arange(S), A)
    blocks = [
        sparse.csr_array((np.repeat(p, S), (rows, target.ravel())), shape=(S, S)) for p in obeyed
    ]
    return sparse.vstack(blocks).tocsr()
