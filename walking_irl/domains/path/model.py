"""Path of a walking person: dynamics, costs and their exact derivatives.

Model of Mombaur, Truong & Laumond (Autonomous Robots 28:369-383, 2010): a person at (x, y) with
heading theta accelerates forward, in rotation and sideways,

    x' = cos(theta) v_f - sin(theta) v_o,   y' = sin(theta) v_f + cos(theta) v_o,   theta' = omega,
    v_f' = u_1,   omega' = u_2,   v_o' = u_3,

and pays a_0 T + integral (a_1 u_1^2 + a_2 u_2^2 + a_3 u_3^2 + a_4 psi^2) dt, psi being the angle
between the heading and the direction of the goal. Controls are constant on N intervals of length
T/N, integrated by two steps of the explicit midpoint rule. Its updates are sums, so a whole batch
of walks is integrated, and differentiated backwards, without a loop over time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from walking_irl.arrays import Array

SUBSTEPS = 2
NEAR_GOAL = 0.3
"""psi has no meaning at the goal: psi^2 is faded out by r^2 / (r^2 + NEAR_GOAL^2) [m]."""


class Walks(NamedTuple):
    """A batch of B integrated walks with M = N * SUBSTEPS steps."""

    u: Array
    """Accelerations (forward, rotational, sideways) [m/s^2, rad/s^2, m/s^2], (B, M, 3)."""
    h: Array
    """Time step [s], shape (B,)."""
    v: Array
    """Velocities (v_f, omega, v_o), shape (B, M + 1, 3)."""
    v_mid: Array
    """Velocities in the middle of each step, shape (B, M, 3)."""
    theta: Array
    """Heading [rad], shape (B, M + 1)."""
    theta_mid: Array
    """Heading in the middle of each step, shape (B, M)."""
    xy: Array
    """Position [m], shape (B, M + 1, 2)."""

    @property
    def velocity(self) -> Array:
        """(x', y') in the middle of each step, shape (B, M, 2)."""
        c, s = np.cos(self.theta_mid), np.sin(self.theta_mid)
        forward, _, sideways = np.moveaxis(self.v_mid, -1, 0)
        return np.stack([c * forward - s * sideways, s * forward + c * sideways], axis=-1)

    @property
    def end(self) -> Array:
        """Final state (x, y, theta, v_f, omega, v_o), shape (B, 6)."""
        return np.concatenate([self.xy[:, -1], self.theta[:, -1:], self.v[:, -1]], axis=1)


def integrate(z: Array, n_sub: int = SUBSTEPS) -> Walks:
    """Walks from rest at the origin, facing +x.

    Args:
        z: Controls interval by interval, then the duration T [s]; shape (B, 3 N + 1).
        n_sub: Integration steps per interval.
    """
    u = np.repeat(z[:, :-1].reshape(len(z), -1, 3), n_sub, axis=1)
    h = z[:, -1] / u.shape[1]
    step = h[:, None, None]
    v = _sums(step * u)
    v_mid = v[:, :-1] + 0.5 * step * u
    theta = _sums(step * v_mid[..., 1:2])[..., 0]
    theta_mid = theta[:, :-1] + 0.5 * h[:, None] * v[:, :-1, 1]
    walks = Walks(u, h, v, v_mid, theta, theta_mid, np.empty(0))
    return walks._replace(xy=_sums(step * walks.velocity))


def costs(walks: Walks, goal: Array) -> Array:
    """F = (T, int u_1^2, int u_2^2, int u_3^2, int psi^2) of each walk, shape (B, 5)."""
    h, M = walks.h, walks.u.shape[1]
    p = _heading_cost(walks, goal)[0]
    efforts = h[:, None] * (walks.u**2).sum(axis=1)
    return np.column_stack([h * M, efforts, h * (p @ _trapezoid(M))])


def gradient(walks: Walks, goal: Array, on_costs: Array, on_end: Array) -> Array:
    """Gradient of on_costs.F + on_end.end in the controls and the duration, by the adjoint.

    Args:
        walks: B walks.
        goal: Position and heading aimed at, shape (3,).
        on_costs: Multipliers of the five costs, shape (B, 5).
        on_end: Multipliers of the six final states, shape (B, 6).

    Returns:
        Shape (B, 3 N + 1).
    """
    u, h, v, v_mid, _, theta_mid, _ = walks
    B, M = u.shape[:2]
    step = h[:, None, None]
    p, p_xy, p_theta = _heading_cost(walks, goal)
    share = (h * on_costs[:, 4])[:, None] * _trapezoid(M)
    g_xy, g_theta = share[..., None] * p_xy, share * p_theta
    g_xy[:, -1] += on_end[:, :2]
    g_theta[:, -1] += on_end[:, 2]
    g_h = (on_costs[:, 1:4] * (u**2).sum(axis=1)).sum(axis=1)
    g_h += on_costs[:, 4] * (p @ _trapezoid(M))
    g_u = 2 * step * u * on_costs[:, None, 1:4]

    later = _later_sums(g_xy)  # multiplies h (x', y')
    velocity = walks.velocity
    g_h += (later * velocity).sum(axis=(1, 2))
    c, s = np.cos(theta_mid), np.sin(theta_mid)
    g_mid = h[:, None] * (later[..., 1] * velocity[..., 0] - later[..., 0] * velocity[..., 1])
    g_v_mid = np.zeros_like(v_mid)
    g_v_mid[..., 0] = h[:, None] * (later[..., 0] * c + later[..., 1] * s)
    g_v_mid[..., 2] = h[:, None] * (later[..., 1] * c - later[..., 0] * s)

    g_theta[:, :-1] += g_mid
    g_v = np.zeros_like(v)
    g_v[:, :-1, 1] += 0.5 * h[:, None] * g_mid
    g_h += 0.5 * (v[:, :-1, 1] * g_mid).sum(axis=1)
    later_theta = _later_sums(g_theta)
    g_v_mid[..., 1] += h[:, None] * later_theta
    g_h += (v_mid[..., 1] * later_theta).sum(axis=1)

    g_v[:, :-1] += g_v_mid
    g_v[:, -1] += on_end[:, 3:]
    later_v = _later_sums(g_v)
    g_u += 0.5 * step * g_v_mid + step * later_v
    g_h += (u * (0.5 * g_v_mid + later_v)).sum(axis=(1, 2))
    per_interval = g_u.reshape(B, -1, SUBSTEPS, 3).sum(axis=2).reshape(B, -1)
    return np.column_stack([per_interval, on_costs[:, 0] + g_h / M])


def _sums(x: Array) -> Array:
    """Running sums along axis 1 that start at zero: (B, M, d) -> (B, M + 1, d)."""
    return np.concatenate([np.zeros_like(x[:, :1]), np.cumsum(x, axis=1)], axis=1)


def _later_sums(g: Array) -> Array:
    """Sum of all later entries along axis 1: (B, M + 1, ...) -> (B, M, ...)."""
    sums: Array = np.cumsum(g[:, :0:-1], axis=1)[:, ::-1]
    return sums


def _trapezoid(M: int) -> Array:
    """Weights of the trapezoidal rule, shape (M + 1,).

    The last is 0: a walk ends at its goal, where psi^2 is faded to 0 but has a kink.
    """
    weights = np.ones(M + 1)
    weights[0], weights[-1] = 0.5, 0.0
    return weights


def _heading_cost(walks: Walks, goal: Array) -> tuple[Array, Array, Array]:
    """Faded psi^2 at each node, (B, M + 1), and its derivatives in (x, y) and theta."""
    to_goal = goal[:2] - walks.xy
    r2 = np.maximum((to_goal**2).sum(axis=-1), 1e-12)
    psi = np.arctan2(to_goal[..., 1], to_goal[..., 0]) - walks.theta
    psi = (psi + np.pi) % (2 * np.pi) - np.pi
    fade = r2 / (r2 + NEAR_GOAL**2)
    turn = np.stack([to_goal[..., 1], -to_goal[..., 0]], axis=-1) / r2[..., None]
    d_fade = -2 * to_goal * (NEAR_GOAL**2 / (r2 + NEAR_GOAL**2) ** 2)[..., None]
    d_xy = (2 * fade * psi)[..., None] * turn + (psi**2)[..., None] * d_fade
    return fade * psi**2, d_xy, -2 * fade * psi
