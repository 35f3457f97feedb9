"""What the formulas need of a model: its tree of joints, and its kinematics at all knots."""

from __future__ import annotations

from typing import Any, NamedTuple

import mujoco
import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.domains.humanoid.optimiser.dynamics.spatial import inertia_matrix


class Tree:
    """Who carries whom, among the degrees of freedom and bodies of one kinematic tree.

    Attributes:
        carries: 1 where dof j carries dof i or is it, shape (nv, nv), indexed [j, i].
        strictly: The same without the diagonal; ``half_carries`` with half of it.
        moves: 1 where dof j moves body b, shape (nv, nb).
        gravity: Acceleration of the world, (0; -g), shape (6,).
        mass: Of the whole tree [kg].
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        nv, nb = model.nv, model.nbody
        self.nv, self.nb = nv, nb
        self.carries = np.zeros((nv, nv))
        for i in range(nv):
            j = i
            while j >= 0:
                self.carries[j, i] = 1
                j = model.dof_parentid[j]
        self.strictly = self.carries - np.eye(nv)
        self.half_carries = self.carries - 0.5 * np.eye(nv)
        self.moves = np.zeros((nv, nb))
        for body in range(1, nb):
            b = body
            while b > 0:
                self.moves[model.dof_bodyid == b, body] = 1
                b = model.body_parentid[b]
        self.gravity = np.concatenate([np.zeros(3), -model.opt.gravity])
        self.mass = float(model.body_mass[1:].sum())

    def chain(self, body: int) -> Indices:
        """Dofs that move a body, root first; each carries all that follow it."""
        return np.flatnonzero(self.moves[:, body])


class Square:
    """Where the derivatives of a body's quantities stand among those of all dofs.

    A slice where the body's dofs are consecutive: views are faster than copies.
    """

    def __init__(self, dofs: Indices) -> None:
        n = len(dofs)
        self.size = n
        consecutive = bool(n) and dofs[-1] - dofs[0] == n - 1
        self.dofs: Any = slice(int(dofs[0]), int(dofs[-1]) + 1) if consecutive else dofs
        rows = self.dofs if consecutive else dofs[:, None]
        self.block: Any = (slice(None), rows, self.dofs)


class Passive:
    """Springs and dampers of joints: polynomials, as MuJoCo >= 3.16 has them.

    With y the deflection, the spring's force is ``-(k0 y + k1 y^2 + k2 y^3)`` and the damper's
    ``-(d0 v + d1 v |v| + d2 v^3)``.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self.rest = np.array(model.qpos_spring)
        self.k = np.column_stack([model.jnt_stiffness, model.jnt_stiffnesspoly]).T
        self.d = np.column_stack([model.dof_damping, model.dof_dampingpoly]).T

    def slopes(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Stiffness and damping at q and v, each of shape (N, nv)."""
        y = q - self.rest
        stiffness = self.k[0] + y * (2 * self.k[1] + 3 * y * self.k[2])
        return stiffness, self.d[0] + 2 * self.d[1] * np.abs(v) + 3 * self.d[2] * v * v

    def bends(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Derivatives of :meth:`slopes` with respect to q and v."""
        stiffening = 2 * self.k[1] + 6 * (q - self.rest) * self.k[2]
        return stiffening, 2 * self.d[1] * np.sign(v) + 6 * self.d[2] * v


class Snapshot(NamedTuple):
    """Kinematics at N knots; the origin of spatial vectors is ``com``."""

    axes: Array
    """S: the joints' axes, shape (N, nv, 6)."""
    inertia: Array
    """Of every body, shape (N, nb, 6, 6)."""
    com: Array
    """Centre of mass of the whole tree [m], shape (N, 3)."""
    geoms: Array
    sites: Array
    bodies: Array
    """Places of geoms, sites, and of the bodies' own and inertial frames [m], (N, n, 3)."""
    inertial: Array
    body_frames: Array
    """Orientation of the bodies' own, inertial and the sites' frames, (N, n, 3, 3)."""
    inertial_frames: Array
    site_frames: Array


class Kinematics:
    """Runs ``mj_kinematics`` and ``mj_comPos`` at every knot and copies what the formulas need."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        data = self.data = mujoco.MjData(model)
        self.fields = (
            data.cdof,
            data.cinert,
            data.subtree_com[1],
            data.geom_xpos,
            data.site_xpos,
            data.xpos,
            data.xipos,
            data.xmat,
            data.ximat,
            data.site_xmat,
        )

    def read(self, q: Array) -> Snapshot:
        """Kinematics at the joint positions ``q``, shape (N, nv)."""
        n, model, data, fields = len(q), self.model, self.data, self.fields
        out = [np.empty((n, *f.shape)) for f in fields]
        qpos, slots = data.qpos, list(zip(out, fields, strict=True))
        for i in range(n):
            qpos[:] = q[i]
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            for to, field in slots:
                to[i] = field
        axes, inertia, *places = out
        frames = [f.reshape(n, -1, 3, 3) for f in places[5:]]
        return Snapshot(axes, inertia_matrix(inertia), *places[:5], *frames)
