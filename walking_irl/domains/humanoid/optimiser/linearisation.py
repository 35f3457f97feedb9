r"""First derivatives of all residuals of a gait, chained onto windows of four knots.

Residuals of step i depend on the knots i - 1 ... i + 2, the step length L and the half period T.
Rows are kept unweighted, so that one linearisation serves every weight vector: products with the
Jacobian, its transpose, and the Gauss-Newton matrix are formed from them on demand.

Costs per metre carry the factor s = sqrt(v0 T / L), so their rows are :math:`s J + r u^T` with
:math:`u = (-1/2L, 1/2T)` on (L, T): a rank-one term that is added once, not row by row.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.costs.objectives import (
    ACCELERATION_UNIT,
    HEAD_SCALE,
    IMPACT_UNIT,
    LEG_WEIGHT,
    LIMIT_WEIGHT,
    MOMENTUM_SCALE,
    OBJECTIVES,
    POWER_SMOOTHING,
    POWER_UNIT,
    SKID_SPEED,
    SKID_WEIGHT,
    SKID_WIDTH,
    STRENGTH_SWITCH,
    effort_slope,
    ground_contact,
)
from walking_irl.domains.humanoid.optimiser.transcription import (
    GAUGE_WEIGHT,
    PERIOD_WEIGHT,
    Derivatives,
    Evaluation,
    Transcription,
)

_SCALES = np.array([o.scale for o in OBJECTIVES])


class Terms(NamedTuple):
    """Weighted residuals, or anything of their layout; squares sum to w.G. Shapes (N, m)."""

    effort: Array
    work: Array
    work_end: Array
    smooth: Array
    stability: Array
    impact: Array
    time: Array
    skid: Array
    gap: Array
    limits: Array
    root: Array
    gauge: Array

    def flat(self) -> Array:
        """All entries in one vector."""
        return np.concatenate([t.ravel() for t in self])

    def like(self, flat: Array) -> Terms:
        """The inverse of :meth:`flat` for the shapes of this object."""
        edges = np.cumsum([t.size for t in self])[:-1]
        parts = np.split(flat, edges)
        return Terms(*(p.reshape(t.shape) for p, t in zip(parts, self, strict=True)))


PER_METRE = 7
"""The first so many terms are costs per metre and carry the factor s."""


def factors(ev: Evaluation, w: Array, penalty: float) -> Terms:
    """Square roots of the coefficients of all squared residuals, as scalars."""
    n = len(ev.motion.q)
    pace = ev.motion.pace
    effort, work, smooth, stability, impact, time = np.sqrt(w / _SCALES * pace / n)
    skid, gap, limits, root = np.sqrt(
        np.array([SKID_WEIGHT, LEG_WEIGHT, LIMIT_WEIGHT, penalty]) / n
    )
    return Terms(
        effort=effort,
        work=work,
        work_end=work,
        smooth=smooth,
        stability=stability,
        impact=impact,
        time=time * np.sqrt(n),
        skid=skid,
        gap=gap,
        limits=limits,
        root=root,
        gauge=np.sqrt([GAUGE_WEIGHT, GAUGE_WEIGHT, PERIOD_WEIGHT]),
    )


def weighted(ev: Evaluation, w: Array, penalty: float) -> Terms:
    """Weighted residuals of a gait; their squares sum to ``ev.total(w, penalty)``."""
    r = ev.residuals
    f = factors(ev, w, penalty)
    raw = (r.effort, r.work, r.work_end, r.smooth, r.stability, r.impact, np.ones(1))
    fixed = (r.skid, r.gap, r.limits, ev.root, ev.gauge)
    return Terms(*(a * b for a, b in zip(f, raw + fixed, strict=True)))


class Joints(NamedTuple):
    """Partial derivatives of the joint-wise residuals, each of shape (N, nu)."""

    effort_tau: Array
    work_tau: Array
    work_v: Array
    end_tau: Array
    end_v: Array


class Windows:
    """Which knots the window of a step holds, and how those beyond the half cycle map back."""

    def __init__(self, n: int, mirror: Array) -> None:
        around = np.arange(n)[:, None] + np.arange(-1, 3)
        self.knot = around % n
        self.wrap = (around >= n).astype(int) - (around < 0)
        self.mirror = mirror
        self.beyond = list(zip(*np.nonzero(self.wrap), strict=True))

    def gather(self, dx: Array) -> Array:
        """Windows of a vector of unknowns, shape (N, 4 nv)."""
        n, nv = len(self.knot), len(self.mirror)
        blocks = dx[:-2].reshape(n, nv)[self.knot]
        for i, b in self.beyond:
            blocks[i, b] = self.mirror @ blocks[i, b]
            blocks[i, b, 0] += self.wrap[i, b] * dx[-2]
        return np.asarray(blocks.reshape(n, 4 * nv))

    def scatter(self, windows: Array) -> Array:
        """Transpose of :meth:`gather`: sum of windows (N, 4 nv) as (N nv + 2,)."""
        n, nv = len(self.knot), len(self.mirror)
        blocks = windows.reshape(n, 4, nv).copy()
        out = np.zeros(n * nv + 2)
        for i, b in self.beyond:
            out[-2] += self.wrap[i, b] * blocks[i, b, 0]
            blocks[i, b] = blocks[i, b] @ self.mirror
        np.add.at(out[:-2].reshape(n, nv), self.knot, blocks)
        return out


class Linearisation:
    """Unweighted first derivatives of the residuals at one gait.

    Attributes:
        rows: Root forces, joint torques, stability, skid, gap and mid-step alignment with respect
            to the knots i - 1, i, i + 1 and T; shape (N, m, 3 nv + 1).
        impact: Rate of the ground forces with respect to the whole window and T,
            shape (N, 2, 4 nv + 1).
        velocity, velocity_next, acceleration: Derivatives of joint-wise motion with respect to the
            same joint at i - 1, i, i + 1 and T; shape (N, nu, 4).
    """

    def __init__(self, problem: Transcription, ev: Evaluation, d: Derivatives) -> None:
        self.problem, self.evaluation = problem, ev
        self.windows = Windows(problem.n_knots, problem.walker.mirror)
        m, n = ev.motion, problem.n_knots
        force = self._rows(d.force_q, d.force_v, d.force_a)
        self._sensor_rows(force, d)
        joint, h = problem.at.joints, m.h
        shape = (n, len(joint), 4)
        self.velocity, self.velocity_next, self.acceleration = (np.zeros(shape) for _ in range(3))
        self.velocity[..., :2] = [-1 / h, 1 / h]
        self.velocity[..., 3] = -m.v[:, joint] / (h * n)
        self.velocity_next[..., 1:3] = [-1 / h, 1 / h]
        self.velocity_next[..., 3] = -m.v_next[:, joint] / (h * n)
        self.acceleration[..., :3] = np.array([1, -2, 1]) / (h * h * ACCELERATION_UNIT)
        self.acceleration[..., 3] = -2 * m.a[:, joint] / (h * n * ACCELERATION_UNIT)
        self.joints = self._joint_partials()
        self.log_scale = np.array([-0.5 / ev.x[-2], 0.5 / ev.x[-1]])

    def _rows(self, dq: Array, dv: Array, da: Array) -> Array:
        """Chain derivatives (N, nv, m) with respect to q, v, a onto (N, m, 3 nv + 1)."""
        m, nv = self.evaluation.motion, self.problem.nv
        h, n = m.h, len(m.q)
        out = np.empty((n, dq.shape[2], 3 * nv + 1))
        dv, da = dv / h, da / (h * h)
        out[:, :, :nv] = np.swapaxes(da - dv, 1, 2)
        out[:, :, nv : 2 * nv] = np.swapaxes(dq + dv - 2 * da, 1, 2)
        out[:, :, 2 * nv : -1] = np.swapaxes(da, 1, 2)
        by_v = np.matmul(m.v[:, None, :], dv)[:, 0]
        by_a = np.matmul(m.a[:, None, :], da)[:, 0]
        out[:, :, -1] = -(by_v + 2 * h * by_a) / n
        return out

    def _sensor_rows(self, force: Array, d: Derivatives) -> None:
        p, ev = self.problem, self.evaluation
        at, walker, m, nv, n = p.at, p.walker, ev.motion, p.nv, p.n_knots
        groups = [at.head, at.momentum, at.touch, at.sole_z, at.left_y, at.right_y, p.feet]
        read = np.concatenate(groups)
        sensors = self._rows(d.sensor_q[..., read], d.sensor_v[..., read], d.sensor_a[..., read])
        edges = np.cumsum([len(g) for g in groups])[:-1]
        head, momentum, touch, sole_z, left, right, feet = np.split(sensors, edges, axis=1)
        sole_x = np.swapaxes(d.sensor_q[..., at.sole_x], 1, 2)  # positions: no v, no a
        swap = walker.sensor_mirror
        last = swap[np.ix_(at.sole_x, at.sole_x)] @ sole_x[0] @ walker.mirror
        ahead = np.concatenate([sole_x[1:], last[None]])
        contact = ground_contact(m.s[:, at.sole_z])[..., None]
        speed = (m.s_next[:, at.sole_x] - m.s[:, at.sole_x])[..., None] / m.h
        skid = -speed * contact * (1 - contact) / SKID_WIDTH * sole_z
        skid[..., nv : 2 * nv] -= contact * sole_x / m.h
        skid[..., 2 * nv : 3 * nv] += contact * ahead / m.h
        skid[..., -1:] -= contact * speed / (m.h * n)
        align = np.zeros((n, 1, 3 * nv + 1))
        align[n // 2] = feet[n // 2, :1] - feet[n // 2, 1:]
        self.rows = np.concatenate(
            [
                force[:, : walker.n_root] / p.root_unit[:, None],
                force[:, walker.n_root :],
                head * HEAD_SCALE[:, None],
                momentum * MOMENTUM_SCALE[:, None],
                skid / SKID_SPEED,
                (left - right) * (ev.residuals.gap < 0)[..., None],
                align,
            ],
            axis=1,
        )
        sizes = [walker.n_root, nv - walker.n_root, 10, skid.shape[1], left.shape[1], 1]
        edges = np.cumsum([0, *sizes])
        self.part = [slice(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True)]
        self.impact = self._impact_rows(touch)

    def _impact_rows(self, touch: Array) -> Array:
        p, ev = self.problem, self.evaluation
        at, walker, nv, n, h = p.at, p.walker, p.nv, p.n_knots, ev.motion.h
        swap = walker.sensor_mirror[np.ix_(at.touch, at.touch)]
        last = swap @ touch[0]
        for b in range(3):
            block = slice(b * nv, (b + 1) * nv)
            last[:, block] = last[:, block] @ walker.mirror
        ahead = np.concatenate([touch[1:], last[None]])
        rows = np.zeros((n, 2, 4 * nv + 1))
        rows[..., : 3 * nv] = -touch[..., :-1]
        rows[..., nv : 4 * nv] += ahead[..., :-1]
        rows[..., -1] = ahead[..., -1] - touch[..., -1]
        rows /= h * walker.weight * IMPACT_UNIT
        rows[..., -1] -= ev.residuals.impact / (h * n)
        return rows

    def _joint_partials(self) -> Joints:
        m, joint = self.evaluation.motion, self.problem.at.joints
        mean, half = effort_slope(self.problem.walker)
        th = np.tanh(m.tau / STRENGTH_SWITCH)
        effort = mean + half * (th + m.tau * (1 - th * th) / STRENGTH_SWITCH)
        v, v_next = m.v[:, joint], m.v_next[:, joint]
        start, end = _power_slope(m.tau * v), _power_slope(m.tau * v_next)
        return Joints(effort, start * v, start * m.tau, end * v_next, end * m.tau)

    def times(self, dx: Array, w: Array, penalty: float) -> Terms:
        """Jacobian of the weighted residuals times a direction ``dx``, shape (N nv + 2,)."""
        p, ev, j = self.problem, self.evaluation, self.joints
        window = self.windows.gather(dx)
        n, nv = p.n_knots, p.nv
        with_t = np.column_stack([window[:, : 3 * nv], np.full(n, dx[-1])])
        y = np.matmul(self.rows, with_t[..., None])[..., 0]
        root, tau, stability, skid, gap, align = (y[:, s] for s in self.part)
        whole = np.column_stack([window, np.full(n, dx[-1])])
        impact = np.matmul(self.impact, whole[..., None])[..., 0]
        local = self._joint_windows(window, dx[-1])
        v, v_next = (np.sum(a * local, -1) for a in (self.velocity, self.velocity_next))
        moved = window[:, nv : 2 * nv][:, p.at.joints] * (ev.residuals.limits != 0)
        gauge = np.array([dx[0], align[n // 2, 0], dx[-1] * (ev.gauge[2] != 0)])
        raw = (
            j.effort_tau * tau,
            j.work_tau * tau + j.work_v * v,
            j.end_tau * tau + j.end_v * v_next,
            np.sum(self.acceleration * local, -1),
            stability,
            impact,
            np.zeros(1),
            skid,
            gap,
            moved,
            root,
            gauge,
        )
        scaled = [a * b for a, b in zip(factors(ev, w, penalty), raw, strict=True)]
        growth = float(self.log_scale @ dx[-2:])
        r = weighted(ev, w, penalty)
        for k in range(PER_METRE):
            scaled[k] = scaled[k] + growth * r[k]
        return Terms(*scaled)

    def transpose_times(self, y: Terms, w: Array, penalty: float) -> Array:
        """Transposed Jacobian times ``y``, shape (N nv + 2,)."""
        out = self.pull_back(y, w, penalty)
        r = weighted(self.evaluation, w, penalty)
        dot = sum(float(np.vdot(r[k], y[k])) for k in range(PER_METRE))
        out[-2:] += dot * self.log_scale
        return out

    def pull_back(self, y: Terms, w: Array, penalty: float) -> Array:
        """:meth:`transpose_times` without the derivative of the per-metre factor."""
        p, ev, j = self.problem, self.evaluation, self.joints
        f = factors(ev, w, penalty)
        z = Terms(*(a * b for a, b in zip(f, y, strict=True)))
        n, nv, joint = p.n_knots, p.nv, p.at.joints
        tau = j.effort_tau * z.effort + j.work_tau * z.work + j.end_tau * z.work_end
        align = np.zeros((n, 1))
        align[n // 2] = z.gauge[1]
        left = np.concatenate([z.root, tau, z.stability, z.skid, z.gap, align], axis=1)
        by_rows = np.matmul(left[:, None], self.rows)[:, 0]
        by_impact = np.matmul(z.impact[:, None], self.impact)[:, 0]
        local = (
            (j.work_v * z.work)[..., None] * self.velocity
            + (j.end_v * z.work_end)[..., None] * self.velocity_next
            + z.smooth[..., None] * self.acceleration
        )
        window = by_impact[:, :-1].copy()
        window[:, : 3 * nv] += by_rows[:, :-1]
        for b in range(3):
            window[:, b * nv + joint] += local[..., b]
        window[:, nv + joint] += z.limits * (ev.residuals.limits != 0)
        out = self.windows.scatter(window)
        out[0] += z.gauge[0]
        out[-1] += by_rows[:, -1].sum() + by_impact[:, -1].sum() + local[..., 3].sum()
        out[-1] += z.gauge[2] * (ev.gauge[2] != 0)
        return out

    def gradient(self, w: Array, penalty: float) -> Array:
        """Half the gradient of ``evaluation.total(w, penalty)``, shape (N nv + 2,)."""
        return self.transpose_times(weighted(self.evaluation, w, penalty), w, penalty)

    def _joint_windows(self, window: Array, dt: float) -> Array:
        """Windows by joint, (N, nu, 4): the joint at i - 1, i, i + 1, and the change of T."""
        nv, joint = self.problem.nv, self.problem.at.joints
        blocks = [window[:, b * nv + joint] for b in range(3)]
        return np.stack([*blocks, np.full_like(blocks[0], dt)], axis=-1)


def _power_slope(p: Array) -> Array:
    """Derivative of :func:`~.objectives.root_power`."""
    s = p * p + POWER_SMOOTHING**2
    return np.asarray(np.sqrt(0.5 / POWER_UNIT) * (s**-0.25 - 0.5 * p * p * s**-1.25))
