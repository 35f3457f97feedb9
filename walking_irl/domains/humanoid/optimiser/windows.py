r"""From coordinates (q, v, a) of every knot to the knots themselves.

The motion at knot k depends on its window, the knots k - 1, k, k + 1, and on the half period T:

.. math:: v_k = (q_k - q_{k-1}) / h, \quad a_k = (q_{k+1} - 2 q_k + q_{k-1}) / h^2, \quad h = T/N

Beyond the half cycle the window holds mirror images S q, one step length L ahead or behind.
"""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.optimiser.ring import REACH

BEFORE, HERE, AFTER = range(3)


class Windows:
    """The linear map of one gait from windows and T to the coordinates of its knots.

    Args:
        v: Velocities, shape (N, nv).
        a: Accelerations, shape (N, nv).
        h: Duration of a step [s].
        mirror: S, shape (nv, nv).
    """

    def __init__(self, v: Array, a: Array, h: float, mirror: Array) -> None:
        self.n, self.nv = v.shape
        self.mirror = mirror
        self.rate, self.square = 1 / h, 1 / h**2
        self.T = h * self.n
        self.by_T = np.concatenate([np.zeros_like(v), v / -self.T, a * (-2 / self.T)], -1)

    def split(self, u: Array) -> tuple[Array, Array, Array]:
        """Parts q, v, a of the last axis."""
        nv = self.nv
        return u[..., :nv], u[..., nv : 2 * nv], u[..., 2 * nv :]

    def rows(self, u: Array) -> Array:
        """Rows by (q, v, a), (..., 3 nv), as rows by the windows' knots, (..., 3, nv)."""
        q, v, a = self.split(u)
        out = np.empty((*u.shape[:-1], 3, self.nv))
        before, here, after = (out[..., b, :] for b in range(3))
        np.multiply(a, self.square, out=after)
        np.multiply(v, self.rate, out=here)
        np.subtract(after, here, out=before)
        here += q
        here -= 2 * after
        return out

    def global_rows(self, u: Array) -> tuple[Array, Array]:
        """The same, (N, m, 3, nv), with mirror images mapped back; and by L and T, (N, m, 2)."""
        out, ends = self.rows(u), np.zeros((*u.shape[:-1], 2))
        ends[..., 1] = (u @ self.by_T[..., None])[..., 0]
        first, last = out[0, :, BEFORE], out[-1, :, AFTER]
        ends[0, :, 0] -= first[:, 0]
        ends[-1, :, 0] += last[:, 0]
        out[0, :, BEFORE], out[-1, :, AFTER] = first @ self.mirror, last @ self.mirror
        return out, ends

    def congruence(self, K: Array) -> Array:
        """Symmetric matrices of the coordinates, (N, 3 nv, 3 nv), on the windows' knots.

        Returns:
            Blocks (before, before), (here, here), (after, after), (before, here), (here, after),
            (before, after): shape (6, N, nv, nv).
        """
        r, s, nv = self.rate, self.square, self.nv
        q, v, a = self.split(K)  # columns
        after = s * a
        here = q + r * v - 2 * after
        before = after[:, nv:] - r * v[:, nv:]
        out = np.empty((6, self.n, nv, nv))
        out[0] = s * before[:, nv:] - r * before[:, :nv]
        out[1] = here[:, :nv] + r * here[:, nv : 2 * nv] - 2 * s * here[:, 2 * nv :]
        out[2] = s * after[:, 2 * nv :]
        out[3] = s * here[:, 2 * nv :] - r * here[:, nv : 2 * nv]
        out[4] = after[:, :nv] + r * after[:, nv : 2 * nv] - 2 * out[2]
        out[5] = out[2] - r * after[:, nv : 2 * nv]
        return out


class Assembly:
    """A symmetric matrix of all knots, L and T under construction.

    Attributes:
        blocks: Of knots k and k + d, shape (REACH, N, nv, nv).
        border: Columns L and T of the knots, shape (N, nv, 2).
        corner: Shape (2, 2).
    """

    def __init__(self, windows: Windows) -> None:
        n, nv = windows.n, windows.nv
        self.windows = windows
        self.blocks = np.zeros((REACH, n, nv, nv))
        self.border = np.zeros((n, nv, 2))
        self.corner = np.zeros((2, 2))

    def add_own(self, K: Array) -> None:
        """Add symmetric matrices of each knot's coordinates, (N, 3 nv, 3 nv)."""
        S, n = self.windows.mirror, self.windows.n
        bb, hh, aa, bh, ha, ba = self.windows.congruence(K)
        length = self.border[..., 0]
        length[n - 1] -= S.T @ bb[0, :, 0]
        length[0] -= bh[0, 0]
        length[1] -= ba[0, 0]
        length[n - 2] += ba[-1, :, 0]
        length[n - 1] += ha[-1, :, 0]
        length[0] += S.T @ aa[-1, :, 0]
        self.corner[0, 0] += bb[0, 0, 0] + aa[-1, 0, 0]
        bb[0], bh[0], ba[0] = S.T @ bb[0] @ S, S.T @ bh[0], S.T @ ba[0]
        aa[-1], ha[-1], ba[-1] = S.T @ aa[-1] @ S, ha[-1] @ S, ba[-1] @ S
        parts = [(0, -1, bb), (0, 0, hh), (0, 1, aa), (1, -1, bh), (1, 0, ha), (2, -1, ba)]
        for d, shift, x in parts:
            add_shifted(self.blocks[d], shift, x)

    def add_own_column(self, column: Array, which: int) -> None:
        """Add the column of L (0) or T (1) of each knot's coordinates, (N, 3 nv), and its row."""
        rows, ends = self.windows.global_rows(column[:, None])
        for b in range(3):
            add_shifted(self.border[..., which], b - 1, rows[:, 0, b])
        self.corner[0, which] += ends[:, 0, 0].sum()
        self.corner[which, 0] += ends[:, 0, 0].sum()

    def add_ahead(self, left: Array, middle: Array, right: Array) -> None:
        """Add left' middle right + its transpose.

        Args:
            left: Rows of the knots' coordinates, shape (N, m, 3 nv).
            middle: Shape (N, m, m').
            right: Rows of the *next* knots' coordinates, by the knot itself, shape (N, m', 3 nv).
        """
        n, nv = self.windows.n, self.windows.nv
        (rows, row_ends), (columns, column_ends) = map(self.windows.global_rows, (left, right))
        flat = np.concatenate([columns.reshape(n, -1, 3 * nv), column_ends], -1)
        scaled = middle @ np.concatenate([flat[1:], flat[:1]])
        X = rows.reshape(n, -1, 3 * nv).mT @ scaled
        ends = row_ends.mT @ scaled  # (N, 2, 3 nv + 2)
        for b in range(3):
            at = slice(b * nv, (b + 1) * nv)
            for c in range(3):
                d, x = c + 1 - b, X[:, at, c * nv : (c + 1) * nv]
                if d <= 0:
                    add_shifted(self.blocks[-d], c, x.mT)
                if d >= 0:
                    add_shifted(self.blocks[d], b - 1, x)
            add_shifted(self.border, b - 1, X[:, at, 3 * nv :])
            add_shifted(self.border, b, ends[:, :, at].mT)
        corner = ends[..., 3 * nv :].sum(0)
        self.corner += corner + corner.T


def add_shifted(to: Array, shift: int, x: Array) -> None:
    """``to[(k + shift) % N] += x[k]``."""
    if shift == 0:
        to += x
    else:
        to[shift:] += x[:-shift]
        to[:shift] += x[-shift:]
