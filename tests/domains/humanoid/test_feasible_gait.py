"""The nearest gait that a body can walk: physical, near, cheap; and who is refused."""

from dataclasses import replace

import numpy as np
import pytest

from walking_irl.domains.humanoid.body.physics import inverse_dynamics
from walking_irl.domains.humanoid.gait.gait import Gait, cycle_motion
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.learner import solver_for
from walking_irl.domains.humanoid.optimiser.newton import Status
from walking_irl.domains.humanoid.optimiser.stages import stage
from walking_irl.domains.humanoid.recorded.closeness import (
    Walk,
    closeness,
    degrees_apart,
    sagittal_apart,
)
from walking_irl.domains.humanoid.recorded.feasible import (
    FOREIGN,
    check_habit,
    feasible_gait,
    sensitivity,
)
from walking_irl.domains.humanoid.recorded.force_cost import FORCE, force_apart_from
from walking_irl.domains.humanoid.spec import PLANAR
from walking_irl.errors import InvalidInputError

WALKER = PLANAR.walker
KNOWN = load_library(PLANAR.body)["reference"]
NOISE = 3.0  # [deg]


def noisy(gait, degrees, seed):
    """Joint angles off by a slow error, as those of markers are, each joint's own."""
    rng = np.random.default_rng(seed)
    phase = 2 * np.pi * np.arange(gait.n_knots) / gait.n_knots
    waves = np.column_stack([f(2 * k * phase / 2) for k in (1, 2, 3) for f in (np.cos, np.sin)])
    error = waves @ rng.normal(size=(waves.shape[1], gait.q.shape[1]))
    error *= np.deg2rad(degrees) / error.std(axis=0)
    error[:, :2] = 0
    return Gait(gait.q + error, gait.step_length * 1.01, gait.half_period * 0.99)


@pytest.fixture(scope="module")
def found():
    shown = noisy(KNOWN.gait, NOISE, 0)
    return shown, feasible_gait(PLANAR, Walk(shown), KNOWN.w)


def test_the_nearest_gait_can_be_walked_and_is_nearer_to_the_truth_than_the_recording(found):
    shown, near = found
    assert near.root < 1e-4  # body weights
    before = sagittal_apart(degrees_apart(WALKER, shown, KNOWN.gait))
    after = sagittal_apart(degrees_apart(WALKER, near.gait, KNOWN.gait))
    assert after < 0.6 * before  # noise that no gait can follow is left behind
    assert near.sagittal < 1.1 * NOISE
    assert near.degrees == degrees_apart(WALKER, near.gait, shown)


def test_its_cost_is_that_of_a_gait_that_is_nearly_optimal(found):
    shown, near = found
    best = float(KNOWN.w @ KNOWN.total_costs)
    cost = float(KNOWN.w @ near.total_costs)
    assert best * (1 - 1e-6) < cost < 1.05 * best
    pull = 0.1 * closeness(WALKER, Walk(shown)).squared(near.gait.to_vector())
    assert near.pull == pytest.approx(pull, rel=1e-12)
    # the truth competes for the same cost
    truth = best + 0.1 * closeness(WALKER, Walk(shown)).squared(KNOWN.gait.to_vector())
    assert cost + pull <= truth * (1 + 1e-6)


def test_a_stronger_pull_comes_nearer_and_costs_more(found):
    shown, near = found
    nearer = feasible_gait(PLANAR, Walk(shown), KNOWN.w, strength=1.0, near=[near.gait])
    assert nearer.way == "near" and nearer.root < 1e-4
    assert nearer.sagittal < near.sagittal
    assert KNOWN.w @ nearer.total_costs > KNOWN.w @ near.total_costs


def test_a_gait_of_the_body_is_its_own_nearest():
    near = feasible_gait(PLANAR, Walk(KNOWN.gait), KNOWN.w, near=[KNOWN.gait])
    assert near.sagittal < 0.01  # degrees; the solver's tolerance


def test_the_pull_is_a_part_of_the_cost_that_the_solver_minimises():
    """At the end, gradients of cost and pull cancel; a far anchor is not the start."""
    solver, x = solver_for(PLANAR), KNOWN.gait.to_vector()
    to = closeness(WALKER, Walk(noisy(KNOWN.gait, 2.0, 1)))
    stages = (stage(1e6, 60, 1e-10, 0.1 * to.weight),)
    end = solver.solve(KNOWN.w, x, stages, anchor=to.target)
    assert end.status is Status.CONVERGED
    problem = solver.problem
    lin = solver.linearise(end.x)
    half = lin.at(KNOWN.w, stages[0].penalty).gradient
    pull = 0.1 * to.weight * (end.x - to.target)
    # the decrement ends the solve, not the gradient: it is small against either part
    assert np.linalg.norm(half + pull) < 1e-3 * np.linalg.norm(pull)
    away = to.squared(end.x)
    assert 0 < away < to.squared(problem.evaluate(x).x)


def test_joints_that_were_not_recorded_do_not_pull():
    shown = KNOWN.gait
    missing = ("arm_flex_r", "arm_flex_l", "elbow_flex_r", "lumbar_extension")
    to = closeness(WALKER, Walk(shown, missing))
    weight = to.weight[:-2].reshape(shown.n_knots, -1)[0]
    at = {j: w for j, w in zip(WALKER.joints, weight, strict=True)}
    assert at["knee_r"] == at["knee_l"] == at["hip_flexion_r"]
    assert max(at["lumbar_flexion"], at["shoulder_r"]) < 0.01 * at["knee_r"]
    off = to.target.copy()
    off[:-2].reshape(shown.n_knots, -1)[:] += 1 / np.sqrt(weight * weight.size * shown.n_knots)
    assert to.squared(off) == pytest.approx(1.0)  # each joint off by what it may be


def test_habits_of_other_bodies_are_refused_unless_accepted(found):
    _, near = found
    check_habit(near)
    stranger = replace(near, degrees={**near.degrees, "knee": 3 * FOREIGN})
    with pytest.raises(InvalidInputError, match="not a habit.*knee 21.*--accept-habit"):
        check_habit(stranger)
    check_habit(stranger, accepted=True)


@pytest.mark.slow
def test_a_crouching_walk_is_refused():
    q = KNOWN.gait.q.copy()
    for joint, degrees in (("hip_flexion", 35), ("knee", 70), ("ankle", 35)):
        for side in "rl":
            q[:, WALKER.joints.index(f"{joint}_{side}")] += np.deg2rad(degrees)
    shown = Gait(q, KNOWN.gait.step_length, KNOWN.gait.half_period)
    with pytest.raises(InvalidInputError, match="not a habit of the body"):
        check_habit(feasible_gait(PLANAR, Walk(shown), KNOWN.w))


def measured(gait):
    """Vertical force under the right foot from the gait's first knot [body weights]."""
    _, sensors = inverse_dynamics(WALKER, *cycle_motion(gait, WALKER.mirror))
    return sensors[:, WALKER.sensor["touch_r"]][:, 0] / WALKER.weight


def test_a_force_is_apart_from_itself_by_nothing_and_from_none_by_its_square():
    force = measured(KNOWN.gait)
    for target, square in ((force, 0.0), (0 * force, np.mean(force**2) / FORCE**2)):
        spec = replace(PLANAR, costs=(*PLANAR.costs, force_apart_from(target)))
        ev = solver_for(spec).problem.evaluate(KNOWN.gait.to_vector())
        pace = ev.motion.pace
        assert ev.objective_costs[-1] == pytest.approx(pace * square, rel=1e-9, abs=1e-12)


def test_a_measured_force_draws_the_nearest_gait_towards_it(found):
    """The force of another gait, whose steps are harder; angles stay as they were."""
    shown, near = found
    other = measured(load_library(PLANAR.body)["impact x3"].gait)
    drawn = feasible_gait(PLANAR, Walk(shown, force=other), KNOWN.w, near=[near.gait])
    before, after = (np.mean((measured(g) - other) ** 2) for g in (near.gait, drawn.gait))
    assert after < 0.9 * before and drawn.root < 1e-4
    assert len(drawn.total_costs) == len(KNOWN.w)
    costs = solver_for(PLANAR).problem.evaluate(drawn.gait.to_vector()).total_costs()
    np.testing.assert_allclose(drawn.total_costs, costs, rtol=1e-9)  # the force is no cost
    known = sensitivity(PLANAR, drawn, Walk(shown, force=other), KNOWN.w)
    assert known is not None and known.shape == (6, 6)
    assert np.linalg.eigvalsh(known).min() > -1e-9 * np.abs(known).max()


def test_a_number_that_is_not_well_known_pulls_less():
    shown = KNOWN.gait
    spread = np.zeros(shown.q.size + 2)
    knee = WALKER.joints.index("knee_r")
    spread[knee], spread[-2] = np.deg2rad(3.0) ** 2, 0.02**2  # as much as they may be off anyhow
    sure, unsure = (closeness(WALKER, Walk(shown, variance=v)).weight for v in (0.0, spread))
    changed = np.flatnonzero(~np.isclose(sure, unsure))
    assert changed.tolist() == [knee, shown.q.size]
    np.testing.assert_allclose(unsure[changed], sure[changed] / 2)
