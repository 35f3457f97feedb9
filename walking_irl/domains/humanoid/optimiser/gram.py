r"""The Gauss-Newton matrix of every step, on its window of four knots and T.

Costs whose residuals read one joint each (effort, work, smoothness, limits) are summed as a Gram
matrix of that joint's channels. Torques depend on all joints; eliminating them from the Gram matrix
(completing the square) leaves one dense row a torque and a 4 x 4 matrix a joint, however many costs
there are. All others are one dense row a residual.
"""

from __future__ import annotations

import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.domains.humanoid.costs.base import Read
from walking_irl.domains.humanoid.costs.stack import Place
from walking_irl.domains.humanoid.optimiser.linearisation import Linearisation, Weighted

JOINT_CHANNELS = ("tau_next", "tau", "q", "v", "v_next", "a", "h")
"""In the order of elimination: torques first, the wider window before the narrower."""
N_TORQUES = 2
TINY = 1e-300


def window_matrices(at: Weighted) -> Array:
    """J'J of every step without the per-metre rank-one terms, shape (N, 4 nv + 1, 4 nv + 1)."""
    lin = at.lin
    n, nv = lin.problem.n_knots, lin.problem.nv
    gram = _joint_gram(at)
    narrow = [lin.rows[:, : lin.problem.walker.n_root] * at.factors.root]
    wide: list[Array] = []
    for k in range(N_TORQUES):
        if np.any(gram[k, k]):
            (wide if k == 0 else narrow).append(_eliminate(lin, gram, k))
    for place, block in zip(lin.stack.places, lin.partials.blocks, strict=True):
        if place.joints is None and place.term.reads:
            rows = _rows(lin, place, block) * at.factors.costs[place.columns, None]
            (wide if rows.shape[2] > 3 * nv + 1 else narrow).append(rows)
    if wide:
        rows = np.concatenate(wide, axis=1)
        h = np.matmul(np.swapaxes(rows, 1, 2), rows)
    else:
        h = np.zeros((n, 4 * nv + 1, 4 * nv + 1))
    rows = np.concatenate(narrow, axis=1)
    _add_narrow(h, np.matmul(np.swapaxes(rows, 1, 2), rows), nv)
    _add_joints(h, lin, gram[N_TORQUES:, N_TORQUES:])
    left, right = lin.problem.nv + lin.chain.feet
    align = (lin.rows[n // 2, left] - lin.rows[n // 2, right]) * at.factors.anchors[1]
    _add_narrow(h[n // 2][None], np.outer(align, align)[None], nv)
    return np.asarray(h)


def _add_narrow(h: Array, h3: Array, nv: int) -> None:
    """Add matrices on three knots and T to those on four."""
    h[:, : 3 * nv, : 3 * nv] += h3[:, :-1, :-1]
    h[:, : 3 * nv, -1] += h3[:, :-1, -1]
    h[:, -1, : 3 * nv] += h3[:, -1, :-1]
    h[:, -1, -1] += h3[:, -1, -1]


def _joint_gram(at: Weighted) -> Array:
    """Sums of squares of the joint-wise residuals by JOINT_CHANNELS, shape (7, 7, N, nu)."""
    lin = at.lin
    k = len(JOINT_CHANNELS)
    gram = np.zeros((k, k, lin.problem.n_knots, lin.problem.walker.model.nu))
    for place, block in zip(lin.stack.places, lin.partials.blocks, strict=True):
        if place.joints is None:
            continue
        square = at.factors.costs[place.columns] ** 2
        is_each = np.array_equal(place.joints, np.arange(gram.shape[3]))
        at_channel = [JOINT_CHANNELS.index(r.channel) for r in place.term.reads]
        for p, c in enumerate(at_channel):
            scaled = square * block[p]
            for o, d in enumerate(at_channel):
                if is_each:
                    gram[c, d] += scaled * block[o]
                else:
                    np.add.at(gram[c, d].T, place.joints, (scaled * block[o]).T)
    return gram


def _eliminate(lin: Linearisation, gram: Array, k: int) -> Array:
    """Dense rows of a torque channel with their squares taken out of the Gram matrix.

    The Gram matrix is alpha^2 (d tau + sum c d channel)^2 + rest; the rows are the first part.
    """
    walker, nv = lin.problem.walker, lin.problem.nv
    torque = lin.rows[:, walker.n_root : nv]
    rows = torque.copy() if k == 1 else ahead(lin, torque, walker.torque_mirror)
    square = gram[k, k].copy()
    slope = gram[k] / (square + TINY)
    for c in range(k + 1, len(JOINT_CHANNELS)):
        if not np.any(slope[c]):
            continue
        if c < N_TORQUES:
            rows[..., : 3 * nv] += slope[c][..., None] * torque[..., :-1]
            rows[..., -1] += slope[c] * torque[..., -1]
        else:
            add_joint(rows, lin, JOINT_CHANNELS[c], lin.problem.motors, slope[c])
        for d in range(k + 1, len(JOINT_CHANNELS)):
            gram[c, d] -= square * slope[c] * slope[d]
    return np.asarray(rows * np.sqrt(square)[..., None])


def _add_joints(h: Array, lin: Linearisation, gram: Array) -> None:
    """Add what elimination leaves: a matrix of the joint at i - 1, i, i + 1 and T."""
    nv, joint = lin.problem.nv, lin.problem.motors
    used = [c for c in range(len(gram)) if np.any(gram[c, c])]
    if not used:
        return
    local = np.stack([lin.local(JOINT_CHANNELS[N_TORQUES + c])[:, joint] for c in used], axis=2)
    half = np.moveaxis(gram[np.ix_(used, used)], (0, 1), (2, 3)) @ local
    small = np.swapaxes(local, 2, 3) @ half
    at = [b * nv + joint for b in range(3)]
    for b in range(3):
        for c in range(3):
            h[:, at[b], at[c]] += small[:, :, b, c]
        h[:, at[b], -1] += small[:, :, b, 3]
        h[:, -1, at[b]] += small[:, :, b, 3]
    h[:, -1, -1] += small[:, :, 3, 3].sum(1)


def _rows(lin: Linearisation, place: Place, block: Array) -> Array:
    """Unweighted rows of a term on three knots and T, or on four; (N, M, 3 nv + 1 or 4 nv + 1)."""
    nv, n = lin.problem.nv, lin.problem.n_knots
    wide = [_is_wide(lin, r.channel, r.columns) for r in place.term.reads]
    out = np.zeros((n, block.shape[2], (4 if any(wide) else 3) * nv + 1))
    for read, slope, is_wide in zip(place.term.reads, block, wide, strict=True):
        if read.channel == "h":
            out[..., -1] += slope / n
        elif read.channel in ("q", "v", "v_next", "a"):
            add_joint(out, lin, read.channel, read.columns, slope)
        else:
            rows = _dense(lin, read)
            kept = 4 * nv if is_wide else 3 * nv
            out[..., :kept] += slope[..., None] * rows[..., :kept]
            out[..., -1] += slope * rows[..., -1]
    return out


def _dense(lin: Linearisation, read: Read) -> Array:
    """Rows of torques or sensors, of this step or of the next one."""
    walker, nv = lin.problem.walker, lin.problem.nv
    if read.channel.startswith("tau"):
        first, used, mirror = walker.n_root, np.arange(walker.model.nu), walker.torque_mirror
    else:
        first, used, mirror = nv, lin.chain.sensors, walker.sensor_mirror
    columns = np.searchsorted(used, read.columns)
    if not read.channel.endswith("_next"):
        return np.asarray(lin.rows[:, first + columns])
    rows = lin.rows[:, first : first + len(used)]
    return ahead(lin, rows, mirror[np.ix_(read.columns, used)], columns)


def _is_wide(lin: Linearisation, channel: str, columns: Indices) -> bool:
    """Whether a read depends on knot i + 2; the next position of a point does not."""
    if not channel.endswith("_next") or channel == "v_next":
        return False
    return channel == "tau_next" or not lin.problem.walker.reads_position[columns].all()


def ahead(lin: Linearisation, rows: Array, mirror: Array, columns: Indices | None = None) -> Array:
    """Rows of the next step: of torques or sensors on knots i, i + 1, i + 2 and T.

    Args:
        lin: The linearisation.
        rows: Of this step, shape (N, m, 3 nv + 1).
        mirror: Maps all m to those that are kept, in the mirror image; shape (kept, m).
        columns: Which are kept; None: all.

    Returns:
        Shape (N, kept, 4 nv + 1).
    """
    nv, swap = lin.problem.nv, lin.problem.walker.mirror
    kept = rows if columns is None else rows[:, columns]
    last = mirror @ rows[0]
    for b in range(3):
        last[:, b * nv : (b + 1) * nv] = last[:, b * nv : (b + 1) * nv] @ swap
    out = np.zeros((len(rows), kept.shape[1], 4 * nv + 1))
    out[:-1, :, nv:], out[-1, :, nv:] = kept[1:], last
    return out


def add_joint(rows: Array, lin: Linearisation, channel: str, joints: Indices, slope: Array) -> None:
    """Add ``slope`` (N, M) times the derivatives of q, v, v_next, a or h of joints to rows."""
    nv, k = lin.problem.nv, np.arange(len(joints))
    local = lin.local(channel)[:, joints]
    for b in range(3):
        rows[:, k, b * nv + joints] += slope * local[..., b]
    rows[..., -1] += slope * local[..., 3]
