"""What a recorded walk was weighed for: walkers of known weights, in the plane to be quick."""

import numpy as np
import pytest

from walking_irl.domains.humanoid.body.variants import Surroundings
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.learner import search, solver_for
from walking_irl.domains.humanoid.prediction import Prediction, predict
from walking_irl.domains.humanoid.recorded.closeness import Walk, closeness, degrees_apart
from walking_irl.domains.humanoid.recorded.feasible import feasible_gait, sensitivity
from walking_irl.domains.humanoid.spec import PLANAR
from walking_irl.run import joint
from walking_irl.run.joint import SPREAD, joint_fit
from walking_irl.run.remembered import Remembered
from walking_irl.run.walk import (
    BRACKET,
    MAX_SOLVES,
    NARROWEST,
    explain,
    nearest,
    starting_weights,
)
from walking_irl.run.walk_report import explanation_json, force_apart

REFERENCE_WEIGHTS = PLANAR.stack.reference_weights
TRUTH = REFERENCE_WEIGHTS * [1.6, 0.8, 1.5, 0.7, 1.4, 0.8]
TRUTH = TRUTH / TRUTH.sum()


def noisy(gait, degrees, seed):
    """Joint angles off by slow errors, each joint's own; the root is where it was."""
    rng = np.random.default_rng(seed)
    phase = np.pi * np.arange(gait.n_knots) / gait.n_knots
    waves = np.column_stack([f(k * phase) for k in range(1, 5) for f in (np.cos, np.sin)])
    error = waves @ rng.normal(size=(8, gait.q.shape[1]))
    error *= np.deg2rad(degrees) / error.std(axis=0)
    error[:, : PLANAR.walker.n_root] = 0
    return Gait(gait.q + error, gait.step_length, gait.half_period)


@pytest.fixture(scope="module")
def truth():
    return search(PLANAR, TRUTH).policy


@pytest.fixture(scope="module")
def walk(truth):
    return Walk(noisy(truth, 1.5, 0))


@pytest.fixture(scope="module")
def near(walk):
    return nearest(PLANAR, walk)


@pytest.fixture(scope="module")
def fit(walk, near):
    return joint_fit(PLANAR, walk, REFERENCE_WEIGHTS, near, near.total_costs)


@pytest.mark.slow
def test_a_walker_of_known_weights_is_explained_better_than_by_the_start(fit):
    start, end = (np.abs(w - TRUTH).sum() for w in (REFERENCE_WEIGHTS, fit.last.w))
    assert end < 0.5 * start


@pytest.mark.slow
def test_the_gap_falls_to_that_of_the_truth(fit, walk, truth):
    """At the truth the gap is at most the pull of the noise itself, 0.1 (1.5 / 3)^2 and less."""
    losses, gaps = ([getattr(p, n) for p in fit.points] for n in ("loss", "gap"))
    assert losses == sorted(losses, reverse=True) and min(gaps) > 0
    pull = 0.1 * closeness(PLANAR.walker, walk).squared(truth.to_vector())
    assert gaps[-1] < 1.05 * pull < gaps[0]  # in units of the walk's cost, which is about one


@pytest.mark.slow
def test_the_hessian_of_the_gap_predicts_gradients_between_weights(fit, walk):
    """Central differences of G(y) - G(x) along the weights, against S_x - S_y."""
    end = fit.last
    forward = Remembered(end.near.gait, PLANAR)
    step = 0.01 * (np.eye(6)[5] - end.w)
    ends = []
    for sign in (1, -1):
        w = end.w + sign * step
        y = feasible_gait(PLANAR, walk, w, near=[end.near.gait])
        ends.append(y.total_costs + forward(w).mu)
    seen = float(step @ (ends[0] - ends[1]) / 2)
    best = forward(end.w)
    held = sensitivity(PLANAR, end.near, walk, end.w)
    assert held is not None and best.sensitivity is not None
    assert seen == pytest.approx(step @ (best.sensitivity - held) @ step, rel=0.1)
    assert np.linalg.eigvalsh(held).min() > -1e-9 * np.abs(held).max()


@pytest.mark.slow
def test_where_a_walk_tells_little_weights_are_as_sure_as_those_of_walkers_in_general(
    fit, near, walk
):
    """With a gap a million times as large nothing but their spread is left, in closed form."""
    end = fit.last
    search = joint._Search(PLANAR, walk, near.total_costs, Remembered(end.gait, PLANAR))
    far = end._replace(gap=1e6 * end.gap)
    relative = search.covariance(far) / np.outer(end.w, end.w)
    normalised = np.eye(6) - np.outer(np.ones(6), end.w)  # d log w for independent log-weights
    want = SPREAD**2 * normalised @ normalised.T
    np.testing.assert_allclose(relative, want, atol=1e-3)
    assert np.all(np.diag(search.covariance(end)) < np.diag(want) * end.w**2)


def test_rare_weights_are_told_by_their_ratios_alone():
    v = REFERENCE_WEIGHTS
    assert joint.rarity(v, v) == 0
    assert joint.rarity(3 * v, v) == pytest.approx(0)
    twice = v * [np.e, 1, 1, 1, 1, 1]  # one log-weight a deviation off, less the mean of six
    assert joint.rarity(twice, v) == pytest.approx((1 - 1 / 6) / 2 / SPREAD**2)


@pytest.mark.slow
def test_the_best_gait_is_nearer_to_the_walker_than_its_noise(fit, truth):
    apart = degrees_apart(PLANAR.walker, fit.last.gait, truth)
    assert max(apart[n] for n in ("hip_flexion", "knee", "ankle")) < 1.5


@pytest.mark.slow
def test_half_widths_hold_the_parts_that_they_name_and_are_never_too_narrow(walk, near, fit):
    """Two starts; a second trial is the same walk with the same noise."""
    starts = np.array([REFERENCE_WEIGHTS, fit.last.w])
    found = explain(PLANAR, walk, near, trials=[walk], starts=starts)
    assert len(found.others) == 1
    assert np.allclose(found.starts, np.abs(found.others[0].w - found.w))
    parts = np.sqrt(found.allowed**2 + found.starts**2 + found.trials**2)
    assert np.allclose(found.half, np.maximum(parts, NARROWEST))
    assert np.all(np.abs(found.w - TRUTH) <= found.half)
    assert found.end.loss <= found.others[0].loss
    low, high = found.bracket
    assert 0 <= low <= high <= low + BRACKET + 1e-9 and high < 0.01 and found.solves <= MAX_SOLVES
    content = explanation_json(found, walk.shown)
    assert content["w"] == found.w.tolist() and len(content["intervals"]) == 6


@pytest.mark.slow
@pytest.mark.parametrize(
    ("around", "faster"),
    [(Surroundings(slope=2.862), None), (Surroundings(load=10.0), None), (Surroundings(), 1.08)],
    ids=["5 % uphill", "a pack", "another speed"],
)
def test_weights_recovered_on_the_flat_predict_the_walker_elsewhere(fit, truth, around, faster):
    """Within 1 % of its cost there, from a noisy recording of its usual walk."""
    speed = None if faster is None else faster * truth.speed
    there, guess = (
        predict(PLANAR, w, around, speed, level=Prediction(PLANAR, gait, np.zeros(6), float(w[-1])))
        for w, gait in ((TRUTH, truth), (fit.last.w, fit.last.gait))
    )
    of_truth, of_guess = (float(TRUTH @ p.total_costs) for p in (there, guess))
    assert 0.999 * of_truth < of_guess < 1.01 * of_truth
    if speed is None:  # what they predict is that the walk changes: its usual gait costs more there
        usual = solver_for(there.spec).problem.evaluate(truth.to_vector()).total_costs()
        assert of_guess < 0.9 * float(TRUTH @ usual)


def test_starting_weights_are_far_apart():
    w = starting_weights(REFERENCE_WEIGHTS)
    assert np.allclose(w.sum(axis=1), 1) and (w > 0).all()
    apart = np.abs(w[:, None] - w).sum(axis=2)[np.triu_indices(3, 1)]
    assert apart.min() > 0.3  # L1


def test_weights_asked_twice_are_solved_once_and_every_answer_is_kept(truth):
    forward = Remembered(truth, PLANAR)
    first = forward(TRUTH)
    other = forward(REFERENCE_WEIGHTS)
    again = forward(TRUTH)
    assert forward.solves == 2
    np.testing.assert_array_equal(again.mu, first.mu)
    assert (again.evaluated == other.mu).all(axis=1).any()
    assert (forward.policies() @ TRUTH).max() <= first.mu @ TRUTH + 1e-6  # the best is its own


def test_a_gait_that_was_met_bounds_what_weights_are_worth(truth):
    forward = Remembered(truth, PLANAR)
    forward.meet(truth, np.full(6, 0.5))  # better than any gait
    assert forward(TRUTH).mu @ TRUTH < -0.5
    assert forward.value(TRUTH) == pytest.approx(-0.5)


def test_without_a_sensitivity_steps_follow_the_gradient(truth):
    assert np.array_equal(Remembered(truth, PLANAR).sensitivity(TRUTH), np.eye(6))


def test_forces_of_a_gait_are_not_apart_from_its_own(truth):
    from walking_irl.domains.humanoid.gait.realism import gait_cycle

    force = np.roll(gait_cycle(PLANAR.walker, truth).force[:, 0], 17)
    assert force_apart(PLANAR.walker, truth, force) < 1e-12
    assert force_apart(PLANAR.walker, truth, 0.9 * force) > 0.05  # body weights
