"""A symmetric matrix on the ring of knots: blocks of neighbours, a border, and its factor.

The knots form a ring (the last is coupled to the mirror image of the first). Taken from both ends,
0, N-1, 1, N-2, ..., it becomes an ordinary band that LAPACK factors; step length and half period
stay as a border of two columns (a bordered system by the Schur complement).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import lapack

from walking_irl.arrays import Array, Indices
from walking_irl.errors import InvalidInputError

REACH = 4
"""Knots whose mutual distance is below this are coupled."""


class Ring:
    """Order of the knots in which the ring is a band, and where blocks go in LAPACK's storage."""

    def __init__(self, n: int, nv: int) -> None:
        if n < 2 * REACH:
            raise InvalidInputError(f"a gait needs at least {2 * REACH} knots, got {n}")
        self.n, self.nv, self.size = n, nv, n * nv
        order = [k for pair in zip(range(n), range(n - 1, -1, -1), strict=True) for k in pair][:n]
        place = np.empty(n, dtype=int)
        place[order] = np.arange(n)
        self.permutation: Indices = (np.array(order)[:, None] * nv + np.arange(nv)).ravel()
        d, k = np.divmod(np.arange(REACH * n), n)
        row, column = (place[x][:, None, None] * nv for x in (k, (k + d) % n))
        i, j = np.arange(nv)[:, None], np.arange(nv)
        r, c = np.broadcast_arrays(row + i, column + j)
        kept = (r >= c) | (d > 0)[:, None, None]
        low, high = np.minimum(r, c)[kept], np.maximum(r, c)[kept]
        self.bandwidth = int(np.max(high - low))
        self._target: Indices = low * (self.bandwidth + 1) + high - low
        self._source: Indices = np.flatnonzero(kept)

    def band(self, blocks: Array) -> Array:
        """Lower band (bandwidth + 1, N nv) of blocks (REACH, N, nv, nv).

        ``blocks[d, k]`` couples the knots k (rows) and k + d (columns).
        """
        flat = np.zeros(self.size * (self.bandwidth + 1))
        flat[self._target] = blocks.reshape(-1)[self._source]
        return flat.reshape(self.size, self.bandwidth + 1).T


class BorderedMatrix(NamedTuple):
    """A symmetric matrix in the ring's order: band, border (N nv, 2) of L and T, corner (2, 2)."""

    band: Array
    border: Array
    corner: Array
    permutation: Indices

    def blend(self, other: BorderedMatrix, share: float) -> BorderedMatrix:
        """This matrix plus ``share`` of the difference to another."""
        return BorderedMatrix(
            self.band + share * (other.band - self.band),
            self.border + share * (other.border - self.border),
            self.corner + share * (other.corner - self.corner),
            self.permutation,
        )

    def factor(self, damping: float, tether: Array | None = None) -> Factor:
        """Cholesky factor of the matrix plus ``damping`` and ``tether`` on its diagonal.

        Args:
            damping: Added everywhere.
            tether: Added to each unknown, shape (N nv + 2,).

        Raises:
            np.linalg.LinAlgError: If it is not positive definite.
        """
        band = self.band.copy(order="F")
        band[0] += damping
        corner = self.corner + damping * np.eye(2)
        if tether is not None:
            band[0] += tether[:-2][self.permutation]
            corner = corner + np.diag(tether[-2:])
        chol, failed = lapack.dpbtrf(band, lower=1, overwrite_ab=1)
        if failed:
            raise np.linalg.LinAlgError("the band is not positive definite")
        z, _ = lapack.dpbtrs(chol, self.border, lower=1)
        corner = corner - self.border.T @ z
        if not (corner[0, 0] > 0 and np.linalg.det(corner) > 0):
            raise np.linalg.LinAlgError("step length and half period leave it indefinite")
        return Factor(chol, z, self.border, np.linalg.inv(corner), self.permutation)


class Factor(NamedTuple):
    """Solves systems with a factored :class:`BorderedMatrix`."""

    chol: Array
    z: Array
    border: Array
    corner: Array
    permutation: Indices

    def solve(self, rhs: Array) -> Array:
        """Solution for a right-hand side in natural order, shape (N nv + 2,) or (N nv + 2, m)."""
        y, _ = lapack.dpbtrs(self.chol, rhs[:-2][self.permutation], lower=1)
        ends = self.corner @ (rhs[-2:] - self.border.T @ y)
        out = np.empty_like(rhs)
        out[:-2][self.permutation] = y - self.z @ ends
        out[-2:] = ends
        return out
