r"""Sensors of a tree in motion: first and second derivatives of what MuJoCo's sensors read.

Points move by their Jacobian rows J; what turns with dof j while k moves it bends by S_j x (...).
The acceleration of a point at r on a body of motion (V, A), with omega, alpha their rotations and
v_p the point's velocity, is A_lin + alpha x r + omega x v_p; its derivatives follow from

.. math:: \partial_q V = S \times V + P, \quad \partial_v A = 2 P + S \times V, \quad
          \partial_q A = S \times A + R + P \times V

and the motion of r. The angular momentum about the moving centre of mass c is the one about the
fixed origin minus (c - origin) x momentum.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.domains.humanoid.optimiser.dynamics.rigid_body import Halves, RigidBody
from walking_irl.domains.humanoid.optimiser.dynamics.spatial import (
    cross,
    force_matrix,
    motion_matrix,
    point_rows,
    skew,
    times,
)
from walking_irl.domains.humanoid.optimiser.dynamics.tree import Snapshot, Square, Tree


class Part(NamedTuple):
    """A sensor fixed to a body: the first of its numbers, and where a snapshot has what it reads.

    ``field`` names a field of :class:`~.tree.Snapshot`; ``axis`` is the column of a frame, else 0.
    """

    start: int
    body: int
    field: str = ""
    item: int = 0
    axis: int = 0

    def read(self, at: Snapshot) -> Array:
        """The place, shape (N, 3), or the axis."""
        x: Array = getattr(at, self.field)[:, self.item]
        return x[..., self.axis] if x.ndim == 3 else x


class Plan(NamedTuple):
    """Which numbers among ``sensordata`` are of which kind; ``touch``: first number, foot."""

    size: int
    points: tuple[Part, ...] = ()
    accelerations: tuple[Part, ...] = ()
    spins: tuple[Part, ...] = ()
    axes: tuple[Part, ...] = ()
    centres: tuple[int, ...] = ()
    momenta: tuple[int, ...] = ()
    touch: tuple[tuple[int, int], ...] = ()


class Whole(NamedTuple):
    """Second derivatives to be added in place, (N, nv, nv); ``qq`` and ``vv`` plus their transpose.

    Other than in :class:`Halves`, entries hold wherever they stand.
    """

    qq: Array
    qv: Array
    qa: Array
    vv: Array


class Turning(NamedTuple):
    """Derivatives of the motion of one body, on its dofs."""

    square: Square
    axes: Array
    P: Array
    V: Array
    A: Array
    V_q: Array
    A_v: Array
    A_q: Array


class Sensors:
    """What the sensors read at N knots, differentiated.

    Attributes:
        s_q, s_v, s_a: Derivatives of the sensors, shape (N, ns, nv); touch stays zero here.
    """

    def __init__(self, tree: Tree, plan: Plan, body: RigidBody) -> None:
        self.tree, self.plan, self.body = tree, plan, body
        shape = (len(body.V), plan.size, tree.nv)
        self.s_q, self.s_v, self.s_a = (np.zeros(shape) for _ in range(3))
        self._points()
        bodies = {part.body for part in plan.accelerations + plan.spins}
        self.turning = {b: self._turning(b) for b in sorted(bodies)}
        self.pushed = [_Accelerated(p, self.turning[p.body], body) for p in plan.accelerations]
        for part, point in zip(plan.accelerations, self.pushed, strict=True):
            dofs = self.turning[part.body].square.dofs
            for to, x in ((self.s_q, point.q), (self.s_v, point.v), (self.s_a, point.J)):
                to[:, part.start : part.start + 3, dofs] = x
        for part in plan.spins:
            t = self.turning[part.body]
            self.s_q[:, part.start : part.start + 3, t.square.dofs] = t.V_q[..., :3].mT
            self.s_v[:, part.start : part.start + 3, t.square.dofs] = t.axes[..., :3].mT
        self._axes()
        self._whole_body()

    def _points(self) -> None:
        at, parts = self.body.at, self.plan.points
        n, nv = len(at.com), self.tree.nv
        places = np.stack([p.read(at) for p in parts], 1) if parts else np.zeros((n, 0, 3))
        rows = point_rows(places - at.com[:, None]).reshape(n, 3 * len(parts), 6)
        on = self.tree.moves[:, [p.body for p in parts]].T[:, None]
        self.point_q = (rows @ at.axes.mT).reshape(n, len(parts), 3, nv) * on
        self.point_at: Indices = np.array([p.start for p in parts], int)[:, None] + np.arange(3)
        self.s_q[:, self.point_at] = self.point_q

    def _turning(self, index: int) -> Turning:
        body, square = self.body, Square(self.tree.chain(index))
        axes, P, R = (x[:, square.dofs] for x in (body.at.axes, body.P, body.R))
        V, A = body.V[:, index], body.A[:, index]
        by_v, by_a = -motion_matrix(V).mT, -motion_matrix(A).mT  # x @ by_v = x x V
        s_v = axes @ by_v
        V_q = s_v + P
        return Turning(square, axes, P, V, A, V_q, P + V_q, axes @ by_a + R + P @ by_v)

    def _axes(self) -> None:
        at = self.body.at
        self.axis_turn = []
        for part in self.plan.axes:
            on = self.tree.moves[:, part.body, None]
            turn = on * (at.axes[..., :3] @ -skew(part.read(at)).mT)  # S x axis
            self.axis_turn.append(turn)
            self.s_q[:, part.start : part.start + 3] = turn.mT

    def _whole_body(self) -> None:
        body = self.body
        self.com_q = body.I_S[..., 3:] / self.tree.mass
        shift = self.com_q @ -skew(body.momentum[:, 3:]).mT  # com_q x momentum
        for start in self.plan.centres:
            self.s_q[:, start : start + 3] = self.com_q.mT
        for start in self.plan.momenta:
            self.s_q[:, start : start + 3] = (body.momentum_q[..., :3] - shift).mT
            self.s_v[:, start : start + 3] = body.I_S[..., :3].mT

    def angular(self, sigma: Array) -> Array:
        """Multiplier of the angular momentum, (N, 3), from those of all sensors (N, ns)."""
        return _summed(sigma, self.plan.momenta)

    def bend(self, sigma: Array, halves: Halves, whole: Whole) -> None:
        """Add the second derivatives of sigma.s, touch and the momentum's fixed origin apart."""
        turn, com_q, body = halves.turn, self.com_q, self.body
        turn += np.sum((skew(-sigma[:, self.point_at]) @ self.point_q).mT, 1)
        for part, turned in zip(self.plan.axes, self.axis_turn, strict=True):
            turn += turned @ -skew(sigma[:, part.start : part.start + 3]).mT
        m = self.angular(sigma)
        pull = _summed(sigma, self.plan.centres) - cross(body.momentum[:, 3:], m)
        turn += com_q @ -skew(pull).mT
        com_m = com_q @ -skew(m).mT  # com_q x m
        whole.qq[:] += com_m @ body.momentum_q[..., 3:].mT
        whole.qv[:] += com_m @ body.I_S[..., 3:].mT
        for part in self.plan.spins:
            t = self.turning[part.body]
            spin = sigma[:, part.start : part.start + 3]
            moved = t.axes @ _wrench(np.zeros_like(spin), spin)
            halves.qq[t.square.block] -= moved @ t.V_q.mT
            halves.qv[t.square.block] -= moved @ t.axes.mT
        for part, point in zip(self.plan.accelerations, self.pushed, strict=True):
            point.bend(sigma[:, part.start : part.start + 3], halves, whole)


class _Accelerated:
    """The acceleration of one point, on the dofs that move it."""

    def __init__(self, part: Part, t: Turning, body: RigidBody) -> None:
        self.t = t
        self.r = part.read(body.at) - body.at.com
        rows = point_rows(self.r)
        spin, push = skew(t.V[:, :3]), skew(t.A[:, :3])
        self.v_p = times(rows, t.V)
        whirl = skew(self.v_p)
        all_rows = rows @ np.concatenate([t.axes, t.V_q, t.A_v, t.A_q], 1).mT
        self.J, v_q, a_v, a_q = np.split(all_rows, 4, -1)
        turned = spin @ self.J
        self.v_q = v_q + turned  # derivative of the point's velocity
        self.v = a_v + turned - whirl @ t.axes[..., :3].mT
        self.q = a_q + push @ self.J + spin @ self.v_q - whirl @ t.V_q[..., :3].mT

    def bend(self, f: Array, halves: Halves, whole: Whole) -> None:
        """Add the second derivatives of f.acceleration, f of shape (N, 3)."""
        t, at = self.t, self.t.square.block
        f2 = cross(f, t.V[:, :3])  # pairs with second derivatives of the point's velocity
        by_a = _wrench(f, cross(self.r, f))
        by_v = _wrench(f2, cross(self.r, f2) + cross(self.v_p, f))
        s_a, s_v = t.axes @ by_a, t.axes @ by_v
        p_v = t.P @ by_a + s_v
        halves.qq[at] -= s_a @ t.A_q.mT + p_v @ t.V_q.mT
        halves.qv[at] -= s_a @ t.A_v.mT + p_v @ t.axes.mT
        halves.vq[at] -= s_a @ t.V_q.mT
        twice = s_a @ t.axes.mT
        halves.vv[at] -= twice
        halves.qa[at] -= twice
        pull = cross(f, t.A[:, :3]) + cross(f2, t.V[:, :3])
        J, v_q = self.J.mT, self.v_q.mT
        halves.turn[:, t.square.dofs] += J @ -skew(pull).mT
        with_f, with_f2 = -skew(f).mT, -skew(f2).mT
        J_f, J_f2, v_f = J @ with_f, J @ with_f2, v_q @ with_f
        spin, spin_q = t.axes[..., :3], t.V_q[..., :3]
        left = np.concatenate([J_f, J_f2 + v_f], -1)
        whole.qq[at] += left @ np.concatenate([t.A_q[..., :3], spin_q], -1).mT
        whole.qv[at] += left @ np.concatenate([t.A_v[..., :3], spin], -1).mT
        whole.qv[at] -= (spin_q @ with_f) @ J.mT
        whole.vv[at] -= (spin @ with_f) @ J.mT
        whole.qa[at] += J_f @ spin.mT


def _wrench(force: Array, moment: Array) -> Array:
    """Matrices M with S @ M = S x* (moment; force), for rows S."""
    return force_matrix(np.concatenate([moment, force], -1)).mT


def _summed(sigma: Array, starts: Iterable[int]) -> Array:
    total = np.zeros((len(sigma), 3))
    for start in starts:
        total += sigma[:, start : start + 3]
    return total
