"""Environment steps per second with the policy in the loop, against bare ``mj_step``.

The bare loop replays the recorded torques through the same states: it is put back on the record at
the start of every gait cycle.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import mujoco
import numpy as np
from bench import medians, table, verdict

from walking_irl.domains.humanoid.body.anatomy import Walker
from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.closed_loop.environment import environment, start_of
from walking_irl.domains.humanoid.closed_loop.policy import TrackingPolicy, tracking_policy
from walking_irl.domains.humanoid.closed_loop.rollout import rollout
from walking_irl.domains.humanoid.costs.defaults import REFERENCE_WEIGHTS
from walking_irl.domains.humanoid.gait.library import load_gaits
from walking_irl.environments.agent import TrackingAgent
from walking_irl.environments.walker import WalkerEnv
from walking_irl.types import Rollout

TARGET = 0.5


def bare(walker: Walker, policy: TrackingPolicy, walk: Rollout) -> Callable[[], None]:
    model = walker.model_at(policy.timestep)
    data = mujoco.MjData(model)
    ctrl, K = data.ctrl, policy.steps_per_cycle

    def run() -> None:
        mujoco.mj_resetData(model, data)
        for k, u in enumerate(walk.u):
            if k % K == 0:
                data.qpos[:], data.qvel[:] = walk.q[k], walk.v[k]
            ctrl[:] = u
            mujoco.mj_step(model, data)

    return run


def in_environment(
    policy: TrackingPolicy, walk: Rollout, *, replay: bool = False, reward: bool = False
) -> Callable[[], None]:
    """A loop over ``Environment.step``, with the policy's torques or the recorded ones."""
    walker = load_walker()
    env = environment(
        walker,
        start_of(walker, load_gaits()["reference"]),
        rng=np.random.default_rng(0),
        weights=REFERENCE_WEIGHTS if reward else None,
    )
    data = env.physics.data.ptr
    q, v = data.qpos, data.qvel

    def run() -> None:
        env.reset()
        for k, u in enumerate(walk.u):
            env.step(u if replay else policy.torque(k, q, v))

    return run


def in_gymnasium(walk: Rollout) -> Callable[[], None]:
    """A loop over ``WalkerEnv.step`` with its baseline agent: observations, reward and phi."""
    env = WalkerEnv(velocity_noise=0.0, time_limit=float("inf"))
    agent = TrackingAgent.of(env)

    def run() -> None:
        seen, _ = env.reset(seed=0)
        for _ in walk.u:
            seen, *_ = env.step(agent.predict(seen)[0])

    return run


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cycles", type=int, default=25, help="gait cycles in a repetition")
    parser.add_argument("--repeats", type=int, default=31)
    parser.add_argument("--quick", action="store_true", help="two cycles, three repetitions")
    args = parser.parse_args()
    cycles, repeats = (2, 3) if args.quick else (args.cycles, args.repeats)
    walker = load_walker()
    policy = tracking_policy(walker, load_gaits()["reference"])
    walk = rollout(walker, policy, cycles=cycles)
    loops = {
        "bare mj_step": bare(walker, policy, walk),
        "environment, recorded torques": in_environment(policy, walk, replay=True),
        "environment, policy": in_environment(policy, walk),
        "environment, policy, reward": in_environment(policy, walk, reward=True),
        "Gymnasium, baseline agent": in_gymnasium(walk),
        "rollout: policy, all recorded": lambda: rollout(walker, policy, cycles=cycles),
    }
    step = [t / len(walk.u) for t in medians(list(loops.values()), repeats)]
    rows = [
        [name, f"{1e6 * t:.1f}", f"{1 / t:.0f}", f"{step[0] / t:.2f}"]
        for name, t in zip(loops, step, strict=True)
    ]
    print(table(["loop", "us/step", "steps/s", "of bare"], rows))
    ratio = step[0] / step[2]
    text = f"policy in the loop: {ratio:.2f} of the bare simulation's steps/s (target >= {TARGET})"
    print("\n" + verdict(text, ratio >= TARGET))


if __name__ == "__main__":
    main()
