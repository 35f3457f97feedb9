"""Episodes of any agent become an expert whose weights are recovered."""

from types import SimpleNamespace

import numpy as np
import pytest

from walking_irl.cpirl.loop import cpirl
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.lqr import LQR
from walking_irl.domains.mdp.gridworld import Gridworld
from walking_irl.errors import InvalidInputError

pytest.importorskip("gymnasium", reason="needs the extra: pip install 'walking-irl[gym]'")

from walking_irl.environments.agent import TrackingAgent  # noqa: E402
from walking_irl.environments.episodes import (  # noqa: E402
    collect,
    discounted,
    expert_from_episodes,
    from_arrays,
    per_metre,
)
from walking_irl.environments.finite import FiniteEnv  # noqa: E402
from walking_irl.environments.walker import WalkerEnv  # noqa: E402

W = np.array([0.1, 0.4, 0.3, 0.2])


@pytest.fixture(scope="module")
def world():
    """A small gridworld, its environment, its best policy, and episodes of it."""
    domain = Gridworld(size=8, cells=2)
    env = FiniteEnv(domain.mdp, W, horizon=60)
    pi = domain.forward(W).policy
    return domain, env, pi, collect(env, lambda s: int(pi[s]), episodes=800, seed=0)


def test_a_finite_world_keeps_gymnasiums_contract(world):
    from gymnasium.utils.env_checker import check_env

    check_env(world[1], skip_render_check=True)
    with pytest.raises(InvalidInputError, match=r"an action must be one of 0 \.\.\. 3, got 4"):
        world[1].step(4)
    with pytest.raises(InvalidInputError, match="at least 1 step"):
        FiniteEnv(world[0].mdp, W, horizon=0)


def test_transitions_and_rewards_are_those_of_the_mdp(world):
    """Frequencies of 800 x 60 steps against T, for the pairs that were seen 400 times or more."""
    domain, _, pi, episodes = world
    S = domain.mdp.n_states
    counts = np.zeros((S, S))
    for e in episodes:
        np.add.at(counts, (e.observations[:-1], e.observations[1:]), 1)
        np.testing.assert_array_equal(e.phi, domain.mdp.Phi[e.observations[:-1]])
        np.testing.assert_array_equal(e.actions, pi[e.observations[:-1]])
    often = np.flatnonzero(counts.sum(1) >= 400)
    assert len(often) > 10
    T = domain.mdp.T.toarray()[pi[often] * S + often]
    seen = counts[often] / counts[often].sum(1, keepdims=True)
    assert np.abs(seen - T).max() < 5 * 0.5 / np.sqrt(400)  # five standard errors


def test_the_mean_of_discounted_sums_estimates_mu_within_its_error_bars(world):
    """All four at once in 19 of 20 seeds; this is one of them."""
    domain, _, pi, episodes = world
    expert = expert_from_episodes(episodes, domain.mdp.discount)
    mu = domain.mdp.feature_expectations(pi)
    assert (np.abs(expert.mu - mu) <= expert.error).all()
    assert expert.n_samples == 800 and (expert.error < 0.2 * mu.max()).all()


def test_a_cut_tail_is_made_up_for_and_an_own_end_is_not(world):
    episode = world[3][0]
    constant = episode._replace(phi=np.ones((5, 1)))
    (cut,) = discounted([constant], 0.5)
    assert cut == pytest.approx(2.0)  # 1 / (1 - discount)
    (ended,) = discounted([constant._replace(terminated=True)], 0.5)
    assert ended == pytest.approx(2.0 * (1 - 0.5**5))
    (undiscounted,) = discounted([constant._replace(terminated=True)], 1.0)
    assert undiscounted == pytest.approx(5.0)
    with pytest.raises(InvalidInputError, match="or be 1 where every episode terminates"):
        discounted([constant], 1.0)


def test_weights_of_an_agent_that_was_only_watched_are_recovered(world):
    domain, _, _, episodes = world
    expert = expert_from_episodes(episodes, domain.mdp.discount)
    run = cpirl(domain.forward, expert, mode="minimise", rng=np.random.default_rng(0))
    *_, last = run
    lower, upper = last.intervals.T
    assert (lower <= W).all() and (W <= upper).all()
    best = W @ domain.forward(W).mu
    assert W @ domain.forward(last.estimate).mu >= 0.97 * best


FORMATS = {
    "imitation": lambda e: SimpleNamespace(obs=e.observations, acts=e.actions, terminal=False),
    "minari": lambda e: SimpleNamespace(
        observations=e.observations, actions=e.actions, terminations=np.zeros(len(e.actions), bool)
    ),
    "arrays": lambda e: {"obs": e.observations, "acts": e.actions},
}


@pytest.mark.parametrize("name", FORMATS)
def test_arrays_of_other_packages_say_the_same(world, name):
    domain, _, _, episodes = world
    arrays = [FORMATS[name](e) for e in episodes[:20]]
    read = from_arrays(arrays, lambda s, a, s_next: domain.mdp.Phi[s])
    np.testing.assert_array_equal(discounted(read, 0.9), discounted(episodes[:20], 0.9))


def test_episodes_that_end_themselves_are_known_as_such():
    row = {"obs": np.zeros((3, 2)), "acts": np.zeros(2), "terminations": np.array([False, True])}
    (episode,) = from_arrays([row], lambda *_: np.ones(2))
    assert episode.terminated


@pytest.mark.parametrize(
    ("trajectory", "features", "message"),
    [
        ({"obs": [1, 2]}, None, "a trajectory needs 'acts' or 'actions'"),
        ({"obs": [1, 2], "acts": [1, 2]}, None, "one observation more than actions, got 2 obs"),
        ({"obs": [1], "acts": []}, None, "one observation more than actions"),
        (
            {"obs": [1, 2], "acts": [0]},
            lambda *_: 1.0,
            r"features of a step must have shape \(K,\)",
        ),
    ],
)
def test_arrays_that_are_no_trajectories_are_refused(trajectory, features, message):
    with pytest.raises(InvalidInputError, match=message):
        from_arrays([trajectory], features)


def test_an_environment_without_features_is_refused(world):
    with pytest.raises(InvalidInputError, match=r"no info\['psi'\] and its reward is no vector"):
        collect(world[1], lambda s: 0, episodes=1, key="psi")
    with pytest.raises(InvalidInputError, match="at least 1 episode"):
        collect(world[1], lambda s: 0, episodes=0)


def test_costs_per_metre_of_the_walkers_agent_are_those_of_its_gait():
    """Two disturbed walks of four cycles, without the first two: as the gait to a few per cent."""
    shipped = load_library("humanoid-planar")["reference"]
    limit = (4 * 80 + 1.5) * shipped.gait.timestep
    env = WalkerEnv(body="humanoid-planar", time_limit=limit)
    episodes = collect(env, TrackingAgent.of(env), episodes=2, seed=0, key="costs")
    mu = per_metre(episodes, skip=2 * 80 + 1)
    assert mu.shape == (2, 6)
    np.testing.assert_allclose(mu, np.tile(-shipped.total_costs, (2, 1)), rtol=0.05)
    with pytest.raises(InvalidInputError, match="makes no progress after the first 999"):
        per_metre(episodes, skip=999)


def test_a_controller_known_by_arrays_alone_is_recovered():
    """No environment: states and inputs of a noisy feedback law, and the features of a step."""
    rng, w = np.random.default_rng(0), np.array([0.2, 0.5, 0.3])
    domain = LQR(3, policy_noise=0.01)
    gains, Q, R = domain.gains(w), np.eye(3) * 0.8 + 0.1, 0.9 - np.eye(3) * 0.8

    def trajectory(steps=80):
        x, u = np.full((steps + 1, 3), domain.start), np.empty((steps, 3))
        for t in range(steps):
            u[t] = gains * x[t] + rng.normal(0.0, 0.1, 3)
            x[t + 1] = x[t] + u[t]
        return {"obs": x, "acts": u}

    rows = [trajectory() for _ in range(40)]
    episodes = from_arrays(rows, lambda x, u, _: -(Q @ x**2 + R @ u**2))
    expert = expert_from_episodes(episodes, domain.discount)
    assert (np.abs(expert.mu - domain.evaluate(gains)) <= expert.error).all()
    *_, last = cpirl(domain.forward, expert, rng=rng)
    assert np.abs(last.estimate - w).sum() < 0.05  # error bars of .2 % of mu
