r"""Walks a gait in forward dynamics: a periodic time-varying linear-quadratic regulator.

.. math:: u = \operatorname{clip}\bigl(u_k - K_k (x - x_k)\bigr), \qquad x = (q, v)

with the gait's own torques :math:`u_k` as feed-forward and the gains of the linearised dynamics
:math:`\delta x_{k+1} = A_k \delta x_k + B_k \delta u_k` (``mjd_transitionFD``) along it. The gait
is mirror-symmetric, so the Riccati equation is swept over half a cycle:
:math:`P_{k+N} = S P_k S`, and a cycle's gains follow by the mirror. The sweep is repeated until P
stands: S. Bittanti, P. Colaneri, G. De Nicolao (1991), The periodic Riccati equation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
import scipy.linalg as sl

from walking_irl.arrays import Array
from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.body.physics import inverse_dynamics
from walking_irl.domains.humanoid.gait.cycles import drifting_spline
from walking_irl.domains.humanoid.gait.gait import Gait, cycle_motion
from walking_irl.errors import InvalidInputError, SolverError

POSITION_COST, VELOCITY_COST = 100.0, 0.1  # [1/rad^2], [s^2/rad^2]
PLACE_COST = 10.0  # on the root's x and y: where it walks matters less than how [1/m^2]
PLACE = ("root_x", "root_y")
TORQUE_COST = 1e-3  # [1/(Nm)^2]
DIFFERENCE_STEP = 1e-6
MAX_SWEEPS, SWEEP_TOLERANCE = 32, 1e-5


class Reference(NamedTuple):
    """What is tracked over one cycle: positions, velocities (K, nv) and torques (K, nu)."""

    q: Array
    v: Array
    u: Array


@dataclass(frozen=True, eq=False)
class TrackingPolicy:
    """Torques that keep a walker on a gait; plain data, picklable.

    Attributes:
        reference: The gait at each of the K steps of a cycle.
        gain: Feedback gains, shape (K, nu, 2 nv).
        bias: u_k + K_k x_k: torques at x = 0, shape (K, nu).
        lower: Smallest torques [Nm], shape (nu,).
        upper: Largest torques [Nm], shape (nu,).
        timestep: Time between steps [s].
        stride: Distance walked in a cycle [m].
        floquet: Largest multiplier of a deviation over one cycle, to first order; below 1 the gait
            is stable.
    """

    reference: Reference
    gain: Array
    bias: Array
    lower: Array
    upper: Array
    timestep: float
    stride: float
    floquet: float

    @property
    def steps_per_cycle(self) -> int:
        """Number of steps K of one gait cycle."""
        return len(self.bias)

    @property
    def period(self) -> float:
        """Duration of one gait cycle [s]."""
        return self.timestep * self.steps_per_cycle

    def torque(self, k: int, q: Array, v: Array) -> Array:
        """Joint torques at step ``k``, counted from the gait's first knot.

        Args:
            k: Step >= 0, of any cycle.
            q: Joint positions [m, rad], shape (nv,).
            v: Joint velocities [m/s, rad/s], shape (nv,).

        Returns:
            Torques [Nm], shape (nu,).
        """
        cycle, i = divmod(k, len(self.bias))
        x = np.concatenate((q, v))
        x[0] -= cycle * self.stride
        u: Array = self.bias[i] - self.gain[i] @ x
        np.maximum(u, self.lower, out=u)
        return np.minimum(u, self.upper, out=u)


def tracking_policy(walker: Walker, gait: Gait, *, substeps: int = 1) -> TrackingPolicy:
    """Design the policy that walks a gait.

    Args:
        walker: Who walks.
        gait: What to walk.
        substeps: Simulation steps per knot. With 1 the simulated gait is the gait itself, and
            measures its objectives; 2 or more is a finer simulation, for pushes and pictures.

    Raises:
        InvalidInputError: If there is no whole positive number of substeps.
        SolverError: If the gains do not converge.
    """
    if substeps < 1:
        raise InvalidInputError(f"substeps must be 1 or more, got {substeps}")
    reference = _reference(walker, gait, substeps)
    timestep = gait.timestep / substeps
    A, B = _linearise(walker, reference, timestep)
    half, floquet = _gains(walker, A, B, timestep)
    both = _mirror_twice(walker.mirror)
    gain = np.concatenate([half, walker.torque_mirror @ half @ both])
    state = np.hstack([reference.q, reference.v])
    return TrackingPolicy(
        reference=reference,
        gain=gain,
        bias=reference.u + np.einsum("kux,kx->ku", gain, state),
        lower=walker.model.actuator_ctrlrange[:, 0].copy(),
        upper=walker.model.actuator_ctrlrange[:, 1].copy(),
        timestep=timestep,
        stride=2 * gait.step_length,
        floquet=floquet,
    )


def _reference(walker: Walker, gait: Gait, substeps: int) -> Reference:
    """The gait's states and torques on the grid of the simulation."""
    q, v, a = cycle_motion(gait, walker.mirror)
    half, _ = inverse_dynamics(walker, *(x[: gait.n_knots] for x in (q, v, a)))
    u = half[:, walker.n_root :]
    u = np.vstack([u, u @ walker.torque_mirror.T])
    return Reference(q, v, u) if substeps == 1 else _refine(gait, q, u, substeps)


def _refine(gait: Gait, q: Array, u: Array, substeps: int) -> Reference:
    """Periodic cubic splines through the knots, sampled ``substeps`` times as often."""
    drift = np.zeros(q.shape[1])
    drift[0] = gait.speed
    period = len(q) * gait.timestep
    q_t = drifting_spline(q, period, drift)
    u_t = drifting_spline(u, period, np.zeros(u.shape[1]))
    time = np.arange(len(q) * substeps) * gait.timestep / substeps
    return Reference(q_t(time)[0], q_t(time)[1], u_t(time)[0])


def _linearise(walker: Walker, reference: Reference, timestep: float) -> tuple[Array, Array]:
    """A (N, n, n) and B (N, n, nu) of one simulation step, along half a cycle; n = 2 nv."""
    model = walker.model_at(timestep)
    data = mujoco.MjData(model)
    steps, n = len(reference.q) // 2, 2 * model.nv
    A, B = np.empty((steps, n, n)), np.empty((steps, n, model.nu))
    for k in range(steps):
        data.qpos[:], data.qvel[:], data.ctrl[:] = (part[k] for part in reference)
        data.qacc_warmstart[:] = 0  # else the result would depend on the step before
        mujoco.mj_forward(model, data)
        data.qacc_warmstart[:] = data.qacc
        mujoco.mjd_transitionFD(model, data, DIFFERENCE_STEP, True, A[k], B[k], None, None)
    return A, B


def _gains(walker: Walker, A: Array, B: Array, timestep: float) -> tuple[Array, float]:
    """Gains (N, nu, n) of half a cycle, and the largest Floquet multiplier of a whole one."""
    nv, nu = walker.model.nv, walker.model.nu
    mirror = _mirror_twice(walker.mirror)
    state_cost = np.repeat([POSITION_COST, VELOCITY_COST], nv)
    state_cost[[walker.joints.index(j) for j in PLACE if j in walker.joints]] = PLACE_COST
    Q, R = np.diag(state_cost) * timestep, np.eye(nu) * TORQUE_COST * timestep
    P: Array = Q
    gain = np.empty((len(A), nu, 2 * nv))
    for _ in range(MAX_SWEEPS):
        before, P = P, mirror @ P @ mirror
        for k in reversed(range(len(A))):
            BP = B[k].T @ P
            gain[k] = sl.solve(R + BP @ B[k], BP @ A[k], assume_a="pos", check_finite=False)
            P = Q + A[k].T @ P @ (A[k] - B[k] @ gain[k])
            P = (P + P.T) / 2
        if np.linalg.norm(P - before) < SWEEP_TOLERANCE * np.linalg.norm(P):
            break
    else:
        raise SolverError(f"the gains of the gait do not settle within {MAX_SWEEPS} sweeps")
    step = np.eye(2 * nv)
    for k in range(len(A)):
        step = (A[k] - B[k] @ gain[k]) @ step
    return gain, float(np.abs(np.linalg.eigvals(mirror @ step)).max() ** 2)


def _mirror_twice(mirror: Array) -> Array:
    return np.asarray(np.kron(np.eye(2), mirror), dtype=float)
