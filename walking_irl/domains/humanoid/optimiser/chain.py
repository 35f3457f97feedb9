r"""How the channels of a gait's steps change with its unknowns: knots, step length, half period.

Positions give velocities and accelerations by differences, these give torques, root forces and
sensor readings by inverse dynamics, and the step after the last one is the mirror image of the
first. ``forward`` and ``backward`` are the products with that Jacobian and its transpose;
``rows`` are its dense part, chained onto windows of three knots.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.domains.humanoid.costs.base import Channels
from walking_irl.domains.humanoid.optimiser.transcription import (
    Derivatives,
    Evaluation,
    Transcription,
)


class Outputs(NamedTuple):
    """Everything that costs and constraints are made of, or a change or gradient of it."""

    channels: Channels
    root: Array
    """Root forces in their units, shape (N, n_root)."""
    align: float
    """Forward distance of the feet at mid-step [m]."""


class Chain:
    """Derivatives of the outputs of a gait with respect to its unknowns, shape (N nv + 2,).

    Args:
        problem: The transcription.
        ev: The gait.
        d: Derivatives of inverse dynamics at its knots.
        sensors: Columns of the sensor readings that matter.

    Attributes:
        inputs: Derivatives of root forces, torques and those sensors with respect to q, v and a,
            input first: shape (N, 3 nv, n_root + nu + n_sensors).
        sensors: The columns read, increasing.
    """

    def __init__(
        self, problem: Transcription, ev: Evaluation, d: Derivatives, sensors: Indices
    ) -> None:
        self.problem, self.evaluation = problem, ev
        self.sensors = np.union1d(sensors, problem.feet)
        self.feet = np.searchsorted(self.sensors, problem.feet)
        n_root = problem.walker.n_root
        self.inputs = np.empty(
            (problem.n_knots, 3 * problem.nv, problem.nv + len(self.sensors)), dtype=float
        )
        parts = ((d.force_q, d.sensor_q), (d.force_v, d.sensor_v), (d.force_a, d.sensor_a))
        for b, (force, sensor) in enumerate(parts):
            block = self.inputs[:, b * problem.nv : (b + 1) * problem.nv]
            block[..., : problem.nv] = force
            block[..., problem.nv :] = sensor[..., self.sensors]
        self.inputs[..., :n_root] /= problem.root_unit

    def forward(self, dx: Array) -> Outputs:
        """Change of the outputs for a change ``dx`` of the unknowns."""
        p, m = self.problem, self.evaluation.motion
        walker, n, nv, h = p.walker, p.n_knots, p.nv, m.h
        dq, (d_length, d_period) = dx[:-2].reshape(n, nv), dx[-2:]
        before, after = walker.mirror @ dq[-1], walker.mirror @ dq[0]
        before[0] -= d_length
        after[0] += d_length
        dh = d_period / n
        v = np.vstack([m.v, m.v_next[-1:]])
        dv = np.diff(np.vstack([before, dq, after]), axis=0) / h - v * (dh / h)
        da = np.diff(dv, axis=0) / h - m.a * (dh / h)
        out = np.matmul(np.hstack([dq, dv[:-1], da])[:, None], self.inputs)[:, 0]
        tau, s = out[:, walker.n_root : nv], np.zeros_like(m.s)
        s[:, self.sensors] = out[:, nv:]
        tau_last = walker.torque_mirror @ tau[0]
        s_last = walker.sensor_mirror @ s[0] + walker.sensor_advance * d_length
        channels = Channels(
            q=dq,
            v=dv[:-1],
            v_next=dv[1:],
            a=da,
            tau=tau,
            tau_next=np.vstack([tau[1:], tau_last]),
            s=s,
            s_next=np.vstack([s[1:], s_last]),
            h=float(dh),
            distance=float(d_length),
        )
        left, right = s[n // 2, p.feet]
        return Outputs(channels, out[:, : walker.n_root], float(left - right))

    def backward(self, y: Outputs) -> Array:
        """Gradient with respect to the unknowns of ``y`` . outputs, shape (N nv + 2,)."""
        p, m, c = self.problem, self.evaluation.motion, y.channels
        walker, n, nv, h = p.walker, p.n_knots, p.nv, m.h
        tau, s = c.tau.copy(), c.s.copy()
        tau[1:] += c.tau_next[:-1]
        tau[0] += walker.torque_mirror.T @ c.tau_next[-1]
        s[1:] += c.s_next[:-1]
        s[0] += walker.sensor_mirror.T @ c.s_next[-1]
        d_length = float(walker.sensor_advance @ c.s_next[-1])
        s[n // 2, p.feet] += [y.align, -y.align]
        outputs = np.hstack([y.root, tau, s[:, self.sensors]])
        by_input = np.matmul(self.inputs, outputs[..., None])[..., 0]
        a = c.a + by_input[:, 2 * nv :]
        v = np.zeros((n + 1, nv))
        v[:-1] = c.v + by_input[:, nv : 2 * nv] - a / h
        v[1:] += c.v_next + a / h
        dh = c.h - float(np.vdot(a, m.a)) / h
        dh -= (float(np.vdot(v[:-1], m.v)) + float(v[-1] @ m.v_next[-1])) / h
        ring = np.zeros((n + 2, nv))
        ring[1:] = v / h
        ring[:-1] -= v / h
        q = c.q + by_input[:, :nv] + ring[1:-1]
        q[-1] += walker.mirror.T @ ring[0]
        q[0] += walker.mirror.T @ ring[-1]
        d_length += ring[-1, 0] - ring[0, 0]
        return np.concatenate([q.ravel(), [d_length, dh / n]])

    def rows(self) -> Array:
        """Root forces, torques and sensors with respect to knots i - 1, i, i + 1 and T.

        Returns:
            Shape (N, n_root + nu + n_sensors, 3 nv + 1).
        """
        m, nv = self.evaluation.motion, self.problem.nv
        h, n = m.h, len(m.q)
        dq = self.inputs[:, :nv]
        dv, da = self.inputs[:, nv : 2 * nv] / h, self.inputs[:, 2 * nv :] / (h * h)
        out = np.empty((n, self.inputs.shape[2], 3 * nv + 1))
        out[:, :, :nv] = np.swapaxes(da - dv, 1, 2)
        out[:, :, nv : 2 * nv] = np.swapaxes(dq + dv - 2 * da, 1, 2)
        out[:, :, 2 * nv : -1] = np.swapaxes(da, 1, 2)
        by_v = np.matmul(m.v[:, None, :], dv)[:, 0]
        by_a = np.matmul(m.a[:, None, :], da)[:, 0]
        out[:, :, -1] = -(by_v + 2 * h * by_a) / n
        return out
