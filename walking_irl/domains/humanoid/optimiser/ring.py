"""The ring of knots: windows of four, and the order in which the ring is a band.

The knots form a ring (the last is coupled to the mirror image of the first). Taken from both ends,
0, N-1, 1, N-2, ..., it becomes an ordinary band that LAPACK factors.
"""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array, Indices


class Windows:
    """Which knots the window of a step holds, and how those beyond the half cycle map back.

    Attributes:
        knot: Of each step i the knots i - 1 ... i + 2, shape (N, 4).
        wrap: How often each of them lies a half cycle ahead (1) or behind (-1), shape (N, 4).
        beyond: Pairs (step, place in its window) with a wrap.
    """

    def __init__(self, n: int) -> None:
        around = np.arange(n)[:, None] + np.arange(-1, 3)
        self.knot: Indices = around % n
        self.wrap = (around >= n).astype(int) - (around < 0)
        self.beyond = list(zip(*np.nonzero(self.wrap), strict=True))


class KnotOrder:
    """Order of the knots in which the ring is a band, and where blocks go in LAPACK's storage."""

    def __init__(self, n: int, nv: int) -> None:
        self.windows = Windows(n)
        order = [k for pair in zip(range(n), range(n - 1, -1, -1), strict=True) for k in pair][:n]
        place = np.empty(n, dtype=int)
        place[order] = np.arange(n)
        self.permutation: Indices = (np.array(order)[:, None] * nv + np.arange(nv)).ravel()
        at = place[self.windows.knot]  # (N, 4)
        step, row, column = np.nonzero(at[:, :, None] >= at[:, None, :])
        self.blocks = (step, row, column)
        r = at[step, row][:, None, None] * nv + np.arange(nv)[:, None]
        c = at[step, column][:, None, None] * nv + np.arange(nv)
        r, c = np.broadcast_arrays(r, c)
        self.bandwidth = int(np.max(r - c))
        self.size = n * nv
        outside = (self.bandwidth + 1) * self.size
        self.target = np.where(r >= c, (r - c) * self.size + c, outside).ravel()

    def band(self, windows: Array) -> Array:
        """Lower band (bandwidth + 1, N nv) of a sum of window matrices (N, 4, nv, 4, nv)."""
        step, row, column = self.blocks
        values = windows.transpose(0, 1, 3, 2, 4)[step, row, column]
        length = (self.bandwidth + 1) * self.size
        flat = np.bincount(self.target, weights=values.ravel(), minlength=length + 1)[:length]
        return np.asarray(flat.reshape(self.bandwidth + 1, self.size), dtype=np.float64)
