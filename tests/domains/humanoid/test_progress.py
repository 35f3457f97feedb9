"""As a task for reinforcement learning, walking pays: more than falling, standing or flailing."""

import numpy as np
import pytest

from walking_irl.domains.humanoid.body.load import SHIPPED, load_walker
from walking_irl.domains.humanoid.closed_loop.environment import Start, environment, start_of
from walking_irl.domains.humanoid.closed_loop.policy import tracking_policy
from walking_irl.domains.humanoid.closed_loop.progress import (
    MARGIN,
    best_known,
    price_of_progress,
)
from walking_irl.domains.humanoid.costs.defaults import OBJECTIVES
from walking_irl.domains.humanoid.gait.library import load_library

CYCLES = 3
TIME = [o.name for o in OBJECTIVES].index("time")
STIFFNESS, DAMPING = 300.0, 15.0  # of who stands [Nm/rad], [Nm s/rad]
GAITS = [(body, name) for body in SHIPPED for name in load_library(body)]


def paid(walker, start, w, act):
    """Return in prices of a metre, and steps, of at most CYCLES under a policy."""
    rng = np.random.default_rng(0)
    limit = CYCLES * start.period + 0.5 * start.timestep
    env = environment(walker, start, rng=rng, weights=w, time_limit=limit)
    step, total, n = env.reset(), 0.0, 0
    data = env.physics.data.ptr
    while not step.last():
        step = env.step(act(n, data.qpos, data.qvel))
        total, n = total + step.reward, n + 1
    return total * start.speed * start.timestep / env.task.price, n


@pytest.mark.parametrize(("body", "name"), GAITS)
def test_the_experts_walk_earns_more_than_falling_standing_and_flailing(body, name):
    """The margin is a fifth of a metre's price; a walk of three cycles earns about as much."""
    walker, shipped = load_walker(body), load_library(body)[name]
    policy, start = tracking_policy(walker, shipped.gait), start_of(walker, shipped.gait)
    rng = np.random.default_rng(1)
    walk, n = paid(walker, start, shipped.w, policy.torque)
    assert n == CYCLES * policy.steps_per_cycle + 1, "a reward comes a step later"
    earned = MARGIN / (1 + MARGIN) * CYCLES * policy.stride  # (price - w.G) x distance
    assert walk == pytest.approx(earned, rel=0.1), "as the gait itself, but for how it is tracked"
    n_root, still = walker.n_root, np.zeros(len(walker.joints))
    others = {
        "falling": paid(walker, start, shipped.w, lambda *_: np.zeros(walker.model.nu)),
        "standing": paid(
            walker,
            Start(still, still, start.timestep, start.period, start.speed),
            shipped.w,
            lambda _, q, v: -STIFFNESS * q[n_root:] - DAMPING * v[n_root:],
        ),
        "flailing": paid(
            walker, start, shipped.w, lambda *_: rng.uniform(policy.lower, policy.upper)
        ),
    }
    for other, (reward, _) in others.items():
        assert reward < walk - 0.2, other


@pytest.mark.parametrize("body", SHIPPED)
def test_no_shipped_gait_earns_more_than_the_one_that_is_optimal(body):
    """Per unit of time, in steady state: speed x (price - cost per metre)."""
    library = load_library(body)
    for name, shipped in library.items():
        price = price_of_progress(shipped.w, body)
        earns = {k: s.gait.speed * (price - shipped.w @ s.total_costs) for k, s in library.items()}
        assert max(earns, key=earns.get) == name
        assert earns[name] > 0


@pytest.mark.parametrize("body", SHIPPED)
def test_price_lies_above_the_least_cost_per_metre_and_scales_with_the_weights(body):
    w = np.random.default_rng(2).dirichlet(np.ones(6))
    least = min(w @ s.total_costs for s in load_library(body).values())
    assert w @ best_known(w, body).total_costs == least
    assert price_of_progress(w, body) == pytest.approx((1 + MARGIN) * least)
    assert price_of_progress(3 * w, body) == pytest.approx(3 * price_of_progress(w, body))


def test_the_reward_is_the_price_of_progress_less_the_weighed_costs():
    walker, shipped = load_walker("humanoid-planar"), load_library("humanoid-planar")["reference"]
    policy, start = tracking_policy(walker, shipped.gait), start_of(walker, shipped.gait)
    env = environment(
        walker, start, rng=np.random.default_rng(0), weights=shipped.w, price=2.0
    )  # fmt: skip
    env.reset()
    data, task, x = env.physics.data.ptr, env.task, []
    for k in range(60):
        x.append(data.qpos[0])
        reward = env.step(policy.torque(k, data.qpos, data.qvel)).reward
        if k:
            metres = (x[-1] - x[-2]) / (start.speed * start.timestep)
            assert task.progress == pytest.approx(metres)
            assert reward == pytest.approx(2.0 * metres - shipped.w @ task.costs)
            slow = task.costs + task.phi  # phi feels a faster step in its time only
            assert np.delete(slow, TIME) == pytest.approx(0.0)
            assert slow[TIME] == pytest.approx((metres - 1) * task.costs[TIME], abs=0.05)
