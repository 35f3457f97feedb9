"""Optimal walking paths: SLSQP with exact gradients, then Newton's method to rounding."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from walking_irl.arrays import Array
from walking_irl.domains.path.model import costs, gradient, integrate
from walking_irl.errors import SolverError

N_COSTS, N_END = 5, 6
MAX_ACCELERATION = 5.0
"""Bound of every acceleration [m/s^2, rad/s^2]; assumed, the paper's is not known."""
DURATION = (0.8, 20.0)
"""Bounds of the duration [s]; assumed."""
DIFFERENCE = 1e-6
"""Step of the central differences of the exact gradient that give the Hessian."""
RESIDUAL, STATIONARITY = 1e-10, 1e-8
"""Tolerances of a solution: final state; gradient, relative to the objective's weights."""
AT_BOUND = 1e-7
MAX_NEWTON = 8
MAX_DRAWS = 20
"""Draws of other ways to a goal."""


class Path(NamedTuple):
    """A locally optimal path to one goal."""

    z: Array
    """Controls and duration, shape (3 N + 1,)."""
    F: Array
    """Raw costs, shape (5,)."""
    sensitivity: Array | None
    """d F / d a, shape (5, 5), negative semi-definite; None where bounds leave it undefined."""
    n_iter: int


def jacobians(z: Array, goal: Array) -> tuple[Array, Array, Array, Array]:
    """Costs (5,), error of the final state (6,), and their Jacobians (5, n), (6, n)."""
    walks = integrate(np.repeat(z[None], N_COSTS + N_END, axis=0))
    unit = np.eye(N_COSTS + N_END)
    J = gradient(walks, goal, unit[:, :N_COSTS], unit[:, N_COSTS:])
    target = np.concatenate([goal, np.zeros(3)])
    return costs(walks, goal)[0], walks.end[0] - target, J[:N_COSTS], J[N_COSTS:]


def reduced_gradient(z: Array, goal: Array) -> Array:
    """Gradient of each cost along the directions that keep the end conditions, shape (n, 5).

    Controls at their bounds stay there.
    """
    _, _, J, E = jacobians(z, goal)
    free = _free(z)
    gradient: Array = (J[:, free] @ null_space(E[:, free])).T
    return gradient


def nearby_paths(z: Array, goal: Array, size: float, n: int, rng: np.random.Generator) -> Array:
    """Costs of ``n`` other ways to the goal, shape (n, 5): random steps that keep the end.

    A step along the null space of the end conditions has the length ``size`` relative to z;
    Newton's method then leads back to the end, and what does not arrive is drawn again.

    Raises:
        SolverError: If hardly any of them arrives.
    """
    free, found = _free(z), np.empty((0, N_COSTS))
    E = jacobians(z, goal)[3][:, free]
    along, back = null_space(E), np.linalg.pinv(E)
    target, lo, hi = np.concatenate([goal, np.zeros(3)]), *_bounds(z.size)
    for _ in range(MAX_DRAWS):
        steps = rng.standard_normal((n, along.shape[1])) @ along.T
        steps *= size * np.linalg.norm(z) / np.linalg.norm(steps, axis=1, keepdims=True)
        near = np.repeat(z[None], n, axis=0)
        near[:, free] += steps
        for _ in range(MAX_NEWTON):
            near[:, free] -= (integrate(near).end - target) @ back.T
            near = np.clip(near, lo, hi)
        walks = integrate(near)
        arrives = np.abs(walks.end - target).max(axis=1) <= RESIDUAL
        found = np.concatenate([found, costs(walks, goal)[arrives]])
        if len(found) >= n:
            return found[:n]
    raise SolverError(f"of other ways to {goal.tolist()} only {len(found)} of {n} arrive")


def slope(path: Path, goal: Array, a: Array) -> Array:
    """D z / d a of an optimal path, shape (3 N + 1, 5): -Z (Z' H Z)^-1 Z' J'.

    Controls at their bounds stay there.
    """
    free = _free(path.z)
    _, _, J, E = jacobians(path.z, goal)
    g, E = a @ J, E[:, free]
    multipliers = -np.asarray(np.linalg.lstsq(E.T, g[free], rcond=None)[0], dtype=np.float64)
    Z = null_space(E)
    H = hessian(path.z, goal, a, multipliers)[np.ix_(free, free)]
    change = np.zeros((path.z.size, N_COSTS))
    change[free] = -Z @ np.linalg.solve(Z.T @ H @ Z, Z.T @ J[:, free].T)
    return change


def _free(z: Array) -> NDArray[np.bool_]:
    lo, hi = _bounds(z.size)
    return np.asarray((z > lo + AT_BOUND) & (z < hi - AT_BOUND))


def hessian(z: Array, goal: Array, a: Array, multipliers: Array) -> Array:
    """Hessian (n, n) of a.F + multipliers.end, by central differences of its exact gradient."""
    n = z.size
    batch = z + DIFFERENCE * np.concatenate([np.eye(n), -np.eye(n)])
    g = gradient(integrate(batch), goal, np.tile(a, (2 * n, 1)), np.tile(multipliers, (2 * n, 1)))
    H = (g[:n] - g[n:]) / (2 * DIFFERENCE)
    return 0.5 * (H + H.T)


def polished(a: Array, goal: Array, path: Path) -> Path:
    """The same local optimum to rounding, by Newton's method, with its sensitivity.

    Controls at their bounds stay there. With Z the null space of the end conditions on the others,
    d F / d a = -J Z (Z' H Z)^-1 Z' J'. The path is returned unchanged where Newton's method leaves
    it (no strict minimum, or another set of active bounds).
    """
    z, unit = path.z.copy(), float(np.abs(a).max())
    lo, hi = _bounds(z.size)
    free = _free(z)
    for _ in range(MAX_NEWTON):
        F, error, J, E = (
            part[..., free] if part.ndim == 2 else part for part in jacobians(z, goal)
        )
        g = a @ J
        multipliers = -np.asarray(np.linalg.lstsq(E.T, g, rcond=None)[0], dtype=np.float64)
        Z = null_space(E)
        if not Z.shape[1]:  # every control sits on its bound
            return path
        H = hessian(z, goal, a, multipliers)[np.ix_(free, free)]
        values, vectors = np.linalg.eigh(Z.T @ H @ Z)
        if values[0] <= 1e-12 * values[-1]:
            return path
        gap = float(np.abs(g + multipliers @ E).max())
        if np.abs(error).max() <= RESIDUAL and gap <= STATIONARITY * unit:
            along = (J @ Z @ vectors) / np.sqrt(values)
            is_same = a @ F <= a @ path.F + 1e-6 * unit
            return path._replace(z=z, F=F, sensitivity=-along @ along.T) if is_same else path
        normal = -np.linalg.pinv(E) @ error
        tangent = Z @ (vectors @ ((vectors.T @ (Z.T @ (g + H @ normal))) / values))
        z[free] += normal - tangent
        if np.any(z[free] < lo[free]) or np.any(z[free] > hi[free]):
            return path
    return path


def _bounds(n: int) -> tuple[Array, Array]:
    """Lower and upper bounds of controls and duration, shape (n,) each."""
    lo, hi = np.full(n, -MAX_ACCELERATION), np.full(n, MAX_ACCELERATION)
    lo[-1], hi[-1] = DURATION
    return lo, hi


def slsqp_path(a: Array, goal: Array, z: Array, tol: float = 1e-9) -> Path:
    """Locally optimal path within the bounds, from scipy's SLSQP with exact gradients.

    Raises:
        SolverError: If it does not arrive at the goal.
    """
    seen: dict[bytes, tuple[Array, Array, Array, Array]] = {}

    def at(v: Array) -> tuple[Array, Array, Array, Array]:
        key = v.tobytes()
        if key not in seen:
            seen.clear()
            seen[key] = jacobians(v, goal)
        return seen[key]

    unit = float(np.abs(a).max())
    from scipy.optimize import minimize  # takes .3 s; other domains come by here, too

    result = minimize(
        lambda v: a @ at(v)[0] / unit,
        z,
        jac=lambda v: a @ at(v)[2] / unit,
        constraints={"type": "eq", "fun": lambda v: at(v)[1], "jac": lambda v: at(v)[3]},
        bounds=list(zip(*_bounds(z.size), strict=True)),
        method="SLSQP",
        options={"maxiter": 300, "ftol": tol},
    )
    F, error, _, _ = jacobians(result.x, goal)
    if np.abs(error).max() > 1e-6:
        raise SolverError(f"no path found to {goal.tolist()}: {result.message}")
    return Path(result.x, F, None, int(result.nit))


def straight_start(goal: Array, n_intervals: int) -> Array:
    """Start of a search: stand still for as long as the goal takes at 1 m/s, at least 2 s."""
    z = np.zeros(3 * n_intervals + 1)
    z[-1] = max(2.0, float(np.hypot(goal[0], goal[1])))
    return z


def bent_start(goal: Array, n_intervals: int) -> Array:
    """The same, but to the left first and back: for searches that must not stay symmetric."""
    z = straight_start(goal, n_intervals)
    z[2:-1:3] = 0.5 * np.where(np.arange(n_intervals) < n_intervals / 2, 1.0, -1.0)
    return z
