r"""MuJoCo's soft contact of a sphere on the ground: impedance, and the elliptic friction cone.

With s the contact's acceleration minus its reference, normal component last, T = |s_t| and friction
mu, the force is -D(d) times the gradient of

.. math:: \psi = \begin{cases} 0 & s_n \ge \mu T \\ |s|^2/2 & \mu s_n + T \le 0 \\
          (s_n - \mu T)^2 / 2(1 + \mu^2) & \text{else} \end{cases}

at D = imp/((1 - imp) diag). It is once continuously differentiable: the Hessian jumps at the
borders. E. Todorov (2014), Convex and analytically-invertible dynamics with contacts and
constraints, ICRA; MuJoCo's documentation, chapter Computation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array, Indices
from walking_irl.domains.humanoid.optimiser.dynamics.spatial import outer, times

_EYE = np.eye(2)


class Cone:
    """Gradient and Hessian of psi at n contacts.

    Attributes:
        gradient: Shape (n, 3).
        hessian: Shape (n, 3, 3).
        is_middle, is_bottom: Which of the three cases holds, shape (n,).
    """

    def __init__(self, s: Array, mu: Array) -> None:
        t, normal = s[:, :2], s[:, 2]
        T = np.hypot(t[:, 0], t[:, 1])
        top = normal >= mu * T
        self.is_bottom = ~top & (mu * normal + T <= 0)
        self.is_middle = ~top & ~self.is_bottom
        self.mu, self.T = mu, np.where(T > 0, T, 1.0)
        self.along = t / self.T[:, None]
        self.depth = normal - mu * T
        self.slope = np.column_stack([-mu[:, None] * self.along, np.ones(len(s))])
        k = self.is_middle / (1 + mu * mu)
        bottom = np.where(self.is_bottom[:, None], s, 0.0)
        self.gradient = (k * self.depth)[:, None] * self.slope + bottom
        self.hessian = k[:, None, None] * outer(self.slope, self.slope)
        bend = (-mu * k * self.depth / self.T)[:, None, None]
        self.hessian[:, :2, :2] += bend * (_EYE - outer(self.along, self.along))
        self.hessian[self.is_bottom] = np.eye(3)

    def third(self, w: Array) -> Array:
        """Third derivative of psi contracted with ``w`` (n, 3), shape (n, 3, 3)."""
        u, wt = self.along, w[:, :2]
        across = _EYE - outer(u, u)
        w_across, w_along = times(across, wt), np.sum(u * wt, -1)[:, None, None]
        hessian = (-self.mu / self.T)[:, None, None] * across  # of the depth
        turn = outer(w_across, u)
        third = (self.mu / self.T**2)[:, None, None] * (w_along * across + turn + turn.mT)
        h_w = np.column_stack([times(hessian, wt), np.zeros(len(w))])
        both = outer(h_w, self.slope)
        out = both + both.mT
        along = np.sum(self.slope * w, -1)[:, None, None]
        out[:, :2, :2] += along * hessian + self.depth[:, None, None] * third
        return np.asarray((self.is_middle / (1 + self.mu**2))[:, None, None] * out)


class Softness(NamedTuple):
    """Parameters of n spheres' contacts with the ground, each of shape (n,); ``damping`` is shared.

    ``margin`` [m]: below this distance the contact is active; ``low``, ``high``, ``width`` [m]: the
    impedance; ``stiffness`` [1/s^2] and ``damping`` [1/s] of the reference; ``mu``: friction;
    ``weight``: approximate inverse mass at the contact [1/kg].
    """

    margin: Array
    low: Array
    high: Array
    width: Array
    stiffness: Array
    damping: float
    mu: Array
    weight: Array

    def take(self, i: Indices) -> Softness:
        """The parameters of some contacts."""
        some = {k: f[i] for k, f in self._asdict().items() if k != "damping"}
        return Softness(**some, damping=self.damping)

    def laws(self, d: Array) -> Laws:
        """Force factor and reference acceleration at distances ``d`` [m], with derivatives."""
        x = np.clip((self.margin - d) / self.width, 0, 1)
        low = x < 0.5
        span = self.high - self.low
        imp = self.low + span * np.where(low, 2 * x * x, 1 - 2 * (1 - x) ** 2)
        i1 = -span * np.where(low, 4 * x, 4 * (1 - x)) / self.width
        i2 = span * np.where(low, 4.0, np.where(x < 1, -4.0, 0.0)) / self.width**2
        rest, depth = 1 - imp, d - self.margin
        return Laws(
            D=imp / (rest * self.weight),
            D1=i1 / (rest**2 * self.weight),
            D2=(i2 / rest**2 + 2 * i1**2 / rest**3) / self.weight,
            push=self.stiffness * imp * depth,
            push1=self.stiffness * (imp + i1 * depth),
            push2=self.stiffness * (2 * i1 + i2 * depth),
        )


class Laws(NamedTuple):
    """D = imp/((1 - imp) weight) and the reference's push K imp (d - margin), with derivatives."""

    D: Array
    D1: Array
    D2: Array
    push: Array
    push1: Array
    push2: Array
