"""Small dense linear programs by the dual simplex method, many objectives side by side.

Source: C. E. Lemke, "The dual method of solving the linear programming problem", Naval Research
Logistics Quarterly 1 (1954). Every program of this package knows a basis whose multipliers are not
negative before it starts (a face of the simplex of weights), so there is no first phase. Each
answer is solved for once more from the rows of its basis, and counts only if every row and every
multiplier then has its sign; HiGHS is asked otherwise.
"""

from __future__ import annotations

from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from walking_irl.arrays import Array
from walking_irl.errors import SolverError

_VIOLATION = 1e-12
"""By how much a row may be missed before it enters the basis."""
_PROVEN = 1e-11
"""Largest violated row and smallest multiplier, relative to the others, of a proven optimum."""
_SMALLEST_PIVOT = 1e-10
_MOST_PIVOTS = 50
"""Per variable; about 3 are needed."""


class Optimum(NamedTuple):
    """max c.x over A x <= b for each row c of C: A x <= b, multipliers >= 0, multipliers A = c."""

    x: Array
    """Maximisers, shape (p, n)."""
    multipliers: Array
    """Of the rows, 0 unless the row is tight; shape (p, m)."""


def maximise(C: Array, A: Array, b: Array, basis: NDArray[np.intp]) -> Optimum:
    """Maximise each row of ``C`` over the same A x <= b, with free x.

    Args:
        C: Objectives, shape (p, n).
        A: Rows with entries of order 1, shape (m, n).
        b: Right-hand sides of order 1, shape (m,).
        basis: n independent rows for each objective, which is a non-negative combination of them;
            shape (p, n).

    Returns:
        Maximisers, vertices of the set, and the multipliers that prove them.

    Raises:
        SolverError: If no point satisfies the rows, or HiGHS fails too.
    """
    p, n = C.shape
    x, tight, is_proven = np.zeros((p, n)), np.zeros((p, n)), np.zeros(p, dtype=bool)
    with np.errstate(all="ignore"), suppress(np.linalg.LinAlgError):
        basis = _pivot(C[0], A, b, basis[0])[None] if p == 1 else _pivot_all(C, A, b, basis)
        rows = A[basis]
        x[:] = np.linalg.solve(rows, b[basis][..., None])[..., 0]
        tight[:] = np.linalg.solve(rows.swapaxes(1, 2), C[..., None])[..., 0]
        is_proven = (x @ A.T - b).max(axis=1) <= _PROVEN
        is_proven &= tight.min(axis=1) >= -_PROVEN * np.abs(tight).max(axis=1)
    multipliers = np.zeros((p, len(b)))
    multipliers[np.arange(p)[:, None], basis] = np.maximum(tight, 0.0)
    for i in np.flatnonzero(~is_proven):
        x[i], multipliers[i] = _highs(C[i], A, b)
    return Optimum(x, multipliers)


def _pivot(c: Array, A: Array, b: Array, basis: NDArray[np.intp]) -> NDArray[np.intp]:
    """Optimal basis, shape (n,); where it is not reached within the pivots allowed, the last one.

    The row violated most enters; of the basis B, the one whose multiplier falls to 0 first leaves.
    A pivot changes the tableau [[A B^-1, A x - b], [multipliers, c.x]] by a matrix of rank 1.
    """
    m, n = A.shape
    inverse = np.linalg.inv(A[basis])
    x = inverse @ b[basis]
    tableau = np.empty((m + 1, n + 1))
    tableau[:m, :n], tableau[:m, n] = A @ inverse, A @ x - b
    tableau[m, :n], tableau[m, n] = c @ inverse, c @ x
    excess, multipliers = tableau[:m, n], tableau[m, :n]
    basis = basis.copy()
    for _ in range(_MOST_PIVOTS * n):
        enters = excess.argmax()
        if excess[enters] <= _VIOLATION:
            break
        change = tableau[enters].copy()
        rate = change[:n]  # the entering row by those of the basis
        leaves = np.where(rate > _SMALLEST_PIVOT, multipliers / rate, np.inf).argmin()
        column = tableau[:, leaves] / rate[leaves]
        rate[leaves] -= 1.0
        tableau -= column[:, None] * change
        basis[leaves] = enters
    return basis


def _pivot_all(C: Array, A: Array, b: Array, basis: NDArray[np.intp]) -> NDArray[np.intp]:
    """The same for p objectives in step, (p, n) -> (p, n), on tableaux [[B^-1, x], [.., c.x]].

    For one objective it takes two to three times as long as :func:`_pivot`, for 2 K of them a
    third of 2 K calls.
    """
    p, n = C.shape
    found = np.empty((p, n), dtype=np.intp)
    left = k = np.arange(p)
    tableau = np.empty((p, n + 1, n + 1))
    tableau[:, :n, :n] = np.linalg.inv(A[basis])
    tableau[:, :n, n] = (tableau[:, :n, :n] @ b[basis][..., None])[..., 0]
    tableau[:, n] = (C[:, None] @ tableau[:, :n])[:, 0]
    basis = basis.copy()
    for _ in range(_MOST_PIVOTS * n):
        slack = b - tableau[:, :n, n] @ A.T
        enters = slack.argmin(axis=1)
        is_left = slack[k, enters] < -_VIOLATION
        if not is_left.all():
            found[left] = basis
            left, basis, tableau, enters = (v[is_left] for v in (left, basis, tableau, enters))
            if len(left) == 0:
                return found
            k = np.arange(len(left))
        change = (A[enters][:, None] @ tableau[:, :n])[:, 0]
        change[:, n] -= b[enters]
        rate = change[:, :n]
        ratio = np.where(rate > _SMALLEST_PIVOT, tableau[:, n, :n] / rate, np.inf)
        leaves = ratio.argmin(axis=1)
        column = tableau[k, :, leaves] / rate[k, leaves][:, None]
        rate[k, leaves] -= 1.0
        tableau -= column[:, :, None] * change[:, None]
        basis[k, leaves] = enters
    found[left] = basis
    return found


def _highs(c: Array, A: Array, b: Array) -> tuple[Array, Array]:
    """The same by HiGHS, as accurately as it goes: maximiser (n,) and multipliers (m,)."""
    from scipy.optimize import linprog  # takes .3 s, and is hardly ever needed

    for method in ("highs-ds", "highs-ipm"):
        options = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
        result = linprog(-c, A_ub=A, b_ub=b, bounds=(None, None), method=method, options=options)
        if result.status == 0:
            return np.asarray(result.x), np.maximum(-np.asarray(result.ineqlin.marginals), 0.0)
    raise SolverError(f"linear program with {len(b)} rows failed: {result.message}")
