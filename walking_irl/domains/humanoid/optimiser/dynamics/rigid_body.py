r"""Inverse dynamics of a tree of hinges and slides: first and second derivatives, without contact.

For dof j, with velocity V-, acceleration A- (minus gravity) and multiplied motion W- of what
carries it, and S_j its axis:

.. math:: P_j = V^-_j \times S_j, \quad R_j = A^-_j \times S_j + V^-_j \times P_j,
          \quad \Omega_j = W^-_j \times S_j, \quad W_b = \sum_{k \text{ carries } b} \lambda_k S_k

Composites, sums over the bodies that a dof moves: inertia I; f = IA + V x* IV; h = IW; p = B'W;
B = 1/2[(V x*)I - I(V x) + (IV) x*bar] and G = 1/2[I(W x) + (I(W x))' + (IW) x*bar], where
x*bar(f) v = v x* f.

First derivatives, where j carries i (those of tau_i also where j is i):

==============  ===================================
d tau_i/d q_j   2 (B_i'S_i).P_j + (I_i S_i).R_j
d tau_j/d q_i   S_j.(2 B_i P_i + I_i R_i + S_i x* f_i)
d tau_i/d v_j   2 (B_i'S_i).S_j + 2 (I_i S_i).P_j
d tau_j/d v_i   S_j.(2 B_i S_i + 2 I_i P_i)
==============  ===================================

Second derivatives of lambda.tau are listed at :meth:`RigidBody.curvature`.
S. Singh, R. Russell, P. Wensing (2022), Efficient analytical derivatives of rigid-body dynamics
using spatial vector algebra, IEEE RA-L 7; derived anew for these composites.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.optimiser.dynamics.spatial import (
    force_cross,
    force_matrix,
    motion_cross,
    motion_matrix,
    times,
)
from walking_irl.domains.humanoid.optimiser.dynamics.tree import Snapshot, Tree


class Halves(NamedTuple):
    """Second derivatives of a sum of multiplied quantities, still to be mirrored.

    ``qq``, ``qv``, ``qa`` and ``vv`` hold at [j, k] what is true where j carries k or is k, ``vq``
    and ``aq`` what is true where j carries k; shapes (N, nv, nv). ``turn`` (N, nv, 3) are moments
    m_k of terms S_j.m_k of ``qq``: what turns with j while k moves it.
    """

    qq: Array
    qv: Array
    qa: Array
    vv: Array
    vq: Array
    aq: Array
    turn: Array


class RigidBody:
    """Motion of all bodies at N knots, and the derivatives of the rigid part of inverse dynamics.

    Attributes:
        V, A: Velocity and acceleration (minus gravity) of every body, shape (N, nb, 6).
        P, R: What the axes' motion adds, see the module, shape (N, nv, 6).
        inertia: Composite inertias I, shape (N, nv, 6, 6).
        I_S, I_P: Composite inertia times axis and times P, shape (N, nv, 6).
        momentum: Momentum of the whole tree, shape (N, 6).
        momentum_q: Derivative of the momentum with respect to q, shape (N, nv, 6).
        tau_q, tau_v, tau_a: Derivatives of the rigid torques, output first, (N, nv, nv).
    """

    def __init__(self, tree: Tree, at: Snapshot, v: Array, a: Array) -> None:
        self.tree, self.at = tree, at
        axes, before = at.axes, tree.strictly.T
        moved = axes * v[..., None]
        v_before = before @ moved
        self.P = motion_cross(v_before, axes)
        gained = axes * a[..., None] + self.P * v[..., None]
        a_before = before @ gained + tree.gravity
        on = tree.moves.T @ np.concatenate([moved, gained], -1)
        self.V, self.A = on[..., :6], on[..., 6:] + tree.gravity
        self.R = motion_cross(a_before, axes) + motion_cross(v_before, self.P)
        self._composites()
        self._first()

    def _composites(self) -> None:
        n, nb, nv = len(self.V), self.tree.nb, self.tree.nv
        inertia, V = self.at.inertia, self.V
        h = times(inertia, V)
        force = times(inertia, self.A) + force_cross(V, h)
        ivx = inertia @ motion_matrix(V)
        self.B_body = 0.5 * (force_matrix(h) - ivx.mT - ivx)  # (V x*) I = -(I (V x))'
        flat = [inertia.reshape(n, nb, 36), self.B_body.reshape(n, nb, 36), force, h]
        whole = self.tree.moves @ np.concatenate(flat, -1)
        self.inertia = whole[..., :36].reshape(n, nv, 6, 6)
        self.B = whole[..., 36:72].reshape(n, nv, 6, 6)
        self.force, self.h = whole[..., 72:78], whole[..., 78:]
        self.momentum = h.sum(1)

    def _first(self) -> None:
        tree, axes, nv = self.tree, self.at.axes, self.tree.nv
        three = np.stack([axes, self.P, self.R], -1)
        self.I_S, self.I_P, i_r = np.moveaxis(self.inertia @ three, -1, 0)
        b_s, b_p = np.moveaxis(self.B @ three[..., :2], -1, 0)
        bt_s = 2 * times(self.B.mT, axes)
        turned = force_cross(axes, np.stack([self.force, self.h]))
        self.force_q = 2 * b_p + i_r + turned[0]
        self.force_v = 2 * (b_s + self.I_P)
        self.momentum_q = turned[1] + self.I_P
        left_q = np.concatenate([bt_s, self.I_S], -1)
        left_v = np.concatenate([bt_s, 2 * self.I_S], -1)
        lower_q = left_q @ np.concatenate([self.P, self.R], -1).mT
        lower_v = left_v @ np.concatenate([axes, self.P], -1).mT
        upper = axes @ np.concatenate([self.force_q, self.force_v], 1).mT
        carried = tree.carries.T
        self.tau_q = carried * lower_q + tree.strictly * upper[..., :nv]
        self.tau_v = carried * lower_v + tree.strictly * upper[..., nv:]
        mass = carried * (self.I_S @ axes.mT)
        self.tau_a = mass + mass.mT
        i = np.arange(nv)
        self.tau_a[:, i, i] = mass[:, i, i]

    def curvature(self, multiplied: Array, angular: Array) -> tuple[Halves, Array, Array]:
        r"""Second derivatives of lambda.tau plus m.(angular momentum at the fixed origin).

        For j carrying k, or j = k (``aq`` and ``vq`` also serve where k carries j):

        ====  =================================================
        q q   2 P_j.Dp_k + R_j.Dh_k + Omega_j.(df/dq)_k
        v v   2 S_j.G_k S_k
        q v   2 P_j.G_k S_k + Omega_j.(df/dv)_k
        v q   2 (S_j.Dp_k + P_j.Dh_k)
        q a   Omega_j.I_k S_k
        a q   S_j.Dh_k
        ====  =================================================

        with Dh = S x* h + I Omega, Dp = S x* p + B' Omega + G P.

        Args:
            multiplied: S_j lambda_j, shape (N, nv, 6).
            angular: m, multiplier of the angular momentum, shape (N, 3).

        Returns:
            The halves, W of every body (N, nb, 6), and Omega (N, nv, 6).
        """
        tree, axes = self.tree, self.at.axes
        P, R = self.P, self.R
        W = tree.moves.T @ multiplied
        omega = motion_cross(tree.strictly.T @ multiplied, axes)
        d_h, d_p, g_s = self._multiplied_composites(W, omega)
        m = np.concatenate([angular, np.zeros_like(angular)], -1)
        s_m = -(axes @ motion_matrix(m).mT)  # S x m
        back = force_cross(axes, times(self.inertia, m[:, None])) - times(self.inertia, s_m)
        qq = _dot([2 * P, R, omega, -s_m, P], [d_p, d_h, self.force_q, self.momentum_q, back])
        halves = Halves(
            qq=qq,
            qv=_dot([2 * P, omega, -s_m], [g_s, self.force_v, self.I_S]),
            qa=omega @ self.I_S.mT,
            vv=2 * axes @ g_s.mT,
            vq=_dot([2 * axes, 2 * P, axes], [d_p, d_h, back]),
            aq=axes @ d_h.mT,
            turn=np.zeros((*axes.shape[:2], 3)),
        )
        return halves, W, omega

    def _multiplied_composites(self, W: Array, omega: Array) -> tuple[Array, Array, Array]:
        """Dh, Dp and G S of every dof, each of shape (N, nv, 6)."""
        n, nb, nv = len(W), self.tree.nb, self.tree.nv
        h, p = times(self.at.inertia, W), times(self.B_body.mT, W)
        iwx = self.at.inertia @ motion_matrix(W)
        G = 0.5 * (iwx + iwx.mT + force_matrix(h))
        whole = self.tree.moves @ np.concatenate([G.reshape(n, nb, 36), h, p], -1)
        G = whole[..., :36].reshape(n, nv, 6, 6)
        turned = force_cross(self.at.axes, np.stack([whole[..., 36:42], whole[..., 42:]]))
        g_s, g_p = np.moveaxis(G @ np.stack([self.at.axes, self.P], -1), -1, 0)
        d_h = turned[0] + times(self.inertia, omega)
        return d_h, turned[1] + times(self.B.mT, omega) + g_p, g_s


def _dot(left: list[Array], right: list[Array]) -> Array:
    """Sum of left_j.right_k over pairs of vectors, shape (N, nv, nv)."""
    return np.asarray(np.concatenate(left, -1) @ np.concatenate(right, -1).mT)
