"""The walker keeps the contracts of dm_control's suite, Gymnasium and MO-Gymnasium."""

import pickle
import re
import warnings
from math import nan

import numpy as np
import pytest

from walking_irl import environments
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.environments import camera
from walking_irl.environments.agent import TrackingAgent
from walking_irl.errors import InvalidInputError

gym = pytest.importorskip("gymnasium", reason="needs the extra: pip install 'walking-irl[gym]'")
mo_gym = pytest.importorskip(
    "mo_gymnasium", reason="needs the extra: pip install 'walking-irl[gym]'"
)
SCALAR = [i for i in environments.IDS if "mo-" not in i]
VECTOR = [i for i in environments.IDS if "mo-" in i]


@pytest.fixture
def make():
    """Makes environments, and closes them."""
    made = []

    def made_one(name="WalkingIRL/Humanoid-Planar-v0", **settings):
        made.append(gym.make(name, disable_env_checker=True, **settings))
        return made[-1]

    yield made_one
    for env in made:
        env.close()


def episode(env, agent, seed=None):
    """Observations, rewards and the last step of an episode."""
    seen, _ = env.reset(seed=seed)
    observations, rewards = [seen], []
    while True:
        action = agent.predict(seen)[0] if agent else env.action_space.sample()
        seen, reward, terminated, truncated, info = env.step(action)
        observations.append(seen)
        rewards.append(reward)
        if terminated or truncated:
            return np.array(observations), np.array(rewards), terminated, truncated, info


class Weighed(mo_gym.wrappers.LinearReward):
    """Its weights are the same array in every info, which Gymnasium 1.4 objects to."""

    def step(self, action):
        *step, info = super().step(action)
        return *step, {**info, "reward_weights": self.w.copy()}


class Screen:
    """Stands in for MuJoCo's viewer; a machine without a screen has none."""

    def __init__(self, *_):
        self.cam, self.shown, self.is_open = self, 0, True
        self.lookat = np.zeros(3)

    def sync(self):
        self.shown += 1

    def close(self):
        self.is_open = False


@pytest.fixture
def screen(monkeypatch):
    opened = []
    monkeypatch.setenv("DISPLAY", ":99")
    monkeypatch.setattr(camera, "_open_viewer", lambda *a: opened.append(Screen(*a)) or opened[-1])
    return opened


@pytest.mark.parametrize("name", SCALAR)
def test_gymnasiums_checker_finds_only_that_spaces_have_units(name, make, screen):
    """Torques are in Nm, not in [-1, 1], and a velocity has no bound."""
    from gymnasium.utils.env_checker import check_env

    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        check_env(make(name).unwrapped)
    for warning in said:
        assert re.search("symmetric and normalized|value is -?infinity", str(warning.message))
    assert [s.shown > 0 and not s.is_open for s in screen] == [True]


@pytest.mark.parametrize("name", VECTOR)
def test_mo_gymnasiums_tests_of_its_own_environments_pass(name):
    """A linear scalarisation passes the checker, and rewards are in the space that is named."""
    from gymnasium.utils.env_checker import check_env

    env = mo_gym.make(name)
    with warnings.catch_warnings():
        for known in ("symmetric and normalized", "value is -?infinity", "different from the unw"):
            warnings.filterwarnings("ignore", message=f".*{known}")
        check_env(Weighed(env, weight=np.full(6, 1 / 6)), skip_render_check=True)
    inner = env.unwrapped
    assert inner.reward_space.shape == (inner.reward_dim,) == (6,)
    assert inner.objectives == ("effort", "work", "smooth", "stability", "impact", "time")
    env.reset(seed=0)
    for _ in range(5):
        _, reward, *_, info = env.step(env.action_space.sample())
        assert reward in inner.reward_space
        np.testing.assert_array_equal(reward, info["phi"])


@pytest.mark.parametrize("name", environments.IDS)
def test_same_seed_same_episode_other_seed_another(name, make):
    env = make(name, time_limit=0.3)
    agent = TrackingAgent.of(env)
    first, again, other = (episode(env, agent, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first[0], again[0])
    np.testing.assert_array_equal(first[1], again[1])
    assert np.abs(first[0][0] - other[0][0]).max() > 1e-3
    copy = pickle.loads(pickle.dumps(env.unwrapped))
    np.testing.assert_array_equal(episode(copy, agent, 1)[0], first[0])


@pytest.mark.parametrize("name", SCALAR)
def test_a_fall_terminates_and_the_time_limit_truncates(name, make):
    env = make(name, time_limit=3.0)
    _, _, terminated, truncated, info = episode(env, TrackingAgent.of(env), 0)
    assert (terminated, truncated, info["fell"]) == (False, True, False)
    assert info["x"] == pytest.approx(3.0 * env.unwrapped.gait.speed, abs=0.1)
    env.action_space.seed(0)
    _, rewards, terminated, truncated, info = episode(env, None, 0)
    assert (terminated, truncated, info["fell"]) == (True, False, True)
    unwrapped = env.unwrapped
    metre = unwrapped.task.price / (unwrapped.gait.speed * unwrapped.gait.timestep)
    assert rewards[-1] < -metre, "a fall takes back a metre"


@pytest.mark.parametrize("name", environments.IDS)
@pytest.mark.parametrize("kind", ["not a number", "limits"])
def test_a_simulation_that_breaks_down_ends_as_a_fall(name, kind, make):
    env = make(name)
    space, rng, lost = env.action_space, np.random.default_rng(0), 0
    for seed in range(20 if kind == "limits" else 1):
        seen, _ = env.reset(seed=seed)
        assert np.isfinite(seen).all()
        terminated = False
        while not terminated:
            signs = rng.integers(2, size=space.shape)
            action = np.where(signs, space.high, space.low) if kind == "limits" else space.low * nan
            seen, reward, terminated, truncated, info = env.step(action)
            told = [reward, info["phi"], info["costs"], info["progress"], info["x"]]
            assert np.isfinite(np.hstack([seen, *told])).all() and not truncated
        assert info["fell"] and (kind == "limits" or np.all(reward <= 0))
        lost += env.unwrapped._env.physics.has_diverged
    assert lost > 0


@pytest.mark.parametrize("planar", [False, True])
def test_numbers_of_an_observation_have_names(planar, make):
    env = make(SCALAR[int(planar)]).unwrapped
    names = env.observation_names
    seen, _ = env.reset(seed=0)
    assert len(set(names)) == len(names) == len(seen)
    state = env._env.physics.data.ptr
    for joint in ("root_pitch", "knee_l"):
        at = env.walker.joints.index(joint)
        assert seen[names.index(f"joint_positions/{joint}")] == state.qpos[at]
        assert seen[names.index(f"joint_velocities/{joint}")] == state.qvel[at]
    assert seen[names.index("phase/cos")] == 1.0


def test_the_vector_reward_with_a_price_is_the_scalar_one_but_for_the_time_term(make):
    """w.(phi + price x progress 1) = price x progress - w.costs + w_time (progress - 1) x pace."""
    scalar = make("WalkingIRL/Humanoid-Planar-v0", time_limit=0.5)
    price, w = scalar.unwrapped.task.price, scalar.unwrapped.weights
    vector = make("WalkingIRL/mo-Humanoid-Planar-v0", time_limit=0.5, price=price)
    agent = TrackingAgent.of(scalar)
    _, one, *_ = episode(scalar, agent, 3)
    seen, _ = vector.reset(seed=3)
    for reward in one:
        seen, six, *_, info = vector.step(agent.predict(seen)[0])
        pace = vector.unwrapped.task.costs[-1]
        assert w @ six == pytest.approx(reward + w[-1] * (info["progress"] - 1) * pace, abs=0.03)


def test_weights_are_a_tasks_name_or_six_numbers_of_any_sum(make):
    named = make(weights="time x3").unwrapped
    own = make(weights=10 * load_library("humanoid-planar")["time x3"].w).unwrapped
    np.testing.assert_allclose(own.weights, named.weights)
    assert own.gait == named.gait and own.task.price == pytest.approx(named.task.price)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"weights": "running"}, "unknown task 'running'; choose from reference, "),
        ({"weights": [1.0, 2.0]}, "weights must be 6 finite numbers"),
        ({"weights": [-1.0, 1, 1, 1, 1, 1]}, "weights must be >= 0"),
        ({"render_mode": "ansi"}, "unknown render mode 'ansi'; choose from rgb_array, human"),
        ({"steps_per_control": 0}, "steps_per_control must be 1 or more"),
    ],
)
def test_nonsense_is_refused(settings, message):
    from walking_irl.environments.walker import WalkerEnv

    with pytest.raises(InvalidInputError, match=message):
        WalkerEnv(body="humanoid-planar", **settings)


def test_an_action_of_another_shape_is_refused(make):
    env = make().unwrapped
    env.reset(seed=0)
    with pytest.raises(InvalidInputError, match=r"an action must have shape \(11,\), got \(3,\)"):
        env.step(np.zeros(3))


def test_pictures_show_a_walker_that_moves(make):
    env = make(render_mode="rgb_array", width=160, height=120)
    agent = TrackingAgent.of(env)
    seen, _ = env.reset(seed=0)
    before = env.render()
    for _ in range(15):
        seen, *_ = env.step(agent.predict(seen)[0])
    after = env.render()
    assert before.shape == after.shape == (120, 160, 3) and before.dtype == np.uint8
    assert before.std() > 10, "more than one colour"
    assert (np.abs(before.astype(int) - after).max(axis=2) > 30).mean() > 0.005


def test_a_window_needs_a_screen(make, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    env = make(render_mode="human")
    with pytest.raises(InvalidInputError, match="needs a screen; without one use render_mode"):
        env.reset(seed=0)


def test_many_environments_step_side_by_side():
    names = gym.make_vec("WalkingIRL/Humanoid-Planar-v0", num_envs=3, vectorization_mode="sync")
    agent = TrackingAgent.of(names.envs[0])
    seen, _ = names.reset(seed=[1, 1, 2])
    for _ in range(10):
        seen, rewards, terminated, truncated, info = names.step(agent.predict(seen)[0])
    assert seen.shape[0] == 3 and rewards.shape == (3,) and not (terminated | truncated).any()
    assert info["phi"].shape == (3, 6)
    np.testing.assert_array_equal(seen[0], seen[1])
    assert np.abs(seen[0] - seen[2]).max() > 1e-6
    names.close()


def test_many_multi_objective_environments_step_side_by_side():
    from mo_gymnasium.wrappers.vector import MOSyncVectorEnv

    many = MOSyncVectorEnv([lambda: mo_gym.make("WalkingIRL/mo-Humanoid-Planar-v0")] * 2)
    agent = TrackingAgent.of(many.envs[0])
    seen, _ = many.reset(seed=0)
    for _ in range(4):
        seen, rewards, *_ = many.step(agent.predict(seen)[0])
    assert rewards.shape == (2, 6) and (rewards < 0).all()
    many.close()


@pytest.mark.parametrize("body", environments.BODIES)
def test_every_task_of_the_suite_can_be_loaded_and_stepped(body):
    for task in environments.tasks(body):
        env = environments.load(body, task, rng=np.random.default_rng(0))
        env.reset()
        step = env.step(np.zeros(env.action_spec().shape))
        assert step.reward == 0.0 and step.discount == 1.0
    with pytest.raises(InvalidInputError, match="there is no body 'horse'; choose from humanoid, "):
        environments.load("horse")


def test_the_baseline_agent_walks_from_what_it_sees(make):
    """Falls never, from disturbed starts, though it does not see where on the ground it is."""
    for name, chosen in zip(SCALAR, [("reference", "work x3"), environments.tasks()], strict=True):
        for task in chosen:
            env = make(name, weights=task, time_limit=1.5)
            _, rewards, terminated, _, info = episode(env, TrackingAgent.of(env), 5)
            assert not terminated, task
            assert rewards.sum() > 0 and info["x"] > 1.0


@pytest.mark.slow
def test_a_few_hundred_steps_of_ppo():
    ppo = pytest.importorskip(
        "stable_baselines3", reason="needs an extra: pip install stable-baselines3"
    )
    from gymnasium.wrappers import RescaleAction
    from stable_baselines3.common.env_checker import check_env
    from stable_baselines3.common.evaluation import evaluate_policy

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # other packages' own
        env = RescaleAction(gym.make("WalkingIRL/Humanoid-Planar-v0"), -1.0, 1.0)
        check_env(env)
        model = ppo.PPO("MlpPolicy", env, n_steps=256, batch_size=64, n_epochs=2, seed=0)
        before = [p.clone() for p in model.policy.parameters()]
        model.learn(512)
        after = list(model.policy.parameters())
        assert any((a != b).any() for a, b in zip(after, before, strict=True))
        plain = gym.make("WalkingIRL/Humanoid-Planar-v0", time_limit=2.0)
        mean, _ = evaluate_policy(TrackingAgent.of(plain), plain, 2, warn=False)
        learnt, _ = evaluate_policy(model, env, 2, warn=False)
    assert mean > 0 > learnt, "the baseline walks; 512 steps do not teach it"
