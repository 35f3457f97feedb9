r"""From coordinates (q, v, a) of every knot to the knots themselves.

The motion at knot k depends on its window, the knots k - 1, k, k + 1, and on the half period T:

.. math:: v_k = (q_k - q_{k-1}) / h, \quad a_k = (q_{k+1} - 2 q_k + q_{k-1}) / h^2, \quad h = T/N

Beyond the half cycle the window holds mirror images S q, one step length L ahead or behind.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.domains.humanoid.optimiser.dynamics.inverse import Curvature
from walking_irl.domains.humanoid.optimiser.ring import REACH


class Columns(NamedTuple):
    """Rows y of all knots, m a knot, sorted by the knots that move them.

    All rows that a knot moves are neighbours in memory, so that the products of a Hessian's block
    are one matrix product.
    """

    by_knot: Array
    """Rows of knot k + 1 - s by knot k, shape (N + 3, slots s, m, nv): mirror images are mapped
    back; the first three knots stand again behind the last one once it is closed."""
    ends: Array
    """By L and T, shape (N, m, 2)."""

    def close(self) -> None:
        """Copy the first knots behind the last one."""
        self.by_knot[-REACH + 1 :] = self.by_knot[: REACH - 1]

    def stack(self, first: int, last: int, shift: int = 0) -> Array:
        """Slots first ... last - 1 of every knot, ``shift`` knots ahead, (N, rows, nv)."""
        n, (_, _, m, nv) = len(self.ends), self.by_knot.shape
        return self.by_knot[shift : n + shift, first:last].reshape(n, (last - first) * m, nv)

    def stacked_ends(self, slots: int) -> Array:
        """Columns of L and T of the rows of :meth:`stack`, shape (N, rows, 2)."""
        e = self.ends
        return np.concatenate([np.roll(e, s - 1, axis=0) for s in range(slots)], axis=1)


class Windows:
    """The linear map of one gait from windows and T to the coordinates of its knots.

    Args:
        v: Velocities, shape (N, nv).
        a: Accelerations, shape (N, nv).
        h: Duration of a step [s].
        mirror: S, shape (nv, nv).

    Attributes:
        by_T: Derivatives of the coordinates q, v, a by T, shape (3, N, nv).
    """

    def __init__(self, v: Array, a: Array, h: float, mirror: Array) -> None:
        self.n, self.nv = v.shape
        self.mirror = mirror
        self.rate, self.square = 1 / h, 1 / h**2
        self.T = h * self.n
        self.by_T = np.stack([np.zeros_like(v), v / -self.T, a * (-2 / self.T)])

    def rows(self, u: Array) -> tuple[Array, Array, Array]:
        """Rows by q, v and a, (3, ..., nv), as rows by the knots before, here and after."""
        q, v, a = u
        after, here = a * self.square, v * self.rate
        before = after - here
        here -= after
        here -= after
        here += q
        return before, here, after

    def columns(self, u: Array, slots: int = 3) -> Columns:
        """Rows by coordinates, (3, N, m, nv), by knots, L and T; not closed yet."""
        _, n, m, nv = u.shape
        before, here, after = self.rows(u)
        out = np.zeros((n + REACH - 1, slots, m, nv))
        out[: n - 1, 0], out[n - 1, 0] = before[1:], before[0] @ self.mirror
        out[:n, 1] = here
        out[1:n, 2], out[0, 2] = after[:-1], after[-1] @ self.mirror
        ends = np.zeros((n, m, 2))
        ends[..., 1] = (u[1:] @ self.by_T[1:, ..., None])[..., 0].sum(0)
        ends[0, :, 0] -= before[0, :, 0]
        ends[-1, :, 0] += after[-1, :, 0]
        return Columns(out, ends)


class Own:
    """Second derivatives by each knot's own coordinates, on the knots of its window.

    Attributes:
        blocks: (before, before), (here, here), (after, after), (before, here), (here, after),
            (before, after): shape (6, N, nv, nv).
        column: Times the derivatives of the coordinates by T, shape (3, N, nv).
    """

    PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))

    def __init__(self, windows: Windows, curvature: Curvature | None = None) -> None:
        self.windows = windows
        shape = (windows.n, windows.nv, windows.nv)
        if curvature is None:
            self.blocks, self.column = np.zeros((6, *shape)), np.zeros((3, *shape[:2]))
            return
        self.column = curvature.times(*windows.by_T[1:])
        self.blocks = np.empty((6, *shape))
        self._bend(*curvature)

    def _bend(self, qq: Array, qv: Array, qa: Array, vv: Array, yy: Array, damping: float) -> None:
        r, s = self.windows.rate, self.windows.square
        by_before, by_here = s - r * damping, r * damping - 2 * s  # of y = a + damping v
        bb, hh, aa, bh, ha, ba = self.blocks
        vv = vv * (r * r)
        np.multiply(yy, by_before * by_before, out=bb)
        bb += vv
        np.multiply(yy, s * s, out=aa)
        np.multiply(yy, by_before * s, out=ba)
        np.multiply(yy, by_here * s, out=ha)
        after = qa * s
        ha += after
        turn = qv * r
        np.subtract(after, turn, out=bh)
        bh[:] = bh.mT
        bh -= vv
        bh += yy * (by_before * by_here)
        turn -= 2 * after
        np.add(turn, turn.mT, out=hh)
        hh += qq
        hh += vv
        hh += yy * (by_here * by_here)

    def add_pairs(self, numbers: Array, j: Indices, k: Indices) -> None:
        """Add second derivatives of few pairs of joints.

        Args:
            numbers: By q, v and a of joint ``j`` and those of ``k``, shape (N, n, 3, 3).
            j: Indices, shape (n,).
            k: The same; each ordered pair once.
        """
        n, count = numbers.shape[:2]
        W = np.stack(self.windows.rows(np.eye(3)[..., None]))[..., 0]  # before, here, after
        both = np.stack([np.outer(W[a], W[b]).ravel() for a, b in self.PAIRS])
        mapped = numbers.reshape(n, count, 9) @ both.T
        self.blocks[:, :, j, k] += np.moveaxis(mapped, -1, 0)
        column = numbers @ self.windows.by_T[:, :, k].transpose(1, 2, 0)[..., None]
        to_joint = (j[:, None] == np.arange(self.windows.nv)).astype(float)
        self.column += column[..., 0].transpose(2, 0, 1) @ to_joint

    def add_row(self, knot: int, row: Array) -> None:
        """Add the square of a row by the coordinates of one knot, shape (3, nv)."""
        window = self.windows.rows(row)
        for block, (a, b) in zip(self.blocks, self.PAIRS, strict=True):
            block[knot] += np.outer(window[a], window[b])
        self.column[:, knot] += row * float(np.vdot(row, self.windows.by_T[:, knot]))


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

    def add_own(self, own: Own) -> None:
        """Add what each knot's own coordinates add, the column of T apart."""
        S, n = self.windows.mirror, self.windows.n
        bb, hh, aa, bh, ha, ba = own.blocks
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
        """Add the column of L (0) or T (1) of each knot's coordinates, (3, N, nv), and its row."""
        before, here, after = self.windows.rows(column)
        length = float(after[-1, 0] - before[0, 0])
        before[0], after[-1] = before[0] @ self.windows.mirror, after[-1] @ self.windows.mirror
        for shift, x in ((-1, before), (0, here), (1, after)):
            add_shifted(self.border[..., which], shift, x)
        self.corner[0, which] += length
        self.corner[which, 0] += length

    def add_still(self, rows: Array, own: Array, ahead: Array) -> None:
        """Add what rows y by q alone add: y' own y, and y' ahead y_next with its transpose.

        Args:
            rows: y, shape (N, m, nv).
            own: Symmetric matrices, shape (N, m, m).
            ahead: Of a knot's rows with those of the next knot, shape (N, m, m).
        """
        self.blocks[0] += rows.mT @ (own @ rows)
        if ahead.any():
            self.blocks[1] += rows.mT @ (ahead @ np.concatenate([rows[1:], rows[:1]]))

    def add_moving(self, left: Columns, right: Columns) -> None:
        """Add left' right and its transpose: of three slots, and of four."""
        for d in range(REACH):
            both, back = min(3, REACH - d), 3 - d
            x = left.stack(0, both).mT @ right.stack(d, d + both, d)
            if d == 0:
                x = x + x.mT
            elif back:
                x += right.stack(0, back).mT @ left.stack(d, d + back, d)
            self.blocks[d] += x
        self.border += left.stack(0, 3).mT @ right.stacked_ends(3)
        self.border += right.stack(0, 4).mT @ left.stacked_ends(4)
        corner = np.tensordot(left.ends, right.ends, ((0, 1), (0, 1)))
        self.corner += corner + corner.T


def add_shifted(to: Array, shift: int, x: Array) -> None:
    """``to[(k + shift) % N] += x[k]``."""
    if shift == 0:
        to += x
    else:
        to[shift:] += x[:-shift]
        to[:shift] += x[-shift:]
