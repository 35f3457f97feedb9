"""Inverse dynamics of a model, differentiated at many knots at once: in closed form, or by MuJoCo.

The closed form covers trees of hinges and slides, polynomial springs and dampers, and spheres in
soft contact with level ground. Any other model falls back to MuJoCo's finite differences,
:attr:`InverseDynamics.reason` says why, and there are no second derivatives then.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from walking_irl.arrays import Array, Flags
from walking_irl.domains.humanoid.optimiser.dynamics.contact import Contact, Soles
from walking_irl.domains.humanoid.optimiser.dynamics.coverage import (
    UncoveredError,
    check_tree,
    plan_of,
    soles_of,
)
from walking_irl.domains.humanoid.optimiser.dynamics.rigid_body import RigidBody
from walking_irl.domains.humanoid.optimiser.dynamics.sensors import Plan, Sensors, Whole
from walking_irl.domains.humanoid.optimiser.dynamics.spatial import times
from walking_irl.domains.humanoid.optimiser.dynamics.tree import Kinematics, Passive, Tree

FD_STEP = 1e-7
"""Step of the finite differences where there is no closed form."""


class Derivatives:
    """First derivatives at N knots, output before input.

    Attributes:
        tau_q, tau_v, tau_a: Of the generalised forces, the root's among them, (N, nv, nv).
        s_q, s_v, s_a: Of the sensors, (N, ns, nv).
    """

    tau_q: Array
    tau_v: Array
    tau_a: Array
    s_q: Array
    s_v: Array
    s_a: Array

    def curvature(self, lam: Array, sigma: Array) -> Curvature | None:
        """Second derivatives of lambda.tau + sigma.s, or None where there is no closed form.

        Args:
            lam: Multipliers of all generalised forces, shape (N, nv).
            sigma: Multipliers of all sensors, shape (N, ns).
        """
        return None


class Curvature(NamedTuple):
    """Second derivatives at N knots by q, v, a, and by y = a + damping v; (N, nv, nv) each.

    ``qq``, ``vv`` and ``yy`` are symmetric; accelerations enter by y alone where they enter twice:
    the second derivatives by v are ``vv`` + damping^2 ``yy``, by v and a damping ``yy``, by a
    ``yy``.
    """

    qq: Array
    qv: Array
    qa: Array
    vv: Array
    yy: Array
    damping: float

    def times(self, v: Array, a: Array) -> Array:
        """Product with a change of v and a, (N, nv) each; shape (3, N, nv)."""
        by_y = times(self.yy, a + self.damping * v)
        by_q = times(self.qv, v) + times(self.qa, a)
        return np.stack([by_q, times(self.vv, v) + self.damping * by_y, by_y])

    def matrix(self) -> Array:
        """All of them, shape (N, 3 nv, 3 nv)."""
        va = self.damping * self.yy
        rows = [
            [self.qq, self.qv, self.qa],
            [self.qv.mT, self.vv + self.damping * va, va],
            [self.qa.mT, va, self.yy],
        ]
        return np.block(rows)


class InverseDynamics:
    """Differentiates ``mj_inverse`` of one model.

    Attributes:
        reason: Why there is no closed form for this model; None if there is.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self.reason: str | None = None
        self._parts: _Parts | None = None
        try:
            check_tree(model)
            tree = Tree(model)
            soles = soles_of(model, tree)
            plan = plan_of(model, soles)
            self._parts = _Parts(tree, soles, plan, Passive(model), Kinematics(model))
        except UncoveredError as e:
            self.reason = str(e)
        self._armature = np.array(model.dof_armature)

    @property
    def static_sensors(self) -> Flags:
        """Which sensors are known to depend on positions alone, shape (ns,)."""
        out = np.zeros(self.model.nsensordata, dtype=bool)
        if self._parts is not None:
            plan = self._parts.plan
            starts = [part.start for part in plan.points + plan.axes] + list(plan.centres)
            for start in starts:
                out[start : start + 3] = True
        return out

    def at(self, q: Array, v: Array, a: Array) -> Derivatives:
        """Derivatives at positions, velocities and accelerations, each of shape (N, nv)."""
        if self._parts is None:
            return FiniteDifferences(self.model, q, v, a)
        return ClosedForm(self._parts, self._armature, q, v, a)


class _Parts(NamedTuple):
    tree: Tree
    soles: Soles
    plan: Plan
    passive: Passive
    kinematics: Kinematics


class ClosedForm(Derivatives):
    """Derivatives by the formulas of :mod:`.rigid_body`, :mod:`.contact` and :mod:`.sensors`."""

    def __init__(self, parts: _Parts, armature: Array, q: Array, v: Array, a: Array) -> None:
        self.parts = parts
        tree, soles, plan, passive, kinematics = parts
        at = kinematics.read(q)
        self.body = RigidBody(tree, at, v, a)
        self.tau_q, self.tau_v, self.tau_a = self.body.tau_q, self.body.tau_v, self.body.tau_a
        i = np.arange(tree.nv)
        self.tau_a[:, i, i] += armature
        stiffness, damping = passive.slopes(q, v)
        self.tau_q[:, i, i] += stiffness
        self.tau_v[:, i, i] += damping
        self._bends = passive.bends(q, v)
        self.sensors = Sensors(tree, plan, self.body)
        self.s_q, self.s_v, self.s_a = self.sensors.s_q, self.sensors.s_v, self.sensors.s_a
        self.contact = Contact(soles, self.body, v, a)
        self.contact.subtract(self.tau_q, self.tau_v, self.tau_a)
        for row, foot in plan.touch:
            square = soles.squares[foot]
            normal_a = self.contact.normal_a[:, foot, : square.size]
            self.s_q[:, row, square.dofs] = self.contact.normal_q[:, foot, : square.size]
            self.s_a[:, row, square.dofs] = normal_a
            self.s_v[:, row, square.dofs] = soles.soft.damping * normal_a

    def curvature(self, lam: Array, sigma: Array) -> Curvature:
        """Second derivatives; see :meth:`Derivatives.curvature`."""
        tree, soles, plan = self.parts[:3]
        axes, n, nv, B = self.body.at.axes, len(lam), tree.nv, soles.soft.damping
        angular = self.sensors.angular(sigma)
        halves, W, omega = self.body.curvature(axes * lam[..., None], angular)
        whole = Whole(*np.zeros((4, n, nv, nv)))
        self.sensors.bend(sigma, halves, whole)
        normal = np.zeros((n, len(soles.bodies)))
        for row, foot in plan.touch:
            normal[:, foot] += sigma[:, row]
        bent = self.contact.curvature(lam, normal, W, omega)
        for k, square in enumerate(soles.squares):
            halves.turn[:, square.dofs] += bent.turn[:, k, : square.size]
        halves.qq[:] += axes[..., :3] @ halves.turn.mT
        qq, qv, qa, vv = whole
        C, U = tree.half_carries, tree.strictly
        qq += C * halves.qq
        vv += C * halves.vv
        qv += tree.carries * halves.qv
        qv += (U * halves.vq).mT
        qa += tree.carries * halves.qa
        qa += (U * halves.aq).mT
        yy = np.zeros((n, nv, nv))
        for to, blocks, factor in ((qq, bent.qq, 1.0), (qv, bent.qy, B), (qa, bent.qy, 1.0)):
            soles.spread(blocks, to, factor)
        soles.spread(bent.yy, yy)
        qq, vv = qq + qq.mT, vv + vv.mT
        i = np.arange(nv)
        qq[:, i, i] += lam * self._bends[0]
        vv[:, i, i] += lam * self._bends[1]
        return Curvature(qq, qv, qa, vv, yy, B)


class FiniteDifferences(Derivatives):
    """Derivatives by ``mjd_inverseFD``."""

    def __init__(
        self, model: mujoco.MjModel, q: Array, v: Array, a: Array, eps: float = FD_STEP
    ) -> None:
        n, nv, ns = len(q), model.nv, model.nsensordata
        data = mujoco.MjData(model)
        out = [np.empty((n, nv, m)) for m in (nv, nv, nv, ns, ns, ns)]
        for i in range(n):
            data.qpos[:], data.qvel[:], data.qacc[:] = q[i], v[i], a[i]
            mujoco.mjd_inverseFD(model, data, eps, False, *(x[i] for x in out), None)
        turned = [np.ascontiguousarray(x.mT) for x in out]
        self.tau_q, self.tau_v, self.tau_a, self.s_q, self.s_v, self.s_a = turned
