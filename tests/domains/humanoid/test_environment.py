"""The environment keeps dm_control's contract, and its rewards add up to the objectives."""

from dataclasses import replace

import numpy as np
import pytest

from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.closed_loop.disturbance import Disturbance, Push
from walking_irl.domains.humanoid.closed_loop.environment import environment, start_of
from walking_irl.domains.humanoid.closed_loop.policy import tracking_policy
from walking_irl.domains.humanoid.closed_loop.rollout import rollout
from walking_irl.domains.humanoid.costs.defaults import REFERENCE_WEIGHTS
from walking_irl.domains.humanoid.costs.stack import cost_stack
from walking_irl.domains.humanoid.gait.library import load_gaits
from walking_irl.errors import FallError, InvalidInputError


@pytest.fixture(scope="module", params=["humanoid", "humanoid-planar"])
def walking(request):
    walker = load_walker(request.param)
    gait = load_gaits(request.param)["reference"]
    return walker, gait, tracking_policy(walker, gait)


def make(walking, seed=0, **options):
    walker, gait, _ = walking
    return environment(walker, start_of(walker, gait), rng=np.random.default_rng(seed), **options)


def walk(env, policy, n):
    """Time steps of n steps under a policy."""
    steps = [env.reset()]
    data = env.physics.data.ptr
    for k in range(n):
        steps.append(env.step(policy.torque(k, data.qpos, data.qvel)))
    return steps


def test_specs_describe_what_is_exchanged(walking):
    walker = walking[0]
    env = make(walking, weights=REFERENCE_WEIGHTS)
    spec = env.action_spec()
    assert spec.shape == (walker.model.nu,)
    lower, upper = walker.model.actuator_ctrlrange.T
    np.testing.assert_array_equal(spec.maximum, upper)
    np.testing.assert_array_equal(spec.minimum, lower)
    # half as strong again, and what it takes to let go of the tendon
    is_strung = walker.tendon_stiffness > 0
    np.testing.assert_allclose(upper[~is_strung], 1.5 * walker.strength_plus[~is_strung])
    assert (upper[is_strung] > 1.5 * walker.strength_plus[is_strung]).all()
    first = env.reset()
    described = env.observation_spec()
    assert set(first.observation) == set(described)
    for name, value in first.observation.items():
        assert value.shape == described[name].shape, name


def test_every_observation_and_every_feature_changes(walking):
    env = make(walking, weights=REFERENCE_WEIGHTS)
    steps, phi = [env.reset()], []
    data = env.physics.data.ptr
    for k in range(80):
        steps.append(env.step(walking[2].torque(k, data.qpos, data.qvel)))
        phi.append(env.task.phi)
    for name in steps[0].observation:
        seen = np.array([s.observation[name] for s in steps])
        assert np.ptp(seen, axis=0).max() > 1e-3, name
    assert (np.ptp(phi[1:], axis=0) > 1e-4).all()


def test_mean_feature_over_a_cycle_is_mu(walking):
    """Reward against objectives: the same numbers up to the speed's drift from the gait's."""
    walker, _, policy = walking
    env, K = make(walking, weights=REFERENCE_WEIGHTS, price=0.0), policy.steps_per_cycle
    env.reset()
    data, phi, rewards = env.physics.data.ptr, [], []
    for k in range(2 * K + 1):
        rewards.append(env.step(policy.torque(k, data.qpos, data.qvel)).reward)
        phi.append(env.task.phi)
    second = slice(K + 1, 2 * K + 1)  # the reward of a step comes one step later
    recorded = rollout(walker, policy, cycles=2)
    cycle = type(recorded)(*(part[K : 2 * K + 1] for part in vars(recorded).values()))
    mu = -cost_stack(walker).rollout_costs(cycle, policy.timestep)
    np.testing.assert_allclose(np.mean(phi[second], 0), mu, rtol=1e-3)
    assert np.mean(rewards[second]) == pytest.approx(REFERENCE_WEIGHTS @ mu, rel=1e-3)


def test_recorded_steps_obey_the_inverse_dynamics(walking):
    """Torque, acceleration and sensors of a sample belong to its state."""
    import mujoco

    walker, _, policy = walking
    recorded = rollout(walker, policy, cycles=1)
    data = mujoco.MjData(walker.model)
    for k in range(5, 75, 10):
        data.qpos[:], data.qvel[:] = recorded.q[k], recorded.v[k]
        data.qacc[:] = recorded.a[k]
        mujoco.mj_inverse(walker.model, data)
        np.testing.assert_allclose(data.qfrc_inverse[walker.n_root :], recorded.u[k], atol=1e-3)
        np.testing.assert_allclose(data.sensordata, recorded.sensors[k], atol=1e-2)


def test_same_seed_same_walk_other_seed_other_walk(walking):
    disturbed = Disturbance(velocity_noise=0.05, kicks=0.05)

    def final(seed):
        env = make(walking, seed, disturbance=disturbed)
        walk(env, walking[2], 100)
        return env.physics.data.ptr.qpos.copy()

    np.testing.assert_array_equal(final(1), final(1))
    assert np.abs(final(1) - final(2)).max() > 1e-4


def test_kicks_come_once_in_every_cycle(walking):
    walker, _, policy = walking
    kicked = rollout(walker, policy, cycles=6, rng=np.random.default_rng(0), kicks=0.2)
    jump = kicked.v[1:] - kicked.v[:-1] - policy.timestep * kicked.a[:-1]
    at = np.flatnonzero(np.abs(jump).max(1) > 1e-6)
    assert list(at // policy.steps_per_cycle) in ([0, 1, 2, 3, 4, 5], [0, 1, 2, 3, 4, 5, 6])
    assert not np.abs(jump[:, : walker.n_root]).max() > 1e-6


def test_push_acts_for_a_tenth_of_a_second(walking):
    """An impulse of 100 N x .1 s changes the momentum of 72 kg by about .14 m/s."""
    walker, _, policy = walking
    calm = rollout(walker, policy, seconds=1.0)
    pushed = rollout(walker, policy, seconds=1.0, push=Push(0.4, (100.0, 0.0, 0.0)))
    before = pushed.time <= 0.4
    np.testing.assert_array_equal(pushed.q[before], calm.q[before])
    com = walker.sensor["com"].start
    gained = np.gradient(pushed.sensors[:, com] - calm.sensors[:, com], policy.timestep)
    at = np.searchsorted(pushed.time, 0.52)
    assert 0.3 * 0.14 < gained[at] < 1.7 * 0.14


def test_fall_ends_the_episode_with_discount_zero(walking):
    env = make(walking)
    env.reset()
    for _ in range(1000):
        step = env.step(np.zeros(walking[0].model.nu))
        if step.last():
            break
    assert step.last() and step.discount == 0.0
    height = env.physics.data.ptr.qpos[walking[0].joints.index("root_z")]
    pitch = env.physics.data.ptr.qpos[walking[0].joints.index("root_pitch")]
    assert height < -0.3 or abs(pitch) > 1.0


FLAILS = range(30)
"""Seeds; of ten, one or two end beyond what the simulation can follow."""


def flailing(walking, seed):
    """Torques at the limits of the control range with random signs, for 100 steps: (100, nu)."""
    lower, upper = walking[0].model.actuator_ctrlrange.T
    signs = np.random.default_rng(seed).integers(2, size=(100 if seed % 2 else 10, len(lower)))
    return np.where(np.repeat(signs, 100 // len(signs), axis=0), upper, lower)


@pytest.mark.parametrize("held", [1, 2])
def test_torques_that_break_the_simulation_down_end_as_a_fall(walking, held):
    """At the last state that was valid, with the price of a fall and of the step before it."""
    env = make(walking, steps_per_control=held, weights=REFERENCE_WEIGHTS)
    task, data, lost = env.task, env.physics.data.ptr, 0
    for seed in FLAILS:
        step, states, total = env.reset(), [], 0.0
        for torques in flailing(walking, seed):
            states.append((data.qpos.copy(), data.qvel.copy()))
            step = env.step(torques)
            total += step.reward
            assert np.isfinite([step.reward, *task.phi, *task.costs, task.progress]).all()
            assert all(np.isfinite(seen).all() for seen in step.observation.values())
            if step.last():
                break
        assert step.last() and step.discount == 0.0 and task.has_fallen(env.physics)
        assert total <= -task.price_of_fall, "it never pays"
        if env.physics.has_diverged:
            lost += 1
            np.testing.assert_array_equal((data.qpos, data.qvel), states[-1])
            np.testing.assert_array_equal(step.observation["joint_velocities"], states[-1][1])
            paid = task.price * task.progress - REFERENCE_WEIGHTS @ task.costs
            assert step.reward == pytest.approx(paid - task.price_of_fall)
            after = env.step(torques)
            assert after.first() and not env.physics.has_diverged, "as after any other end"
    assert lost > 0


def test_walks_that_break_the_simulation_down_are_falls(walking):
    """Their recording ends with the last step that did."""
    walker, _, policy = walking
    told = []
    for seed in FLAILS:
        torques = np.resize(flailing(walking, seed), policy.bias.shape)
        wild = replace(policy, gain=np.zeros_like(policy.gain), bias=torques)
        with pytest.raises(FallError, match="fell after") as fall:
            rollout(walker, wild, cycles=1)
        told.append("faster than a timestep resolves" in str(fall.value))
        walked = rollout(walker, wild, cycles=1, raise_on_fall=False)
        recorded = np.hstack([walked.q, walked.v, walked.a, walked.u, walked.sensors])
        assert np.isfinite(recorded).all()
        assert len(walked.q) * policy.timestep == pytest.approx(fall.value.time)
    assert any(told) and not all(told)


def test_held_actions_take_several_steps(walking):
    env = make(walking, steps_per_control=4, weights=REFERENCE_WEIGHTS)
    env.reset()
    env.step(np.zeros(walking[0].model.nu))
    assert env.physics.time() == pytest.approx(4 * walking[2].timestep)
    assert env.control_timestep() == pytest.approx(4 * walking[2].timestep)


def test_time_limit_ends_the_episode_with_discount_one(walking):
    n_steps = 10
    env = make(walking, time_limit=(n_steps - 0.5) * walking[2].timestep)
    steps = walk(env, walking[2], n_steps)
    assert [s.last() for s in steps] == [False] * n_steps + [True]
    assert steps[-1].discount == 1.0


def test_nonsense_is_refused(walking):
    with pytest.raises(InvalidInputError, match=r"weights must have shape \(6,\), got \(3,\)"):
        make(walking, weights=np.ones(3))
    with pytest.raises(InvalidInputError, match="steps_per_control must be 1 or more, got 0"):
        make(walking, steps_per_control=0)
    with pytest.raises(InvalidInputError, match="substeps must be 1 or more"):
        start_of(walking[0], walking[1], substeps=0)
