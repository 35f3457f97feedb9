r"""Contact of spheres with the ground: its part of inverse dynamics, differentiated twice.

With d the distance of a sphere, p its contact point, J the Jacobian there, B the reference's
damping and K its stiffness,

.. math:: s = J(p) (\ddot q + B \dot q) + e_z K\,\mathrm{imp}(d) (d - \mathrm{margin}),
          \quad F = -D(d) \nabla \psi(s), \quad \tau \mathrel{-}= J(p)' F

(MuJoCo's J a - aref has no derivative of J along the motion). The contact point lies midway between
sphere and ground, so it rises half as fast as the sphere. Only active contacts are computed, packed
one after the other, on the dofs of the chain that carries them.

For second derivatives, the scalar phi = -w.F is a function of (w, s, d), w = J lambda minus the
multiplier of the touch sensor on the normal: a Hessian of 7 x 7 per contact, chained with the
first derivatives of w, s and d, plus their own second derivatives.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.domains.humanoid.optimiser.dynamics.cone import Cone, Softness
from walking_irl.domains.humanoid.optimiser.dynamics.packed import Packed
from walking_irl.domains.humanoid.optimiser.dynamics.rigid_body import RigidBody
from walking_irl.domains.humanoid.optimiser.dynamics.spatial import (
    cross,
    force_matrix,
    motion_cross,
    motion_matrix,
    point_rows,
    skew,
    times,
)
from walking_irl.domains.humanoid.optimiser.dynamics.tree import Square, Tree

_CENTRE = np.array([[1.0], [1.0], [2.0]])
"""A contact point rises half as fast as the centre of its sphere."""


class Soles:
    """The spheres that can touch the ground, grouped by the body that they belong to ("foot").

    Attributes:
        geoms: Their geoms, shape (n,), and their ``radius`` [m].
        foot: Index of the foot of each sphere, shape (n,).
        bodies: The feet's bodies.
        squares: Dofs of each foot.
        chain: The same in one array (feet, m), padded with nv, a dof without axis.
        ground: Height of the ground [m].
        soft: Parameters of the contacts.
    """

    def __init__(
        self,
        tree: Tree,
        geoms: Indices,
        bodies: Indices,
        radius: Array,
        ground: float,
        soft: Softness,
    ) -> None:
        order = np.lexsort((geoms, bodies))
        self.geoms, self.radius, self.ground = geoms[order], radius[order], ground
        self.soft = soft.take(order)
        self.bodies, self.foot = np.unique(bodies[order], return_inverse=True)
        chains = [tree.chain(b) for b in self.bodies]
        self.squares = [Square(c) for c in chains]
        self.width = max((len(c) for c in chains), default=0)
        self.chain = np.full((len(chains), self.width), tree.nv)
        for row, c in zip(self.chain, chains, strict=True):
            row[: len(c)] = c
        self.upper = np.triu(np.ones((self.width, self.width)))
        self.half = self.upper - 0.5 * np.eye(self.width)

    def on_chains(self, x: Array) -> Array:
        """Quantities of dofs, (N, nv, ...), by foot and dof of its chain, (N, feet, m, ...)."""
        padded = np.concatenate([x, np.zeros_like(x[:, :1])], axis=1)
        return np.asarray(padded[:, self.chain])

    def spread(self, blocks: Array, onto: Array, factor: float = 1.0) -> None:
        """Add blocks (N, feet, m, m) of the chains to matrices (N, nv, nv)."""
        for k, square in enumerate(self.squares):
            onto[square.block] += factor * blocks[:, k, : square.size, : square.size]


class Contact:
    """Contact forces at N knots and their derivatives.

    Attributes:
        normal_q, normal_a: Derivatives of every foot's summed normal force with respect to the
            dofs of its chain, shape (N, feet, m); the one with respect to v is B times ``_a``.
        cone: The contacts' cones, for tests that want all cases hit.
    """

    def __init__(self, soles: Soles, body: RigidBody, v: Array, a: Array) -> None:
        self.soles, self.body = soles, body
        at, soft = body.at, soles.soft
        self.y = a + soft.damping * v
        moved = at.axes * self.y[..., None]
        self.y_foot = body.tree.moves[:, soles.bodies].T @ moved
        y_turn = motion_cross(body.tree.strictly.T @ moved, at.axes)
        spheres = at.geoms[:, soles.geoms]
        distance = spheres[..., 2] - soles.ground - soles.radius
        self.packed = Packed.of(distance < soft.margin, soles.foot, len(soles.bodies))
        self.axes = soles.on_chains(at.axes)
        self.turned = self._turned(self.y_foot, soles.on_chains(y_turn))
        self._kinematics(spheres, distance)
        self._forces()

    def _turned(self, motion: Array, added: Array) -> Array:
        """Derivatives of a foot's motion by the dofs of its chain, shape (N, feet, m, 6)."""
        return np.asarray(self.axes @ -motion_matrix(motion).mT + added)

    def _kinematics(self, spheres: Array, distance: Array) -> None:
        knot, foot, sphere = self.packed[:3]
        d = distance[knot, sphere]
        up = self.soles.radius[sphere] + d / 2  # from the contact point to the sphere's centre
        r = spheres[knot, sphere] - self.body.at.com[knot]
        r[:, 2] -= up
        axes = self.axes[knot, foot]
        self.rows = point_rows(r)
        self.J = self.rows @ axes.mT
        self.p_q = self.J.copy()  # derivative of the contact point
        self.p_q[:, 0] += up[:, None] * axes[..., 1]
        self.p_q[:, 1] -= up[:, None] * axes[..., 0]
        self.p_q[:, 2] *= 0.5
        self.soft = self.soles.soft.take(sphere)
        self.law = self.soft.laws(d)

    def _point_motion(self, turned: Array, motion: Array) -> Array:
        """Derivative of the velocity of the contact points, were their feet to move so."""
        knot, foot = self.packed[:2]
        spin = skew(motion[knot, foot, :3])
        return np.asarray(self.rows @ turned[knot, foot].mT + spin @ self.p_q)

    def _forces(self) -> None:
        soles, law = self.soles, self.law
        knot, foot = self.packed[:2]
        d_q = self.J[:, 2]
        s = times(self.J, soles.on_chains(self.y)[knot, foot])
        s[:, 2] += law.push
        self.s_q = self._point_motion(self.turned, self.y_foot)
        self.s_q[:, 2] += law.push1[:, None] * d_q
        self.cone = Cone(s, self.soft.mu)
        force = -law.D[:, None] * self.cone.gradient
        stiffness = -law.D[:, None, None] * self.cone.hessian
        shrink = (law.D1[:, None] * self.cone.gradient)[..., None] * d_q[:, None]
        force_q, force_a = stiffness @ self.s_q - shrink, stiffness @ self.J
        pack, m = self.packed, soles.width
        self._padded_J, self._padded_p = pack.pad(self.J), pack.pad(self.p_q)
        pulling = pack.pad(np.concatenate([force_q, force_a], -1))
        pulled = pack.products(self._padded_J, pulling)
        wrench = pack.sum(times(self.rows.mT, force))
        lever = pack.products(self._padded_p, pack.pad(skew(force)))  # p_q x F
        rotated = (self.axes @ force_matrix(wrench).mT) @ self.axes.mT  # (S_j x* F).S_k
        self._by_a = pulled[..., m:]
        self._by_q = pulled[..., :m] + soles.upper.T * rotated + self.axes[..., :3] @ lever.mT
        normal = self.packed.sum(np.stack([force_q[:, 2], force_a[:, 2]], 1))
        self.normal_q, self.normal_a = normal[:, :, 0], normal[:, :, 1]

    def subtract(self, tau_q: Array, tau_v: Array, tau_a: Array) -> None:
        """Take J'F out of the derivatives of the torques, (N, nv, nv) each, in place."""
        self.soles.spread(self._by_q, tau_q, -1.0)
        self.soles.spread(self._by_a, tau_v, -self.soles.soft.damping)
        self.soles.spread(self._by_a, tau_a, -1.0)

    def curvature(self, lam: Array, normal: Array, W: Array, omega: Array) -> Bent:
        """Second derivatives of -lambda.(J'F) + normal.(summed normal forces).

        Args:
            lam: Multiplier of the torques, shape (N, nv).
            normal: Multiplier of every foot's summed normal force, shape (N, feet).
            W: Of :meth:`~.rigid_body.RigidBody.curvature`, shape (N, nb, 6).
            omega: The same, shape (N, nv, 6).
        """
        soles, cone, law = self.soles, self.cone, self.law
        knot, foot = self.packed[:2]
        w_foot = W[:, soles.bodies]
        w_turned = self._turned(w_foot, soles.on_chains(omega))
        w = times(self.J, soles.on_chains(lam)[knot, foot])
        w[:, 2] -= normal[knot, foot]
        w_q = self._point_motion(w_turned, w_foot)
        h_w = times(cone.hessian, w)
        of_w, of_s = law.D[:, None] * cone.gradient, law.D[:, None] * h_w  # d phi/d w, d phi/d s
        w_g = np.sum(w * cone.gradient, -1)
        U = np.concatenate([w_q, self.s_q, self.J[:, 2:]], 1)
        hessian = self._phi(w, h_w, w_g, of_s)
        h_u, h_j = hessian @ U, hessian[:, 3:6, 3:6] @ self.J
        pull = cross(of_w, w_foot[knot, foot, :3]) + cross(of_s, self.y_foot[knot, foot, :3])
        pull[:, 2] = 0.5 * pull[:, 2] + law.D1 * w_g + law.push1 * of_s[:, 2]
        levers = np.concatenate([_CENTRE * skew(pull), skew(of_w), skew(of_s)], -1)
        pack = self.packed
        summed = Summed(
            uu=pack.products(pack.pad(U), pack.pad(h_u)),
            uy=pack.products(pack.pad(h_u[:, 3:6]), self._padded_J),
            yy=pack.products(self._padded_J, pack.pad(h_j)),
            levers=pack.products(self._padded_p, pack.pad(levers)),
        )
        wrenches = np.stack([times(self.rows.mT, of_w), times(self.rows.mT, of_s)], 1)
        return self._bent(summed, self.packed.sum(wrenches), w_turned)

    def _phi(self, w: Array, h_w: Array, w_g: Array, of_s: Array) -> Array:
        """Hessian of phi with respect to (w, s, d), shape (n, 7, 7)."""
        cone, law = self.cone, self.law
        D, D1 = law.D[:, None], law.D1[:, None]
        phi = np.zeros((len(w), 7, 7))
        phi[:, :3, 3:6] = D[..., None] * cone.hessian
        phi[:, :3, 6] = D1 * cone.gradient
        phi[:, 3:6, 6] = D1 * h_w
        phi += phi.mT
        phi[:, 3:6, 3:6] = D[..., None] * cone.third(w)
        phi[:, 6, 6] = law.D2 * w_g + of_s[:, 2] * law.push2
        return phi

    def _bent(self, summed: Summed, wrench: Array, w_turned: Array) -> Bent:
        """Add the second derivatives of w, s and d themselves to the chained Hessian."""
        soles, axes = self.soles, self.axes
        by_w, by_s = (axes @ force_matrix(wrench[:, :, i]).mT for i in range(2))
        turned = np.concatenate([w_turned, self.turned], -1)
        nested = soles.half * -(np.concatenate([by_w, by_s], -1) @ turned.mT)
        turn, levers = summed.levers[..., :3], summed.levers[..., 3:]
        spins = np.concatenate([w_turned[..., :3], self.turned[..., :3]], -1)
        mixed = spins @ levers.mT
        qq = 0.5 * summed.uu + nested + mixed
        qy = summed.uy - soles.upper * (by_s @ axes.mT)
        qy += levers[..., 3:] @ axes[..., :3].mT
        return Bent(qq, qy, summed.yy, turn)


class Summed(NamedTuple):
    """Second derivatives of phi, chained, summed over contacts, and levers p_q x (...) of forces.

    ``uu``, ``uy`` and ``yy`` have shape (N, feet, m, m), ``levers`` (N, feet, m, 9).
    """

    uu: Array
    uy: Array
    yy: Array
    levers: Array


class Bent(NamedTuple):
    """Second derivatives on the chains with respect to q and y = a + B v, (N, feet, m, m).

    ``qq`` is half of them: its transpose is to be added.
    ``turn`` (N, feet, m, 3) adds to :attr:`~.rigid_body.Halves.turn`.
    """

    qq: Array
    qy: Array
    yy: Array
    turn: Array
