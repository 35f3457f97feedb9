"""The package from outside: one call, own features, and an import that loads nothing."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from problems import random_menu

import walking_irl as wi

OWN_FEATURES = """
import numpy as np
import walking_irl as wi

def features(walk):  # of the speed and stride of every step: time, stride, cadence
    v, stride = np.transpose(walk)
    return -np.mean([1 / v, stride**2, (v / stride) ** 2], axis=1)  # costs, so minus

def forward(w):  # the best speed and stride for these weights
    time, stride, cadence = np.maximum(w, 1e-3)
    v = np.sqrt(time / (2 * np.sqrt(stride * cadence)))
    best = v, np.sqrt(v * np.sqrt(cadence / stride))
    return wi.Response(best, mu=features([best]))

expert = wi.expert_from_trajectories(walks, features)
recovery = wi.recover(forward, expert, objectives=["time", "stride", "cadence"])
print(recovery)  # weights and their intervals
"""


def own_walks(w, seed, n=30):
    """Walks of people who step as the weights say, but for 3 % of noise in every step."""
    rng = np.random.default_rng(seed)
    code = {"walks": [np.ones((5, 2))] * 2}
    exec(OWN_FEATURES.split("expert =")[0], code)
    best = np.array(code["forward"](w).policy)
    noise = (rng.standard_normal((rng.integers(20, 60), 2)) for _ in range(n))
    return [best * (1 + 0.03 * e) for e in noise]


@pytest.mark.parametrize("seed", range(4))
def test_own_features_in_ten_lines(seed, capsys):
    w_E = 0.1 + 0.7 * np.random.default_rng(seed).dirichlet(np.ones(3))
    code = {"walks": own_walks(w_E, seed)}
    exec(OWN_FEATURES, code)
    recovery = code["recovery"]
    assert recovery.is_success
    low, high = recovery.intervals.T
    assert np.all((low <= w_E) & (w_E <= high)), "the error bars hold for all features at once"
    assert np.abs(recovery.w - w_E).max() <= 0.05
    assert (high - low).max() <= 0.3
    out = capsys.readouterr().out
    assert [line.split()[0] for line in out.splitlines()[:3]] == ["time", "stride", "cadence"]
    assert str(len(recovery.iterations)) in out and recovery.status.value in out


def test_one_call_is_the_iterator_run_to_its_end(capsys):
    domain = wi.load("lqr", n_objectives=3)
    rng = np.random.default_rng(0)
    expert = domain.expert(np.array([0.2, 0.5, 0.3]), rng)
    recovery = wi.recover(domain.forward, expert, objectives=domain.objectives)
    rng, probing = np.random.default_rng(0), wi.cpirl.Probing()
    run = list(wi.cpirl.cpirl(domain.forward, expert, rng=rng, probe=probing))
    np.testing.assert_array_equal([i.w for i in recovery.iterations], [i.w for i in run])
    np.testing.assert_array_equal(recovery.w, run[-1].estimate)
    np.testing.assert_array_equal(recovery.intervals, run[-1].intervals)
    assert recovery.status is run[-1].status is wi.Status.MATCHED
    assert recovery.summary.n_solves == len(run)
    nearest = min(run, key=lambda i: np.abs(i.w - recovery.w).sum())
    np.testing.assert_array_equal(recovery.policy, nearest.response.policy)
    assert capsys.readouterr().out == ""
    with ThreadPoolExecutor(2) as executor:
        again = wi.recover(domain.forward, expert, executor=executor)
    np.testing.assert_array_equal(again.intervals, recovery.intervals)
    assert again.names == ("objective 1", "objective 2", "objective 3")


def test_an_ending_without_success_is_told_and_no_error():
    domain = wi.load("lqr", n_objectives=3)
    expert = domain.expert(np.array([0.2, 0.5, 0.3]), np.random.default_rng(0))
    recovery = wi.recover(domain.forward, expert, max_solves=1)
    assert not recovery.is_success and recovery.status is wi.Status.BUDGET
    assert "budget" in str(recovery)


def test_a_recovery_is_frozen():
    menu = random_menu(np.random.default_rng(0), 3)
    recovery = wi.recover(menu.forward, menu.expert(np.full(3, 1 / 3)))
    with pytest.raises(AttributeError):
        recovery.w = np.zeros(3)


def test_as_many_objectives_as_features():
    menu = random_menu(np.random.default_rng(0), 3)
    with pytest.raises(wi.InvalidInputError, match="need 3 objectives, one for each feature, got"):
        wi.recover(menu.forward, menu.expert(np.full(3, 1 / 3)), objectives=["time", "effort"])


def test_every_public_name_is_there_and_unknown_ones_are_not():
    for name in wi.__all__:
        assert getattr(wi, name) is not None, name
        assert name in dir(wi)
    assert wi.cpirl.__name__ == "walking_irl.cpirl"
    for package in (wi.cpirl, wi.geometry):
        assert all(getattr(package, name) is not None for name in package.__all__)
    with pytest.raises(AttributeError, match="no attribute 'recovr'"):
        _ = wi.recovr


def test_star_import_brings_the_public_names():
    names = {}
    exec("from walking_irl import *", names)
    assert set(wi.__all__) <= set(names)


@pytest.mark.parametrize(
    ("code", "heavy"),
    [
        ("import walking_irl", ["numpy", "scipy"]),
        ("import walking_irl as wi; wi.recover; wi.cpirl; wi.Expert; wi.load",
         ["mujoco", "dm_control", "rerun", "cvxpy"]),
    ],
)  # fmt: skip
def test_names_are_loaded_when_they_are_used(code, heavy):
    code += "; import sys; print(sorted(sys.modules))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not [name for name in heavy if f"'{name}'" in out.stdout]


def test_trajectories_of_any_length_are_summed():
    rng = np.random.default_rng(0)
    walks = [rng.random((n, 3)) for n in (5, 9, 2, 7)]
    sums = np.array([w.sum(axis=0) for w in walks])
    expert = wi.expert_from_trajectories(walks, lambda w: -w)
    by_sums = wi.expert_from_trajectories(walks, lambda w: -w.sum(axis=0))
    known = wi.expert_from_returns(-sums)
    for found in (expert, by_sums):
        np.testing.assert_allclose(found.mu, known.mu)
        np.testing.assert_allclose(found.error, known.error)
        np.testing.assert_allclose(found.covariance, known.covariance)
    assert expert.n_samples == 4
    discounted = wi.expert_from_trajectories(walks, lambda w: w, 0.5)
    oracle = [sum(0.5**t * phi for t, phi in enumerate(w)) for w in walks]
    np.testing.assert_allclose(discounted.mu, np.mean(oracle, axis=0))
    options = {"bound": "hoeffding", "ranges": np.full(3, 9.0), "suboptimality": 0.1}
    wide = wi.expert_from_trajectories(walks, lambda w: w, **options)
    assert np.all(wide.error > expert.error) and wide.suboptimality == 0.1


@pytest.mark.parametrize(
    ("trajectories", "discount", "sentence"),
    [
        ([], None, "need at least 2 trajectories .* got 0"),
        ([np.ones((3, 2))], None, "got 1; an expert that is known exactly is Expert"),
        ([np.ones((3, 2)), np.ones((3, 4))], None, "trajectory 1 has 4 features, trajectory 0 has"),
        ([np.ones((3, 2)), np.ones((2, 3, 2))], None, r"trajectory 1 must have shape \(T, K\)"),
        ([np.ones((3, 2)), np.ones((0, 2))], None, r"got \(0, 2\)"),
        ([np.ones((3, 2)), [[1.0, np.nan]]], None, "trajectory 1 must be finite"),
        ([np.ones((3, 2)), [[1.0, 2.0], [3.0]]], None, "trajectory 1 must be numbers"),
        ([["slow"], ["fast"]], None, "trajectory 0 must be numbers"),
        ([np.ones(2), np.ones(2)], 0.9, "sums already; a discount needs those of each step"),
        ([np.ones((3, 2))] * 2, 1.5, r"discount must lie in \(0, 1\], got 1.5"),
    ],
)
def test_trajectories_that_make_no_expert_are_named(trajectories, discount, sentence):
    with pytest.raises(wi.InvalidInputError, match=sentence):
        wi.expert_from_trajectories(trajectories, lambda t: t, discount)


def test_trajectories_without_any_noise_recover_too():
    domain = wi.load("lqr", n_objectives=3)
    w_E = np.array([0.2, 0.5, 0.3])
    mu = domain.forward(w_E).mu
    expert = wi.expert_from_trajectories([mu, mu, mu], lambda t: t)
    recovery = wi.recover(domain.forward, expert)
    assert recovery.is_success and np.abs(recovery.w - w_E).max() <= 2e-3
