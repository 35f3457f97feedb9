r"""How the channels of a gait's steps change with its unknowns: knots, step length, half period.

Positions give velocities and accelerations by differences, these give torques, root forces and
sensor readings by inverse dynamics, and the step after the last one is the mirror image of the
first. ``forward`` and ``backward`` are the products with that Jacobian and its transpose.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.costs.base import Channels
from walking_irl.domains.humanoid.optimiser.dynamics.inverse import Derivatives
from walking_irl.domains.humanoid.optimiser.transcription import Evaluation, Transcription


class Outputs(NamedTuple):
    """Everything that costs and constraints are made of, or a change or gradient of it."""

    channels: Channels
    root: Array
    """Root forces in their units, shape (N, n_root)."""
    align: float
    """Forward distance of the feet at mid-step [m]."""


class Multipliers(NamedTuple):
    """A gradient of outputs, by knots: the step after a knot's is folded onto it."""

    outputs: Array
    """Of root forces in their units, torques and the sensors read, shape (N, R)."""
    coordinates: Array
    """Of q, v and a at fixed outputs, shape (3, N, nv)."""
    h: float
    length: float
    """Of the duration of a step and of the step length, at fixed outputs and coordinates."""


class Chain:
    """Derivatives of the outputs of a gait with respect to its unknowns, shape (N nv + 2,).

    Args:
        problem: The transcription.
        ev: The gait.
        d: Derivatives of inverse dynamics at its knots.

    Attributes:
        rows: Derivatives of root forces in their units, torques and the sensors of
            ``problem.sensors`` with respect to q, v and a: shape (3, N, R, nv).
    """

    def __init__(self, problem: Transcription, ev: Evaluation, d: Derivatives) -> None:
        self.problem, self.evaluation = problem, ev
        nv, sensors = problem.nv, problem.sensors
        self.feet = np.searchsorted(sensors, problem.feet)
        self.rows = np.empty((3, problem.n_knots, nv + len(sensors), nv))
        parts = ((d.tau_q, d.s_q), (d.tau_v, d.s_v), (d.tau_a, d.s_a))
        for rows, (force, sensor) in zip(self.rows, parts, strict=True):
            rows[:, :nv], rows[:, nv:] = force, sensor[:, sensors]
        self.rows[:, :, : problem.walker.n_root] /= problem.root_unit[:, None]

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
        out = (self.rows @ np.stack([dq, dv[:-1], da])[..., None])[..., 0].sum(0)
        tau, s = out[:, walker.n_root : nv], np.zeros_like(m.s)
        s[:, p.sensors] = out[:, nv:]
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

    def fold(self, y: Outputs) -> Multipliers:
        """The gradient ``y`` of all outputs by knots."""
        p, m, c = self.problem, self.evaluation.motion, y.channels
        walker, n = p.walker, p.n_knots
        tau, s = c.tau.copy(), c.s.copy()
        tau[1:] += c.tau_next[:-1]
        tau[0] += walker.torque_mirror.T @ c.tau_next[-1]
        s[1:] += c.s_next[:-1]
        s[0] += walker.sensor_mirror.T @ c.s_next[-1]
        s[n // 2, p.feet] += [y.align, -y.align]
        return Multipliers(
            outputs=np.hstack([y.root, tau, s[:, p.sensors]]),
            coordinates=np.stack([c.q, c.v + c.v_next, c.a + m.h * c.v_next]),
            h=c.h + float(np.vdot(c.v_next, m.a)),  # v_next = v + h a
            length=float(walker.sensor_advance @ c.s_next[-1]),
        )

    def by_coordinates(self, y: Multipliers) -> Array:
        """Gradient with respect to q, v and a of every knot, shape (3, N, nv)."""
        return np.asarray(y.coordinates + (y.outputs[:, None] @ self.rows)[:, :, 0])

    def backward(self, y: Outputs) -> Array:
        """Gradient with respect to the unknowns of ``y`` . outputs, shape (N nv + 2,)."""
        p, m = self.problem, self.evaluation.motion
        n, nv, h, mirror = p.n_knots, p.nv, m.h, p.walker.mirror
        folded = self.fold(y)
        by_q, by_v, a = self.by_coordinates(folded)
        dh = folded.h - (float(np.vdot(by_v, m.v)) + 2 * float(np.vdot(a, m.a))) / h
        v = np.zeros((n + 1, nv))
        v[:-1] = by_v - a / h
        v[1:] += a / h
        ring = np.zeros((n + 2, nv))
        ring[1:] = v / h
        ring[:-1] -= v / h
        q = by_q + ring[1:-1]
        q[-1] += mirror.T @ ring[0]
        q[0] += mirror.T @ ring[-1]
        d_length = folded.length + float(ring[-1, 0] - ring[0, 0])
        return np.concatenate([q.ravel(), [d_length, dh / n]])
