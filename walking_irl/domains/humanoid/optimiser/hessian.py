r"""Half the Hessian of w.G: exact, or Gauss-Newton's.

The half cost is a function of the outputs of every knot (root forces, torques, sensors), of its
coordinates u = (q, v, a), of h and L. With Y the outputs' derivatives by u, C the cost's second
derivatives by slots (:mod:`~.pairs`), and lambda the multipliers (its first derivatives) of the
outputs, every knot contributes

.. math:: K = Y^T C_{yy} Y + Y^T C_{yu} + C_{uy} Y + C_{uu} + \sum_y \lambda_y \nabla^2 y

which :mod:`~.windows` maps onto knots, L and T, with the second derivatives of v and a by T. Costs
per metre carry the factor T/L, a term of rank two. Gauss-Newton's matrix leaves out all second
derivatives: of residuals, outputs, and of the maps.

The multipliers of the root forces may be given apart: far from the optimum rho times the force is
a wild guess of them, and makes the exact Hessian indefinite.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.optimiser.chain import Multipliers, Outputs
from walking_irl.domains.humanoid.optimiser.linearisation import Weighted
from walking_irl.domains.humanoid.optimiser.pairs import Knots, Pairs
from walking_irl.domains.humanoid.optimiser.ring import BorderedMatrix, Ring
from walking_irl.domains.humanoid.optimiser.transcription import Transcription
from walking_irl.domains.humanoid.optimiser.windows import Assembly, Windows


class Structure:
    """What the Hessians of one transcription share: where their numbers go."""

    def __init__(self, problem: Transcription) -> None:
        self.problem = problem
        n, nv, n_root = problem.n_knots, problem.nv, problem.walker.n_root
        static = problem.dynamics.static_sensors[problem.sensors]
        is_static = np.concatenate([np.zeros(nv, bool), static])
        self.knots = Knots(n, nv, n_root, problem.sensors, is_static)
        self.pairs = Pairs(problem.stack, self.knots)
        self.ring = Ring(n, nv)


class _Global(NamedTuple):
    """Second derivatives by h and L: with coordinates (2, N, 3 nv), and with each other (2, 2)."""

    columns: Array
    corner: Array


def half_hessian(
    at: Weighted, structure: Structure, root: Array | None = None, *, is_exact: bool = True
) -> BorderedMatrix:
    """Half the Hessian of the total cost at the weights of ``at``.

    Args:
        at: Linearisation at weights and a root penalty.
        structure: Of its transcription.
        root: Multipliers of the root forces in their units, shape (N, n_root); None: what the
            penalty says, rho c / N, which gives the true Hessian.
        is_exact: Whether second derivatives enter; else it is Gauss-Newton's J'J.
    """
    lin = at.lin
    pairs, m = structure.pairs, lin.evaluation.motion
    numbers = pairs.numbers(_second_by_reads(at, is_exact), m.h, m.a)
    K = _half_by_slots(at, pairs, numbers)
    glob = _by_globals(at, pairs, numbers)
    windows = Windows(m.v, m.a, m.h, lin.problem.walker.mirror)
    gradient = None
    if is_exact:
        multipliers, v_next = _multipliers(at, root)
        bent = _half_curvature(at, multipliers)
        if bent is not None:
            K += bent
        glob.columns[0, :, 2 * m.v.shape[1] :] += v_next  # v_next = v + h a
        gradient = lin.chain.by_coordinates(multipliers)
    K = K + K.mT
    pairs.uu.add(numbers, K)
    assembly = Assembly(windows)
    assembly.add_own(K)
    _add_ahead(assembly, at, pairs, numbers)
    _add_ends(assembly, K, glob, gradient)
    _add_per_metre(assembly, at, is_exact)
    f = at.factors.anchors
    assembly.blocks[0, 0, 0, 0] += f[0] ** 2
    assembly.corner[1, 1] += f[2] ** 2 * lin.is_period_out
    ring = structure.ring
    border = assembly.border.reshape(-1, 2)[ring.permutation]
    return BorderedMatrix(ring.band(assembly.blocks), border, assembly.corner, ring.permutation)


def _second_by_reads(at: Weighted, is_exact: bool) -> Array:
    """Second derivatives of half the cost by reads, terms in a row; see :class:`~.pairs.Pairs`."""
    lin = at.lin
    square, r = at.factors.costs**2, lin.evaluation.residuals
    second = lin.second if is_exact else None
    out = []
    for k, (place, slope) in enumerate(zip(lin.stack.places, lin.partials.blocks, strict=True)):
        if not place.term.reads:
            continue
        c = place.columns
        values = slope[:, None] * slope[None]
        if second is not None and second[k].any():
            values += r[:, c] * second[k]
        out.append((values * square[c]).ravel())
    return np.concatenate(out)


def _half_by_slots(at: Weighted, pairs: Pairs, numbers: Array) -> Array:
    """K of the outputs without curvature, its transpose yet to be added; (N, 3 nv, 3 nv)."""
    lin = at.lin
    rows, knots = lin.chain.rows, pairs.knots
    nv, middle = knots.nv, knots.n // 2
    dynamic, static = rows[:, pairs.dynamic], rows[:, pairs.static, :nv]
    C = pairs.dd.dense(numbers)
    i = np.arange(knots.n_root)
    C[:, i, i] += at.factors.root[0] ** 2
    X = (0.5 * C) @ dynamic
    pairs.du.add(numbers, X)
    if len(pairs.ds.target):
        X[..., :nv] += pairs.ds.dense(numbers) @ static
    K = dynamic.mT @ X
    X = pairs.su.dense(numbers)
    X[..., :nv] += (0.5 * pairs.ss.dense(numbers)) @ static
    K[:, :nv] += static.mT @ X
    left, right = rows[middle, nv + lin.chain.feet]
    align = (left - right) * at.factors.anchors[1]
    K[middle] += 0.5 * np.outer(align, align)
    return np.asarray(K)


def _by_globals(at: Weighted, pairs: Pairs, numbers: Array) -> _Global:
    rows, R = at.lin.chain.rows, pairs.knots.outputs
    local = pairs.global_local.dense(numbers)
    columns = local[..., R:] + (local[:, :, None, :R] @ rows)[:, :, 0]
    return _Global(columns, pairs.global_global.dense(numbers))


def _multipliers(at: Weighted, root: Array | None) -> tuple[Multipliers, Array]:
    """Multipliers of all outputs, and of v_next (N, nv)."""
    y = at.factors.times(at.residuals)
    channels = at.lin.partials.transpose_times(y.costs)
    of_root = y.root if root is None else root
    folded = at.lin.chain.fold(Outputs(channels, of_root, float(y.anchors[1])))
    return folded, channels.v_next


def _half_curvature(at: Weighted, y: Multipliers) -> Array | None:
    """Half the outputs' own second derivatives, if there is a closed form; (N, 3 nv, 3 nv)."""
    p = at.lin.problem
    lam = y.outputs[:, : p.nv].copy()
    lam[:, : p.walker.n_root] /= p.root_unit
    sigma = np.zeros((p.n_knots, p.walker.model.nsensordata))
    sigma[:, p.sensors] = y.outputs[:, p.nv :]
    return at.lin.derivatives.half_curvature(lam, sigma)


def _add_ahead(assembly: Assembly, at: Weighted, pairs: Pairs, numbers: Array) -> None:
    if not len(pairs.ahead.target):
        return
    sides = [_rows_of(at, pairs, slots) for slots in (pairs.ahead_rows, pairs.ahead_columns)]
    assembly.add_ahead(sides[0], pairs.ahead.dense(numbers), sides[1])


def _rows_of(at: Weighted, pairs: Pairs, slots: Array) -> Array:
    """Derivatives of some slots by the coordinates of their knot, shape (N, m, 3 nv)."""
    rows, R = at.lin.chain.rows, pairs.knots.outputs
    if (slots < R).all():
        return rows[:, slots]
    out = np.zeros((len(rows), len(slots), rows.shape[2]))
    for k, slot in enumerate(slots):
        if slot < R:
            out[:, k] = rows[:, slot]
        else:
            out[:, k, slot - R] = 1.0
    return out


def _add_ends(assembly: Assembly, K: Array, glob: _Global, gradient: Array | None) -> None:
    """Add the columns of L and T.

    Args:
        assembly: Where to.
        K: Second derivatives of every knot by its coordinates.
        glob: The same by h and L.
        gradient: First derivatives by coordinates, (N, 3 nv), if second derivatives of v and a by
            T enter.
    """
    windows = assembly.windows
    n, nv, T, by_T = windows.n, windows.nv, windows.T, windows.by_T
    by_h, by_L = glob.columns
    column = (K @ by_T[..., None])[..., 0] + by_h / n
    corner = float(np.vdot(by_T, column) + np.vdot(by_T, by_h) / n) + glob.corner[0, 0] / n**2
    if gradient is not None:  # d^2 v/dT^2 = 2 v/T^2 = -2/T dv/dT, of a 6 a/T^2 = -3/T da/dT
        column[:, nv : 2 * nv] -= gradient[:, nv : 2 * nv] / T
        column[:, 2 * nv :] -= gradient[:, 2 * nv :] * (2 / T)
        bend = gradient * by_T
        corner -= float(2 * bend[:, nv : 2 * nv].sum() + 3 * bend[:, 2 * nv :].sum()) / T
    assembly.add_own_column(by_L, 0)
    assembly.add_own_column(column, 1)
    mixed = float(np.vdot(by_T, by_L)) + glob.corner[0, 1] / n
    assembly.corner += np.array([[glob.corner[1, 1], mixed], [mixed, corner]])


def _add_per_metre(assembly: Assembly, at: Weighted, is_exact: bool) -> None:
    """Add what the factor T/L of the costs per metre adds."""
    g, u = at.per_metre_gradient, at.lin.log_scale
    times = 2.0 if is_exact else 1.0
    assembly.border += times * np.multiply.outer(g[:-2].reshape(assembly.border.shape[:2]), u)
    ends = np.outer(g[-2:], u)
    assembly.corner += times * (ends + ends.T)
    if is_exact:  # of T/L, relative to itself
        by_L, by_T = 2 * u
        bend = np.array([[by_L**2, 0.5 * by_L * by_T], [0.5 * by_L * by_T, 0.0]])
        assembly.corner += at.per_metre_cost * bend
    else:
        assembly.corner += at.per_metre_cost * np.outer(u, u)
