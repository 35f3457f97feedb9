"""Walks of a policy in the environment, recorded, and the gait that they show on average."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.body.physics import WalkerPhysics
from walking_irl.domains.humanoid.closed_loop.disturbance import Disturbance, Push
from walking_irl.domains.humanoid.closed_loop.environment import WalkTask, environment
from walking_irl.domains.humanoid.closed_loop.policy import TrackingPolicy
from walking_irl.domains.humanoid.closed_loop.step import Start, Step
from walking_irl.domains.humanoid.gait.cycles import mirror_average
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.errors import FallError, InvalidInputError
from walking_irl.types import Rollout


def rollout(
    walker: Walker,
    policy: TrackingPolicy,
    *,
    cycles: int | None = None,
    seconds: float | None = None,
    rng: np.random.Generator | None = None,
    velocity_noise: float = 0.0,
    kicks: float = 0.0,
    push: Push | None = None,
    raise_on_fall: bool = True,
) -> Rollout:
    """Walk from the gait's first knot, and record every step.

    Args:
        walker: Who walks.
        policy: The controller.
        cycles: Gait cycles to walk; either this or ``seconds``.
        seconds: Time to walk [s].
        rng: Source of noise and kicks; needed for those only.
        velocity_noise: Standard deviation of the joints' velocities at the start [rad/s].
        kicks: The same of changes at a random step of every cycle [rad/s].
        push: A push against the pelvis.
        raise_on_fall: Whether a fall is an error, or just ends the recording.

    Returns:
        The walk, with one sample more than steps asked for: it closes the last step.

    Raises:
        FallError: If the walker falls.
        InvalidInputError: If the arguments contradict each other.
    """
    if rng is None and (velocity_noise > 0 or kicks > 0):
        raise InvalidInputError("noise and kicks need a random generator: give rng")
    course = Course(walker, policy, Disturbance(velocity_noise, kicks, push))
    return course.walk(
        rng or np.random.default_rng(0),
        cycles=cycles,
        seconds=seconds,
        raise_on_fall=raise_on_fall,
    )


class Course:
    """Where a walker walks a gait again and again, each time from its first knot.

    Args:
        walker: Who walks.
        policy: The controller.
        disturbance: Noise, kicks and pushes.
    """

    def __init__(self, walker: Walker, policy: TrackingPolicy, disturbance: Disturbance) -> None:
        self.walker, self.policy = walker, policy
        reference = policy.reference
        start = Start(
            reference.q[0],
            reference.v[0],
            policy.timestep,
            policy.period,
            policy.stride / policy.period,
        )
        rng = np.random.default_rng(0)
        self._env = environment(walker, start, rng=rng, disturbance=disturbance)
        self._task: WalkTask = self._env.task
        self._physics: WalkerPhysics = self._env.physics

    def walk(
        self,
        rng: np.random.Generator,
        *,
        cycles: int | None = None,
        seconds: float | None = None,
        raise_on_fall: bool = True,
    ) -> Rollout:
        """One walk; see :func:`rollout`."""
        n_samples = 1 + _n_steps(self.policy, cycles, seconds)
        steps, fell = self._steps(rng, n_samples)
        timestep = self.policy.timestep
        if fell and raise_on_fall:
            raise self._fall(len(steps) * timestep)
        parts = zip(*steps, strict=True)
        q, v, a, u, sensors = (np.concatenate(part).reshape(len(steps), -1) for part in parts)
        return Rollout(timestep * np.arange(len(steps), dtype=float), q, v, a, u, sensors)

    def _steps(self, rng: np.random.Generator, n_samples: int) -> tuple[list[Step], bool]:
        """Steps walked, and whether the walker fell; nobody observes them, nobody is rewarded."""
        steps: list[Step] = []
        task, physics, policy = self._task, self._physics, self.policy
        task.random = np.random.RandomState(rng.bit_generator)
        self._env.reset()
        q, v = physics.data.ptr.qpos, physics.data.ptr.qvel
        for k in range(n_samples):
            task.before_step(policy.torque(k, q, v), physics)
            physics.step()
            step = task.after_step(physics)
            if not physics.has_diverged or not steps:  # of a step that is lost nothing is known
                steps.append(step)
            if task.has_fallen(physics):
                return steps, True
        return steps, False

    def _fall(self, time: float) -> FallError:
        if self._physics.has_diverged:
            told = "torques moved it faster than a timestep resolves"
            return FallError(f"the walker fell after {time:.2f} s: {told}", time)
        q, joints = self._physics.data.ptr.qpos, self.walker.joints
        height, pitch = (q[joints.index(j)] for j in ("root_z", "root_pitch"))
        return FallError(
            f"the walker fell after {time:.2f} s: pelvis {100 * -height:.0f} cm below standing, "
            f"pitched by {np.degrees(pitch):.0f} degrees",
            time,
        )


def averaged_gait(
    walker: Walker,
    rollouts: Sequence[Rollout],
    gait: Gait,
    *,
    skip: int = 2,
    substeps: int = 1,
) -> Gait:
    """Mean gait of recorded rollouts: over cycles, and over the gait and its mirror image.

    Args:
        walker: Who walked.
        rollouts: Walks of ``gait``, whole from its first knot.
        gait: Whose clock divides the walks into cycles.
        skip: First cycles of every walk that are left out, until it has settled.
        substeps: Every so many steps of the simulation is a knot of the gait.

    Raises:
        InvalidInputError: If no whole cycle remains.
    """
    K = 2 * gait.n_knots * substeps
    pieces, strides = [], []
    for walk in rollouts:
        for c in range(skip, (len(walk.q) - 1) // K):
            piece = walk.q[c * K : (c + 1) * K : substeps].copy()
            piece[:, 0] -= piece[:, 0].mean()
            pieces.append(piece)
            strides.append(walk.q[(c + 1) * K, 0] - walk.q[c * K, 0])
    if not pieces:
        raise InvalidInputError(f"no walk has more than {skip} whole gait cycles")
    step_length = float(np.mean(strides)) / 2
    return mirror_average(walker, np.mean(pieces, 0), step_length, gait.half_period)


def _n_steps(policy: TrackingPolicy, cycles: int | None, seconds: float | None) -> int:
    if (cycles is None) == (seconds is None):
        raise InvalidInputError("give either cycles or seconds")
    n = cycles * policy.steps_per_cycle if cycles else round((seconds or 0) / policy.timestep)
    if n < 1:
        raise InvalidInputError(f"a walk needs at least one step, got {cycles or seconds}")
    return n
