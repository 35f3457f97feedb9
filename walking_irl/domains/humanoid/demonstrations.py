r"""Experts from files of this product: a gait cycle, or the recorded rollouts of ``recover``.

A file may start anywhere in the cycle, have its own sampling, and be rounded. Inverse dynamics
magnifies that: 1e-4 rad of rounding asks for .2 body weights at the root. So a gait that is not
exactly physical is fitted by one that is, in two steps that alternate: the physical gait nearest to
the file (a tethered solve), and the weights for which it is nearest to optimal: with :math:`M` the
sensitivities :math:`g^T H^{-1} g` of the costs, the Newton decrement of w is :math:`w^T M w / 2`,
whose least value on the simplex is a small quadratic program (A. Keshavarz, Y. Wang, S. Boyd 2011,
Imputing a convex objective function). Gauss-Newton steps on the distance of the optimal gait x*(w)
to the file finish it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np

from walking_irl.archives import read_arrays
from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.closed_loop.trials import part
from walking_irl.domains.humanoid.gait.cycles import drifting_spline, mirror_average
from walking_irl.domains.humanoid.gait.files import N_KNOTS, load_gait
from walking_irl.domains.humanoid.gait.gait import Gait, cycle_motion, whole_cycle
from walking_irl.domains.humanoid.gait.phase import anchored_cycle
from walking_irl.domains.humanoid.learner import solver_for
from walking_irl.domains.humanoid.optimiser.stages import DIRECT, stage
from walking_irl.domains.humanoid.spec import WalkerSpec
from walking_irl.errors import InvalidInputError
from walking_irl.expert import expert_from_returns
from walking_irl.types import Expert, Rollout

EXACT = 1e-4
"""Root force of a gait that is taken as it is [body weights]."""
PHYSICAL = 0.3
"""Root mean square root force from which on a file is not a walk of this body [body weights]."""
OFFSETS = (0.0, 0.05, -0.05, 0.1)
"""Starts that are tried in turn [knots]: the shipped gaits' lie within -.05 and .05."""
TETHERS = (1e4, 1e2, 1e1, 1.0)
ROUNDS = 3
NEARLY = 3e-5
"""Relative decrement of a tethered gait from which on its file shows an optimum."""
SAME = np.deg2rad(0.01)
"""Distance within which a fitted optimum is the file's gait, root mean square [rad]."""
SUBOPTIMALITY, LOOSE = 1e-4, 5e-3
"""How far from optimal an expert may be, relative to its costs: at least; and at most if fitted."""
ROLLOUTS = ("joints", "time", "q", "v", "u")
LEAST_ROWS = 4 * N_KNOTS
SETTLED = 2
"""Cycles of a rollout that are left out at its beginning."""


class Demonstrated(NamedTuple):
    """An expert from a file, its gait, and the rollouts that it was measured on."""

    expert: Expert
    gait: Gait
    rollouts: tuple[Rollout, ...]


def demonstrated(path: Path, spec: WalkerSpec) -> Demonstrated:
    """The expert that a file of this product shows.

    Args:
        path: A gait cycle (``gait --save``), or rollouts (``walking.npz`` of ``recover``): these
            give an expert with error bars.
        spec: Which body, and its costs.

    Raises:
        InvalidInputError: If it is neither, or not a walk of this body.
    """
    if path.suffix == ".npz" and path.is_file():
        arrays = read_arrays(path)
        if set(ROLLOUTS) <= set(arrays):
            return _from_rollouts(path, arrays, spec)
    gait = load_gait(path, spec.walker)
    gait, slack = _physical(path, gait, spec)
    costs = solver_for(spec).problem.evaluate(gait.to_vector()).total_costs()
    slack *= float(np.mean(costs))
    expert = Expert(-costs, np.zeros(len(costs)), slack, demonstration=gait)
    return Demonstrated(expert, gait, ())


def _physical(path: Path, gait: Gait, spec: WalkerSpec) -> tuple[Gait, float]:
    """The gait as this body can walk it, and how far from optimal it may be, relative."""
    x = gait.to_vector()
    root = solver_for(spec).problem.evaluate(x).root
    if np.abs(root).max() < EXACT:
        return gait, SUBOPTIMALITY
    size = float(np.sqrt(np.mean(root**2)))
    if not size < PHYSICAL:
        raise InvalidInputError(
            f"{path} is not a walk of this body: its root would need {size:.2g} body weights of "
            f"external force (at most {PHYSICAL}); give a gait saved by walking-irl gait --save, "
            "or look at a person's recording with walking-irl read"
        )
    fitted, decrement = nearest_optimum(gait, spec)
    if decrement < LOOSE:
        return fitted, max(SUBOPTIMALITY, 2 * decrement)
    raise InvalidInputError(
        f"{path} is not a walk that is optimal for any weights of this body (to "
        f"{100 * decrement:.1g} % of its cost), and its rounding hides its costs; look at a "
        "person's recording with walking-irl read"
    )


def nearest_optimum(gait: Gait, spec: WalkerSpec) -> tuple[Gait, float]:
    """A physical and nearly optimal gait, over all weights, next to one that is not quite physical.

    A gait's contacts depend on where its knots fall, so a file of other samples is tried with the
    knots a little earlier and later: the best fit is the gait that it was made from.

    Args:
        gait: Rounded or resampled.
        spec: Which body, and its costs.

    Returns:
        The gait, and how far from optimal it may be: its relative Newton decrement.
    """
    solver, walker = solver_for(spec), spec.walker
    found = []
    for knots in OFFSETS:
        x = _later(gait, walker, knots).to_vector()
        w, y = spec.stack.reference_weights, x
        for tether in TETHERS:
            y = _held(x, w, spec, tether)
            lin = solver.linearise(y)
            known = solver.sensitivity(w, lin)
            if known is not None:  # else no minimum yet: the next tether is looser
                w = _least(known[0])
        found.append((solver.decrement(w, lin), x, w, y))
        if found[-1][0] < NEARLY:
            break
    decrement, x, w, y = min(found, key=lambda f: f[0])
    free = _freedom(gait, walker)
    best = (_distance(y, x, free), decrement, y)
    if decrement < NEARLY:
        for _ in range(ROUNDS):
            y = solver.solve(w, y, DIRECT).x
            lin = solver.linearise(y)
            away = _distance(y, x, free)
            if away < max(SAME, 2 * best[0]):
                best = (away, solver.decrement(w, lin), y)
            known = solver.sensitivity(w, lin)
            if known is None:
                break
            w = _towards(w, _without(free, known[1]), _without(free, x - y))
    return Gait.from_vector(best[2], gait.q.shape[1]), best[1]


def _later(gait: Gait, walker: Walker, knots: float) -> Gait:
    """The gait with its knots a fraction of a knot later."""
    if knots == 0:
        return gait
    q, L = whole_cycle(gait, walker.mirror), gait.step_length
    drift = np.zeros(q.shape[1])
    drift[0] = 2 * L
    at = (np.arange(len(q)) + knots) / len(q)
    q = drifting_spline(q, 1.0, drift)(at % 1.0)[0]
    q[:, 0] += 2 * L * np.floor(at)
    return mirror_average(walker, q, L, gait.half_period)


def _held(x: Array, w: Array, spec: WalkerSpec, tether: float) -> Array:
    """A physical gait near ``x``, the nearer the stronger the tether."""
    stages = tuple(stage(p, 30, 1e-9, tether=tether) for p in (1e4, 1e5, 1e6))
    return solver_for(spec).solve(w, x, stages).x


def _least(M: Array) -> Array:
    """The weights on the simplex with the least w M w, shape (K,)."""
    values, vectors = np.linalg.eigh(M / np.trace(M))
    root = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    heavy = 1e3  # holds the sum of the weights at one
    K = len(M)
    rows = np.vstack([root, heavy * np.ones((1, K))])
    from scipy.optimize import nnls  # takes .3 s, and is needed for people's walks alone

    w, _ = nnls(rows, np.r_[np.zeros(K), heavy])
    return np.asarray(w / w.sum())


def _towards(w: Array, slope: Array, away: Array) -> Array:
    """Weights whose optimal gait is nearer, on the simplex: one Gauss-Newton step."""
    heavy = 1e3 * float(np.linalg.norm(slope))
    rows = np.vstack([slope, heavy * np.ones((1, len(w)))])
    from scipy.optimize import nnls

    step, _ = nnls(rows, np.r_[away + slope @ w, heavy])
    return np.asarray(step / step.sum())


def _freedom(gait: Gait, walker: Walker) -> Array:
    """Changes of a gait that are none: a later start and another place, orthonormal (N nv + 2, 2).

    The optimal gait starts where its contacts meet the knots best, a twentieth of a knot off.
    """
    _, v, _ = cycle_motion(gait, walker.mirror)
    later = np.r_[(v[: gait.n_knots] * gait.timestep).ravel(), 0.0, 0.0]
    place = np.zeros_like(later)
    place[: -2 : gait.q.shape[1]] = 1.0
    return np.linalg.qr(np.column_stack([place, later]))[0]


def _without(free: Array, x: Array) -> Array:
    """``x``, shape (n,) or (n, k), without what lies in the span of ``free``."""
    return np.asarray(x - free @ (free.T @ x))


def _distance(x: Array, y: Array, free: Array) -> float:
    """Root mean square difference of joint angles, start and place left aside [rad]."""
    return float(np.sqrt(np.mean(_without(free, x - y)[:-2] ** 2)))


def _from_rollouts(path: Path, arrays: dict[str, Any], spec: WalkerSpec) -> Demonstrated:
    """Expert known by recorded rollouts: features of each, and the mean gait."""
    walker = spec.walker
    rollouts = [_rollout(walker, *row) for row in _rows(path, arrays, walker)]
    n_rows = len(rollouts[0].q)
    if n_rows < LEAST_ROWS:
        raise InvalidInputError(
            f"{path} needs more than {SETTLED} whole gait cycles a rollout, got {n_rows} rows"
        )
    h = float(np.mean(np.diff(rollouts[0].time)))
    K = _period(rollouts[0].q[:, walker.n_root :])
    costs, gaits = [], []
    for r in rollouts:
        cycles = range(SETTLED, (len(r.q) - 1) // K)
        if not cycles:
            raise InvalidInputError(
                f"{path} needs more than {SETTLED} whole gait cycles a rollout, got {len(r.q)} rows"
            )
        pieces = [part(r, c * K, (c + 1) * K + 1) for c in cycles]
        costs.append(np.mean([spec.stack.rollout_costs(p, h) for p in pieces], axis=0))
        gaits.append(np.mean([_cycle(p, walker, h) for p in pieces], axis=0))
    if len(rollouts) < 2:
        raise InvalidInputError(f"{path} holds one rollout; error bars need at least 2")
    gait = Gait.from_vector(np.mean(gaits, axis=0), len(walker.joints))
    slack = SUBOPTIMALITY * float(np.mean(costs))
    expert = expert_from_returns(-np.array(costs), suboptimality=slack, demonstration=gait)
    return Demonstrated(expert, gait, tuple(rollouts))


def _rows(path: Path, arrays: dict[str, Any], walker: Walker) -> list[tuple[Array, ...]]:
    """Time (T,), q (T, nv), v (T, nv) and u (T, nu) of each rollout."""
    joints = tuple(str(j) for j in np.ravel(arrays["joints"]))
    if joints != walker.joints:
        raise InvalidInputError(f"{path} holds rollouts of another body than {walker.name}")
    n_rows = np.shape(arrays["time"])
    widths = {"q": len(joints), "v": len(joints), "u": len(joints) - walker.n_root}
    for name, width in widths.items():
        if len(n_rows) != 2 or arrays[name].shape != (*n_rows, width):
            raise InvalidInputError(
                f"{path}: {name} must have shape (rollouts, rows, {width}), got "
                f"{arrays[name].shape}"
            )
    kinds = {arrays[name].dtype.kind for name in ("time", *widths)}
    if not kinds <= set("fiu") or not all(np.isfinite(arrays[n]).all() for n in ("time", *widths)):
        raise InvalidInputError(f"{path} holds numbers that are not finite")
    steps = np.diff(arrays["time"], axis=1)
    if n_rows[1] < 2 or steps.min() <= 0 or np.ptp(steps) > 1e-6 * steps.mean():
        raise InvalidInputError(f"{path} needs equal, increasing time steps")
    return list(zip(*(np.asarray(arrays[n], float) for n in ROLLOUTS[1:]), strict=True))


def _rollout(walker: Walker, time: Array, q: Array, v: Array, u: Array) -> Rollout:
    """Accelerations and sensor readings by forward dynamics, as the simulation had them."""
    model, data = walker.model, mujoco.MjData(walker.model)
    a, sensors = np.empty_like(v), np.empty((len(q), model.nsensordata))
    for k in range(len(q)):
        data.qpos[:], data.qvel[:], data.ctrl[:] = q[k], v[k], u[k]
        mujoco.mj_forward(model, data)
        a[k], sensors[k] = data.qacc, data.sensordata
    return Rollout(time, q, v, a, u, sensors)


def _period(q: Array) -> int:
    """Steps of a gait cycle: the lag under which a rollout repeats itself, even."""
    settled = q[len(q) // 4 :]
    lags = np.arange(N_KNOTS, len(settled) // 2 + 1)
    apart = np.array([np.mean((settled[lag:] - settled[:-lag]) ** 2) for lag in lags])
    near = np.flatnonzero(apart <= apart.min() + 0.1 * (np.median(apart) - apart.min()))
    first = near[: 1 + int(np.argmax(np.diff(near, append=near[-1] + 2) > 1))]
    return int(lags[first[apart[first].argmin()]])


def _cycle(piece: Rollout, walker: Walker, h: float) -> Array:
    """One cycle of a rollout as the vector of a gait."""
    n = len(piece.q) - 1
    length = float(piece.q[-1, 0] - piece.q[0, 0]) / 2
    drift = np.zeros(piece.q.shape[1])
    drift[0] = 2 * length
    q = piece.q[:-1].copy()
    if n != 2 * N_KNOTS:
        q = drifting_spline(q, 1.0, drift)(np.arange(2 * N_KNOTS) / (2 * N_KNOTS))[0]
    q = anchored_cycle(walker, q, length)
    return mirror_average(walker, q, length, n * h / 2).to_vector()
