r"""Gauss-Newton matrix of a gait: cyclic block band with a two-column border.

The knots form a ring (the last is coupled to the mirror image of the first). Folding the ring,
0, N-1, 1, N-2, ..., turns it into an ordinary band that LAPACK factors; step length and half period
stay as a border (a bordered system by the Schur complement).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import lapack

from walking_irl.arrays import Array, Indices
from walking_irl.domains.humanoid.optimiser.linearisation import (
    PER_METRE,
    Linearisation,
    Windows,
    factors,
    weighted,
)


class Fold:
    """Order of the knots in which the ring is a band, and where blocks go in LAPACK's storage."""

    def __init__(self, n: int, nv: int, windows: Windows) -> None:
        order = [k for pair in zip(range(n), range(n - 1, -1, -1), strict=True) for k in pair][:n]
        place = np.empty(n, dtype=int)
        place[order] = np.arange(n)
        self.permutation: Indices = (np.array(order)[:, None] * nv + np.arange(nv)).ravel()
        at = place[windows.knot]  # (N, 4)
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


class NormalMatrix(NamedTuple):
    """Half the Gauss-Newton Hessian of w.G in folded order: band, border (N nv, 2), corner."""

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


def normal_matrix(lin: Linearisation, fold: Fold, w: Array, penalty: float) -> NormalMatrix:
    """Half the Gauss-Newton Hessian of the total cost at weights ``w``."""
    p = lin.problem
    n, nv = p.n_knots, p.nv
    width = 4 * nv + 1
    h = np.zeros((n, width, width))
    rows = _weighted_rows(lin, w, penalty)
    impact = lin.impact * factors(lin.evaluation, w, penalty).impact
    np.matmul(np.swapaxes(impact, 1, 2), impact, out=h)
    h3 = np.matmul(np.swapaxes(rows, 1, 2), rows)
    h[:, : 3 * nv, : 3 * nv] += h3[:, :-1, :-1]
    h[:, : 3 * nv, -1] += h3[:, :-1, -1]
    h[:, -1, : 3 * nv] += h3[:, -1, :-1]
    h[:, -1, -1] += h3[:, -1, -1]
    small = _joint_blocks(lin, w, penalty)
    joint = [b * nv + p.at.joints for b in range(3)]
    for b in range(3):
        for c in range(3):
            h[:, joint[b], joint[c]] += small[:, :, b, c]
        h[:, joint[b], -1] += small[:, :, b, 3]
        h[:, -1, joint[b]] += small[:, :, b, 3]
    h[:, -1, -1] += small[:, :, 3, 3].sum(1)
    return _globalise(lin, fold, h, w, penalty)


def _weighted_rows(lin: Linearisation, w: Array, penalty: float) -> Array:
    """Rows of all but the joint-wise terms and the impact.

    One row per torque carries the effort and, by completing the square, both powers.
    """
    f = factors(lin.evaluation, w, penalty)
    root, tau, stability, skid, gap, align = lin.part
    rows = lin.rows.copy()
    square, c_v, c_next = _completed_square(lin, w, penalty)
    joint, nv = lin.problem.at.joints, lin.problem.nv
    add = c_v[..., None] * lin.velocity + c_next[..., None] * lin.velocity_next
    k = tau.start + np.arange(len(joint))
    for b in range(3):
        rows[:, k, b * nv + joint] += add[..., b]
    rows[:, tau, -1] += add[..., 3]
    rows[:, tau] *= np.sqrt(square)[..., None]
    rows[:, root] *= f.root
    rows[:, stability] *= f.stability
    rows[:, skid] *= f.skid
    rows[:, gap] *= f.gap
    rows[:, align] *= f.gauge[1]
    return rows


def _completed_square(lin: Linearisation, w: Array, penalty: float) -> tuple[Array, Array, Array]:
    """alpha^2 and c with sum of squares = alpha^2 (dtau + c_v dv + c_next dv_next)^2 + rest."""
    f, j = factors(lin.evaluation, w, penalty), lin.joints
    work = f.work**2
    square = (f.effort * j.effort_tau) ** 2 + work * (j.work_tau**2 + j.end_tau**2) + 1e-300
    return square, work * j.work_tau * j.work_v / square, work * j.end_tau * j.end_v / square


def _joint_blocks(lin: Linearisation, w: Array, penalty: float) -> Array:
    """Joint-wise part (N, nu, 4, 4) with respect to the joint at i - 1, i, i + 1 and T."""
    f, j = factors(lin.evaluation, w, penalty), lin.joints
    square, c_v, c_next = _completed_square(lin, w, penalty)
    work = f.work**2
    v, v_next, a = lin.velocity, lin.velocity_next, lin.acceleration * f.smooth

    def outer(x: Array, y: Array) -> Array:
        return np.asarray(x[..., :, None] * y[..., None, :])

    cross = (-square * c_v * c_next)[..., None, None] * outer(v, v_next)
    out = (
        (work * j.work_v**2 - square * c_v**2)[..., None, None] * outer(v, v)
        + (work * j.end_v**2 - square * c_next**2)[..., None, None] * outer(v_next, v_next)
        + cross
        + np.swapaxes(cross, -1, -2)
        + outer(a, a)
    )
    out[..., 1, 1] += f.limits**2 * (lin.evaluation.residuals.limits != 0)
    return out


def _globalise(lin: Linearisation, fold: Fold, h: Array, w: Array, penalty: float) -> NormalMatrix:
    """Map window matrices back to the knots of the half cycle and add the border."""
    p, ev = lin.problem, lin.evaluation
    n, nv = p.n_knots, p.nv
    mirror, windows = p.walker.mirror, lin.windows
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
    band = fold.band(h[:, :-1, :-1].reshape(n, 4, nv, 4, nv))
    border = np.zeros((n, nv, 2))
    np.add.at(border[..., 0], windows.knot, border_l.reshape(n, 4, nv))
    np.add.at(border[..., 1], windows.knot, h[:, :-1, -1].reshape(n, 4, nv))
    flat = border.reshape(-1, 2)
    g, u = _per_metre_gradient(lin, w, penalty), lin.log_scale
    r = weighted(ev, w, penalty)
    square = sum(float(np.vdot(t, t)) for t in r[:PER_METRE])
    flat = flat + np.outer(g[:-2], u)
    corner += np.outer(g[-2:], u) + np.outer(u, g[-2:]) + square * np.outer(u, u)
    f = factors(ev, w, penalty)
    corner[1, 1] += f.gauge[2] ** 2 * (ev.gauge[2] != 0)
    band[0, 0] += f.gauge[0] ** 2  # knot 0 comes first in the folded order too
    return NormalMatrix(band, flat[fold.permutation], corner, fold.permutation)


def _per_metre_gradient(lin: Linearisation, w: Array, penalty: float) -> Array:
    """Half the gradient of the costs per metre at a fixed per-metre factor."""
    r = weighted(lin.evaluation, w, penalty)
    only = [t if k < PER_METRE else np.zeros_like(t) for k, t in enumerate(r)]
    return lin.pull_back(type(r)(*only), w, penalty)
