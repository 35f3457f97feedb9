"""A periodic, mirror-symmetric gait: joint angles at the knots of half a cycle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError


@dataclass(frozen=True)
class Gait:
    r"""Half a gait cycle; the other half is its mirror image one step further on.

    .. math:: q_{i+N} = S q_i + L e_x

    Velocities and accelerations follow by the differences that semi-implicit Euler integration
    implies, :math:`v_i = (q_i - q_{i-1})/h` and :math:`a_i = (v_{i+1} - v_i)/h`, so that a gait
    whose root forces vanish *is* a trajectory of ``mj_step`` with timestep ``h``.

    Attributes:
        q: Joint positions at the knots [m, rad], shape (N, nv).
        step_length: Distance L walked in half a cycle [m].
        half_period: Duration T of half a cycle [s].
    """

    q: Array
    step_length: float
    half_period: float

    @property
    def n_knots(self) -> int:
        """Number of knots N of half a cycle."""
        return len(self.q)

    @property
    def timestep(self) -> float:
        """Time h between knots [s]."""
        return self.half_period / self.n_knots

    @property
    def speed(self) -> float:
        """Walking speed [m/s]."""
        return self.step_length / self.half_period

    def to_vector(self) -> Array:
        """Unknowns of the optimal control problem: q row by row, L, T; shape (N nv + 2,)."""
        return np.concatenate([self.q.ravel(), [self.step_length, self.half_period]])

    @classmethod
    def from_vector(cls, x: Array, nv: int) -> Gait:
        """Inverse of :meth:`to_vector`."""
        if (x.size - 2) % nv:
            raise InvalidInputError(
                f"a gait of {nv} joints needs a vector of n x {nv} + 2 numbers, got {x.size}"
            )
        return cls(x[:-2].reshape(-1, nv).copy(), float(x[-2]), float(x[-1]))


def whole_cycle(gait: Gait, mirror: Array) -> Array:
    """Joint positions of both halves of the cycle, shape (2 N, nv).

    Args:
        gait: Half a cycle.
        mirror: Matrix S that swaps the sides of the body, shape (nv, nv).
    """
    other = gait.q @ mirror.T
    other[:, 0] += gait.step_length
    return np.vstack([gait.q, other])


def cycle_motion(gait: Gait, mirror: Array) -> tuple[Array, Array, Array]:
    """Positions, velocities and accelerations of a whole cycle, each of shape (2 N, nv)."""
    q = whole_cycle(gait, mirror)
    h = gait.timestep
    advance = np.zeros(q.shape[1])
    advance[0] = 2 * gait.step_length
    ahead = np.vstack([q[1:], q[:1] + advance])
    behind = np.vstack([q[-1:] - advance, q[:-1]])
    return q, (q - behind) / h, (ahead - 2 * q + behind) / h**2
