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

from walking_irl.arrays import Array, Indices
from walking_irl.domains.humanoid.optimiser.chain import Multipliers, Outputs
from walking_irl.domains.humanoid.optimiser.dynamics.inverse import Curvature
from walking_irl.domains.humanoid.optimiser.linearisation import Weighted
from walking_irl.domains.humanoid.optimiser.pairs import Knots, Pairs
from walking_irl.domains.humanoid.optimiser.ring import BorderedMatrix, Ring
from walking_irl.domains.humanoid.optimiser.transcription import Transcription
from walking_irl.domains.humanoid.optimiser.windows import Assembly, Own, Windows


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
    """Second derivatives by h and L: with coordinates (2, 3, N, nv), and with each other (2, 2)."""

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
    windows = Windows(m.v, m.a, m.h, lin.problem.walker.mirror)
    assembly = Assembly(windows)
    _add_moving(assembly, at, pairs, numbers)
    glob = _by_globals(at, pairs, numbers)
    gradient = bent = None
    if is_exact:
        multipliers, v_next = _multipliers(at, root)
        bent = _curvature(at, multipliers)
        glob.columns[0, 2] += v_next  # v_next = v + h a
        gradient = lin.chain.by_coordinates(multipliers)
    own = Own(windows, bent)
    if len(pairs.uu.target):
        own.add_pairs(pairs.uu.dense(numbers), *pairs.joints)
    own.add_row(pairs.knots.n // 2, _align(at))
    assembly.add_own(own)
    still = lin.chain.rows[0][:, pairs.still]
    assembly.add_still(still, pairs.ss.dense(numbers), pairs.s_ahead.dense(numbers))
    _add_ends(assembly, own.column, glob, gradient)
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


def _add_moving(assembly: Assembly, at: Weighted, pairs: Pairs, numbers: Array) -> None:
    """Add what the moving outputs add, without their own curvature."""
    rows = _rows_of(at, pairs, pairs.moving)
    C = pairs.mm.dense(numbers)
    i = np.arange(pairs.knots.n_root)
    C[:, i, i] += at.factors.root[0] ** 2
    own = 0.5 * C.diagonal(axis1=1, axis2=2)[..., None]
    X = own * rows if pairs.is_diagonal else (0.5 * C) @ rows
    pairs.mu.add(numbers, X)
    left, right = assembly.windows.columns(rows), assembly.windows.columns(X, 4)
    left.close()
    if len(pairs.m_ahead.target):
        A = pairs.m_ahead.dense(numbers)
        behind = np.stack([A, np.roll(A, 1, axis=0), np.roll(A, 2, axis=0)], axis=1)
        right.by_knot[: len(A), 1:] += behind @ left.by_knot[: len(A)]
        right.ends[:] += A @ np.roll(left.ends, -1, axis=0)
    right.close()
    assembly.add_moving(left, right)


def _align(at: Weighted) -> Array:
    """The row of the feet's distance at mid-step by the coordinates of its knot, (3, nv)."""
    problem, chain = at.lin.problem, at.lin.chain
    left, right = np.moveaxis(chain.rows[:, problem.n_knots // 2, problem.nv + chain.feet], 1, 0)
    return np.asarray((left - right) * at.factors.anchors[1])


def _by_globals(at: Weighted, pairs: Pairs, numbers: Array) -> _Global:
    rows, R = at.lin.chain.rows, pairs.knots.outputs
    local = pairs.global_local.dense(numbers)
    by_output = (local[:, None, :, None, :R] @ rows)[..., 0, :]
    own = np.moveaxis(local[..., R:].reshape(*local.shape[:2], 3, -1), 2, 1)
    return _Global(own + by_output, pairs.global_global.dense(numbers))


def _multipliers(at: Weighted, root: Array | None) -> tuple[Multipliers, Array]:
    """Multipliers of all outputs, and of v_next (N, nv)."""
    f, r, channels = at.factors, at.residuals, at.by_channels
    of_root = f.root * r.root if root is None else root
    folded = at.lin.chain.fold(Outputs(channels, of_root, float(f.anchors[1] * r.anchors[1])))
    return folded, channels.v_next


def _curvature(at: Weighted, y: Multipliers) -> Curvature | None:
    """The outputs' own second derivatives times half their multipliers, if they are known."""
    p = at.lin.problem
    lam = y.outputs[:, : p.nv].copy()
    lam[:, : p.walker.n_root] /= p.root_unit
    sigma = np.zeros((p.n_knots, p.walker.model.nsensordata))
    sigma[:, p.sensors] = y.outputs[:, p.nv :]
    return at.lin.derivatives.curvature(lam, sigma)


def _rows_of(at: Weighted, pairs: Pairs, slots: Indices) -> Array:
    """Derivatives of some slots by the coordinates of their knot, shape (3, N, m, nv)."""
    rows, R = at.lin.chain.rows, pairs.knots.outputs
    of_output = slots < R
    if of_output.all():
        return np.asarray(rows.take(slots, axis=2))
    out = np.zeros((3, rows.shape[1], len(slots), rows.shape[3]))
    out[:, :, of_output] = rows[:, :, slots[of_output]]
    for k in np.flatnonzero(~of_output):
        kind, joint = divmod(int(slots[k]) - R, rows.shape[3])
        out[kind, :, k, joint] = 1.0
    return out


def _add_ends(assembly: Assembly, own: Array, glob: _Global, gradient: Array | None) -> None:
    """Add the columns of L and T.

    Args:
        assembly: Where to.
        own: Second derivatives of every knot by its coordinates, times those by T, (3, N, nv).
        glob: Second derivatives by h and L.
        gradient: First derivatives by coordinates, (3, N, nv), if second derivatives of v and a by
            T enter.
    """
    windows = assembly.windows
    n, T, by_T = windows.n, windows.T, windows.by_T
    by_h, by_L = glob.columns
    column = own + by_h / n
    corner = float(np.vdot(by_T, column) + np.vdot(by_T, by_h) / n) + glob.corner[0, 0] / n**2
    if gradient is not None:  # d^2 v/dT^2 = 2 v/T^2 = -2/T dv/dT, of a 6 a/T^2 = -3/T da/dT
        column[1] -= gradient[1] / T
        column[2] -= gradient[2] * (2 / T)
        bend = np.vdot(gradient[1], by_T[1]), np.vdot(gradient[2], by_T[2])
        corner -= float(2 * bend[0] + 3 * bend[1]) / T
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
