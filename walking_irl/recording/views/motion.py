"""Walks resampled to frames: poses, ground forces and joint angles ready to be logged."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from walking_irl.arrays import Array
from walking_irl.errors import InvalidInputError
from walking_irl.recording.style import PLAYBACK_RATE
from walking_irl.recording.views.body_geometry import wxyz_to_xyzw
from walking_irl.types import Rollout


@dataclass(frozen=True)
class Frames:
    """A walk at the playback's rate, n frames.

    Attributes:
        q: Joint positions [m, rad], shape (n, nv).
        position: Of every body in the world [m], shape (n, nbody, 3).
        orientation: Of every body, xyzw, shape (n, nbody, 4).
        com: Centre of mass [m], shape (n, 3).
        n_contacts: Loaded bodies of each frame, shape (n,).
        force_at: Centres of pressure [m], one per loaded body, shape (sum(n_contacts), 3).
        force: Resultant ground forces [N], shape (sum(n_contacts), 3).
    """

    q: Array
    position: Array
    orientation: Array
    com: Array
    n_contacts: Array
    force_at: Array
    force: Array

    def __len__(self) -> int:
        return len(self.q)

    def part(self, n: int, start: float) -> Frames:
        """The first ``n`` frames, moved on by ``start`` in x [m]."""
        forward, loaded = np.array([start, 0.0, 0.0]), int(self.n_contacts[:n].sum())
        q = self.q[:n].copy()
        q[:, 0] += start
        return Frames(
            q,
            self.position[:n] + forward,
            self.orientation[:n],
            self.com[:n] + forward,
            self.n_contacts[:n],
            self.force_at[:loaded] + forward,
            self.force[:loaded],
        )


def check_rollout(model: mujoco.MjModel, rollout: Rollout) -> None:
    """Raise InvalidInputError unless a rollout has samples of this model's joints."""
    T = len(rollout.time)
    for name in ("q", "v", "a"):
        got = np.shape(getattr(rollout, name))
        if T < 2 or got != (T, model.nv):
            raise InvalidInputError(
                f"rollout.{name} must have shape (T, {model.nv}) with T = {T} >= 2, got {got}"
            )
    if not all(np.isfinite(getattr(rollout, name)).all() for name in ("time", "q", "v", "a")):
        raise InvalidInputError("a rollout to be shown must be finite")


def periodic_rollout(q: Array, v: Array, a: Array, timestep: float, stride: float) -> Rollout:
    """One whole gait cycle as a rollout that ends with its first knot, one stride further on.

    Takes what ``gait.cycle_motion`` returns.

    Args:
        q: Positions at the knots of a whole cycle, x first, shape (N, nv).
        v: Velocities, shape (N, nv).
        a: Accelerations, shape (N, nv).
        timestep: Time between knots [s].
        stride: Distance walked in the cycle [m].
    """
    closing = q[:1].copy()
    closing[:, 0] += stride
    T = len(q) + 1
    return Rollout(
        time=timestep * np.arange(T, dtype=np.float64),
        q=np.vstack([q, closing]),
        v=np.vstack([v, v[:1]]),
        a=np.vstack([a, a[:1]]),
        u=np.empty((T, 0)),
        sensors=np.empty((T, 0)),
    )


def sample(rollout: Rollout, n_frames: int) -> tuple[Array, Array, Array]:
    """Positions, velocities and accelerations of ``n_frames`` frames from the rollout's start.

    A rollout that is too short is repeated from its beginning, moved on in x (its first joint) by
    the distance that it covers, so it should hold whole gait cycles.
    """
    elapsed = np.arange(n_frames) / PLAYBACK_RATE
    length = rollout.time[-1] - rollout.time[0]
    lap, t = np.divmod(elapsed, length)
    q, v, a = (
        _interpolate(t + rollout.time[0], rollout.time, x)
        for x in (rollout.q, rollout.v, rollout.a)
    )
    q[:, 0] += lap * (rollout.q[-1, 0] - rollout.q[0, 0])
    return q, v, a


def _interpolate(t: Array, time: Array, x: Array) -> Array:
    return np.stack([np.interp(t, time, column) for column in x.T], axis=1)


def play(model: mujoco.MjModel, rollout: Rollout, n_frames: int, start: float) -> Frames:
    """Poses and ground forces of ``n_frames`` frames, the walk moved to begin at x = ``start``.

    Forces come from inverse dynamics: what the soft contacts exert at this motion.
    """
    q, v, a = sample(rollout, n_frames)
    q[:, 0] += start - q[0, 0]
    data = mujoco.MjData(model)
    position = np.empty((n_frames, model.nbody, 3))
    orientation = np.empty((n_frames, model.nbody, 4))
    com, pressed = np.empty((n_frames, 3)), []
    for i in range(n_frames):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[i], v[i], a[i]
        mujoco.mj_inverse(model, data)
        position[i], orientation[i], com[i] = data.xpos, data.xquat, data.subtree_com[1]
        pressed.append(_ground_forces(model, data))
    flat = np.array([row for rows in pressed for row in rows]).reshape(-1, 2, 3)
    return Frames(
        q, position, wxyz_to_xyzw(orientation), com,
        np.array([len(rows) for rows in pressed]), flat[:, 0], flat[:, 1],
    )  # fmt: skip


def _ground_forces(model: mujoco.MjModel, data: mujoco.MjData) -> list[tuple[Array, Array]]:
    """Centre of pressure and resultant force of every body that touches the world."""
    total: dict[int, Array] = {}
    moment: dict[int, Array] = {}
    wrench = np.empty(6)
    for c in range(data.ncon):
        contact = data.contact[c]
        bodies = [int(model.geom_bodyid[g]) for g in contact.geom]
        if 0 not in bodies or bodies == [0, 0]:
            continue
        mujoco.mj_contactForce(model, data, c, wrench)
        force = contact.frame.reshape(3, 3).T @ wrench[:3]  # from geom 0 onto geom 1
        force = force if bodies[0] == 0 else -force
        body = max(bodies)
        total[body] = total.get(body, np.zeros(3)) + force
        moment[body] = moment.get(body, np.zeros(3)) + max(force[2], 0.0) * contact.pos
    loaded = [b for b in total if total[b][2] > 1.0]
    return [(moment[b] / total[b][2], total[b]) for b in loaded]
