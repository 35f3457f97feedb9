r"""Gauss-Newton matrix of a gait: cyclic block band with a two-column border.

In the order of :class:`~.optimiser.ring.KnotOrder` the knots form a band; step length and half
period stay as a border (a bordered system by the Schur complement).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import lapack

from walking_irl.arrays import Array, Indices
from walking_irl.domains.humanoid.optimiser.gram import window_matrices
from walking_irl.domains.humanoid.optimiser.linearisation import Weighted
from walking_irl.domains.humanoid.optimiser.ring import KnotOrder


class NormalMatrix(NamedTuple):
    """Half the Hessian of w.G in the knots' order: band, border (N nv, 2), corner (2, 2)."""

    band: Array
    border: Array
    corner: Array
    permutation: Indices

    def factor(self, damping: float, tether: Array | None = None) -> Factor:
        """Cholesky factor of the matrix plus ``damping`` and ``tether`` on its diagonal.

        Args:
            damping: Added everywhere.
            tether: Added to each unknown, shape (N nv + 2,).

        Raises:
            np.linalg.LinAlgError: If it is not positive definite.
        """
        more = np.full(self.band.shape[1] + 2, damping) + (0.0 if tether is None else tether)
        band = self.band.copy()
        band[0] += more[:-2][self.permutation]
        chol, failed = lapack.dpbtrf(band, lower=1, overwrite_ab=1)
        if failed:
            raise np.linalg.LinAlgError("normal matrix is not positive definite")
        z, _ = lapack.dpbtrs(chol, self.border, lower=1)
        corner = self.corner + np.diag(more[-2:]) - self.border.T @ z
        return Factor(chol, z, self.border, np.linalg.inv(corner), self.permutation)


class Factor(NamedTuple):
    """Solves systems with a factored :class:`NormalMatrix`."""

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


def normal_matrix(at: Weighted, order: KnotOrder) -> NormalMatrix:
    """Half the Gauss-Newton Hessian of the total cost, J'J."""
    matrix = assemble(at, order, window_matrices(at))
    g, u, corner = at.per_metre_gradient, at.lin.log_scale, matrix.corner
    border = matrix.border + np.outer(g[:-2][order.permutation], u)
    corner += np.outer(g[-2:], u) + np.outer(u, g[-2:]) + at.per_metre_cost * np.outer(u, u)
    f = at.factors.anchors
    corner[1, 1] += f[2] ** 2 * at.lin.is_period_out
    matrix.band[0, 0] += f[0] ** 2  # knot 0 comes first in this order too
    return matrix._replace(border=border)


def assemble(at: Weighted, order: KnotOrder, h: Array) -> NormalMatrix:
    """Sum of window matrices (N, 4 nv + 1, 4 nv + 1), mapped back to the knots of the half cycle.

    The windows at the ends are changed in place.
    """
    p = at.lin.problem
    n, nv = p.n_knots, p.nv
    mirror, windows = p.walker.mirror, order.windows
    corner = np.zeros((2, 2))
    border_l = np.zeros((n, 4 * nv))
    for i in sorted({i for i, _ in windows.beyond}):
        t = np.eye(4 * nv + 1)
        t_l = np.zeros(4 * nv + 1)
        for b in np.nonzero(windows.wrap[i])[0]:
            block = slice(b * nv, (b + 1) * nv)
            t[block, block] = mirror
            t_l[b * nv] = windows.wrap[i, b]
        h_l = h[i] @ t_l
        corner[0, 0] += t_l @ h_l
        h_l = t.T @ h_l
        border_l[i] = h_l[:-1]
        corner[0, 1] += h_l[-1]
        h[i] = t.T @ h[i] @ t
    corner[1, 0] = corner[0, 1]
    corner[1, 1] = h[:, -1, -1].sum()
    band = order.band(h[:, :-1, :-1].reshape(n, 4, nv, 4, nv))
    border = np.zeros((n, nv, 2))
    np.add.at(border[..., 0], windows.knot, border_l.reshape(n, 4, nv))
    np.add.at(border[..., 1], windows.knot, h[:, :-1, -1].reshape(n, 4, nv))
    flat = border.reshape(-1, 2)
    return NormalMatrix(band, flat[order.permutation], corner, order.permutation)
