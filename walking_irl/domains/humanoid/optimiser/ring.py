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
    """Order of the knots in which the ring is a band, and where blocks go in LAPACK's storage.

    Stored column by column, the lower band is an ordinary matrix whose columns are one number
    shorter than the storage's: a block is a strided view of it, and so are the blocks of knots that
    follow one another at an equal distance.
    """

    def __init__(self, n: int, nv: int) -> None:
        if n < 2 * REACH:
            raise InvalidInputError(f"a gait needs at least {2 * REACH} knots, got {n}")
        self.n, self.nv, self.size = n, nv, n * nv
        order = [k for pair in zip(range(n), range(n - 1, -1, -1), strict=True) for k in pair][:n]
        place = np.empty(n, dtype=int)
        place[order] = np.arange(n)
        self.permutation: Indices = (np.array(order)[:, None] * nv + np.arange(nv)).ravel()
        ahead = place[(np.arange(n) + np.arange(REACH)[:, None]) % n]  # (REACH, N)
        self.bandwidth = int(np.abs(ahead - place).max() + 1) * nv - 1
        self._kept = np.triu(np.ones((nv, nv)))  # of a symmetric block, else beyond the band
        self._runs = [run for d in range(REACH) for run in _runs(d, place, ahead[d])]

    def band(self, blocks: Array) -> Array:
        """Lower band (bandwidth + 1, N nv) of blocks (REACH, N, nv, nv).

        ``blocks[d, k]`` couples the knots k (rows) and k + d (columns).
        """
        nv, length = self.nv, self.bandwidth
        flat = np.zeros(self.size * (length + 1))
        for run in self._runs:
            x = blocks[run.d, run.knots]
            if run.d == 0:
                x = x * self._kept
            corner = nv * (min(run.row, run.column) * length + max(run.row, run.column))
            inner = (length, 1) if run.row <= run.column else (1, length)
            strides = np.array([run.step * nv * (length + 1), *inner]) * flat.itemsize
            np.lib.stride_tricks.as_strided(flat[corner:], x.shape, strides)[:] = x
        return flat.reshape(self.size, length + 1).T


class _Run(NamedTuple):
    """Blocks of knots at equal distances in the band, d knots apart from their columns'."""

    d: int
    knots: slice
    row: int
    """Place of the first knot, and of the knot d ahead of it."""
    column: int
    step: int
    """How many places further the next ones are, both alike."""


def _runs(d: int, place: Indices, ahead: Indices) -> list[_Run]:
    """Blocks ``d`` knots apart, by places of the knots and of those ahead."""
    moves = list(zip(np.diff(place).tolist(), np.diff(ahead).tolist(), strict=True))
    runs, first, n = [], 0, len(place)
    while first < n:
        last, step = first, 0
        while last < n - 1 and moves[last][0] == moves[last][1] and step in (0, moves[last][0]):
            step, last = moves[last][0], last + 1
        runs.append(_Run(d, slice(first, last + 1), int(place[first]), int(ahead[first]), step))
        first = last + 1
    return runs


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
