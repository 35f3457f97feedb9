"""The tracking policy walks what the optimiser found, and stays up."""

import pickle

import numpy as np
import pytest

from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.closed_loop.disturbance import Disturbance, Push
from walking_irl.domains.humanoid.closed_loop.policy import TrackingPolicy, tracking_policy
from walking_irl.domains.humanoid.closed_loop.rollout import Course, averaged_gait, rollout
from walking_irl.domains.humanoid.costs.stack import cost_stack
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.gait.library import load_gaits, load_library
from walking_irl.errors import FallError, InvalidInputError
from walking_irl.types import Rollout

GAITS = load_gaits()


@pytest.fixture(scope="module")
def walker():
    return load_walker()


@pytest.fixture(scope="module")
def policy(walker) -> TrackingPolicy:
    return tracking_policy(walker, GAITS["reference"])


@pytest.fixture(scope="module")
def fine_policy(walker) -> TrackingPolicy:
    return tracking_policy(walker, GAITS["reference"], substeps=2)


def settled(walk: Rollout, policy: TrackingPolicy, skip: int, cycles: int) -> Rollout:
    """Whole cycles of a walk, and the sample that closes them."""
    K = policy.steps_per_cycle
    fields = ("time", "q", "v", "a", "u", "sensors")
    return Rollout(*(getattr(walk, f)[skip * K : (skip + cycles) * K + 1] for f in fields))


@pytest.mark.parametrize("body", ["humanoid", "humanoid-planar"])
def test_simulated_walk_has_the_objectives_of_its_gait(body):
    """Root residuals of 1e-5 body weights shift no objective by more than a thousandth."""
    walker, shipped = load_walker(body), load_library(body)["reference"]
    policy = tracking_policy(walker, shipped.gait)
    walk = rollout(walker, policy, cycles=7)
    simulated = cost_stack(walker).rollout_costs(settled(walk, policy, 2, 5), policy.timestep)
    np.testing.assert_allclose(simulated, shipped.total_costs, rtol=1e-3)


def test_simulation_at_the_knots_retraces_the_gait(walker, policy):
    walk = rollout(walker, policy, cycles=3)
    K = policy.steps_per_cycle
    q = walk.q[K : 2 * K].copy()
    q[:, 0] -= policy.stride
    np.testing.assert_allclose(q[:, 1:], policy.reference.q[:, 1:], atol=1e-3)  # [m, rad]
    np.testing.assert_allclose(walk.u[K : 2 * K], policy.reference.u, atol=2.0)  # [Nm]


@pytest.mark.parametrize("substeps", [1, 2])
def test_feedback_makes_the_gait_stable(walker, substeps):
    stable = tracking_policy(walker, GAITS["reference"], substeps=substeps)
    assert stable.floquet < 0.6
    assert stable.timestep == pytest.approx(GAITS["reference"].timestep / substeps)
    assert stable.steps_per_cycle == 80 * substeps


def test_deviation_decays_as_fast_as_the_floquet_multiplier_says(walker, policy):
    """A small kick, followed for three cycles: linear theory within a factor of two per cycle."""
    K, calm = policy.steps_per_cycle, rollout(walker, policy, cycles=6)
    rng = np.random.default_rng(0)
    noisy = rollout(walker, policy, cycles=6, rng=rng, velocity_noise=1e-3)
    off = [np.linalg.norm(noisy.q[k] - calm.q[k]) for k in (K, 4 * K)]
    assert off[1] < off[0] * (2 * policy.floquet) ** 3
    assert off[1] > 0


def test_without_feedback_the_same_torques_fall(walker, policy):
    """The walk is the feedback's merit: torques alone lose balance within seconds."""
    deaf = TrackingPolicy(
        reference=policy.reference,
        gain=np.zeros_like(policy.gain),
        bias=policy.reference.u,
        lower=policy.lower,
        upper=policy.upper,
        timestep=policy.timestep,
        stride=policy.stride,
        floquet=np.inf,
    )
    with pytest.raises(FallError, match="fell after") as fall:
        rollout(walker, deaf, seconds=20)
    assert 0 < fall.value.time < 20


def test_torques_stay_within_the_strengths(walker, fine_policy):
    strong = Push(0.3, (300.0, 200.0, 0.0))
    walk = rollout(walker, fine_policy, seconds=1.0, push=strong, raise_on_fall=False)
    limit = np.maximum(1.5 * walker.strength_plus, 1.5 * walker.strength_minus)
    assert (np.abs(walk.u) <= limit + 1e-9).all()
    beyond = fine_policy.torque(0, walk.q[0] + 1.0, walk.v[0])
    assert ((beyond == fine_policy.lower) | (beyond == fine_policy.upper)).any()


def test_torque_depends_on_the_cycle_only_through_the_distance_walked(policy):
    q, v = policy.reference.q[7].copy(), policy.reference.v[7] + 0.1
    here = policy.torque(7, q, v)
    q[0] += 5 * policy.stride
    later = policy.torque(7 + 5 * policy.steps_per_cycle, q, v)
    np.testing.assert_allclose(here, later, atol=1e-9)


def test_policy_survives_pickling(policy):
    copy = pickle.loads(pickle.dumps(policy))
    q, v = policy.reference.q[3] + 0.01, policy.reference.v[3]
    np.testing.assert_array_equal(copy.torque(3, q, v), policy.torque(3, q, v))


def test_refinement_passes_through_the_knots(policy, fine_policy):
    np.testing.assert_allclose(fine_policy.reference.q[::2], policy.reference.q, atol=1e-12)
    np.testing.assert_allclose(fine_policy.reference.u[::2], policy.reference.u, atol=1e-9)


def test_average_of_undisturbed_walks_is_the_gait(walker, policy):
    walk = rollout(walker, policy, cycles=5)
    mean = averaged_gait(walker, [walk], GAITS["reference"])
    np.testing.assert_allclose(mean.q, GAITS["reference"].q, atol=1e-3)
    assert mean.step_length == pytest.approx(GAITS["reference"].step_length, abs=1e-4)


def test_average_of_noisy_walks_comes_back_to_the_gait(walker, policy):
    rng = np.random.default_rng(4)
    walks = [rollout(walker, policy, cycles=5, rng=rng, kicks=0.02) for _ in range(4)]
    one = averaged_gait(walker, walks[:1], GAITS["reference"])
    mean = averaged_gait(walker, walks, GAITS["reference"])
    reference = GAITS["reference"].q

    def error(gait: Gait) -> float:
        return float(np.linalg.norm(gait.q - reference))

    assert 0 < error(mean) < error(one)


def test_nonsense_is_refused(walker, policy):
    with pytest.raises(InvalidInputError, match="substeps must be 1 or more, got 0"):
        tracking_policy(walker, GAITS["reference"], substeps=0)
    with pytest.raises(InvalidInputError, match="either cycles or seconds"):
        rollout(walker, policy, cycles=1, seconds=1.0)
    with pytest.raises(InvalidInputError, match="give rng"):
        rollout(walker, policy, cycles=1, kicks=0.1)
    with pytest.raises(InvalidInputError, match="at least one step"):
        rollout(walker, policy, cycles=0)
    walk = rollout(walker, policy, cycles=2)
    with pytest.raises(InvalidInputError, match="more than 2 whole gait cycles"):
        averaged_gait(walker, [walk], GAITS["reference"])


@pytest.mark.slow
@pytest.mark.parametrize("substeps", [1, 2])
@pytest.mark.parametrize("body", ["humanoid", "humanoid-planar"])
def test_every_shipped_gait_walks_a_minute(body, substeps):
    walker = load_walker(body)
    for gait in load_gaits(body).values():
        policy = tracking_policy(walker, gait, substeps=substeps)
        walk = rollout(walker, policy, seconds=60)
        assert walk.q[-1, 0] == pytest.approx(60 * gait.speed, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("direction", [(1, 0), (-1, 0), (0, 1), (0, -1)])
def test_pushes_of_80_newton_are_survived_at_any_phase(walker, fine_policy, direction):
    x, y = direction
    for phase in range(4):
        push = Push(fine_policy.period * (0.5 + phase / 4), (80.0 * x, 80.0 * y, 0.0))
        walk = rollout(walker, fine_policy, seconds=6.0, push=push)
        calm = rollout(walker, fine_policy, seconds=2.0)
        n = len(calm.q)
        assert np.abs(walk.q[:n] - calm.q).max() > 0.01, "the push must have been felt"


@pytest.mark.parametrize("body", ["humanoid", "humanoid-planar"])
def test_no_shipped_gait_asks_a_motor_for_more_than_it_gives(body):
    """Else rollouts are of another walk: a calf's tendon must be let go of wherever the foot is."""
    walker = load_walker(body)
    low, high = walker.model.actuator_ctrlrange.T
    for name, gait in load_gaits(body).items():
        torque = tracking_policy(walker, gait).reference.u
        assert (torque > 0.75 * low).all() and (torque < 0.75 * high).all(), name


@pytest.mark.parametrize("disturbance", [Disturbance(velocity_noise=0.02), Disturbance(kicks=0.02)])
def test_walks_of_a_course_do_not_depend_on_those_before(walker, policy, disturbance):
    course = Course(walker, policy, disturbance)
    course.walk(np.random.default_rng(1), cycles=2)
    again = course.walk(np.random.default_rng(2), cycles=2)
    noise = {"velocity_noise": disturbance.velocity_noise, "kicks": disturbance.kicks}
    alone = rollout(walker, policy, cycles=2, rng=np.random.default_rng(2), **noise)
    for name, value in vars(alone).items():
        np.testing.assert_array_equal(getattr(again, name), value)
