"""The optimal control problem of the gait: derivatives, symmetry, sensitivities, physics."""

import mujoco
import numpy as np
import pytest

from walking_irl.domains.humanoid.body.load import load_walker
from walking_irl.domains.humanoid.costs.defaults import OBJECTIVES, REFERENCE_WEIGHTS
from walking_irl.domains.humanoid.costs.gap import LegGap
from walking_irl.domains.humanoid.gait.gait import Gait, cycle_motion
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.gait.pictures import LOOK_GROUP
from walking_irl.domains.humanoid.learner import check_weights, solver_for
from walking_irl.domains.humanoid.optimiser.hessian import half_hessian
from walking_irl.domains.humanoid.optimiser.linearisation import weighted
from walking_irl.domains.humanoid.optimiser.transcription import ROOT_PENALTY
from walking_irl.domains.humanoid.spec import WalkerSpec
from walking_irl.errors import InvalidInputError

BODIES = pytest.mark.parametrize("body", ["humanoid", "humanoid-planar"])
W = REFERENCE_WEIGHTS
SOFT = ROOT_PENALTY * 1e-4  # root forces do not drown the other terms in the comparisons

GAPS = dict(LegGap().gaps)
"""Lateral distance that each pair of points keeps, softly [m]."""


def leg_width(model, point):
    """How far the drawn parts that a point belongs to reach inwards, both legs together [m]."""
    parts = ["thigh_low", "knee", "shin_top", "calf"]
    if point != "knee":
        foot = model.body("foot_r").id
        looks = [g for g in range(model.ngeom) if model.geom_bodyid[g] == foot]
        names = [model.geom(g).name for g in looks if model.geom_group[g] == LOOK_GROUP]
        parts = [n.removeprefix("look_").removesuffix("_r") for n in names]
    capsule = mujoco.mjtGeom.mjGEOM_CAPSULE
    geoms = {s: [model.geom(f"look_{part}_{s}") for part in parts] for s in "rl"}
    wide = {s: [g.size[0 if g.type == capsule else 1] for g in geoms[s]] for s in "rl"}
    right = max(g.pos[1] + w for g, w in zip(geoms["r"], wide["r"], strict=True))
    left = max(w - g.pos[1] for g, w in zip(geoms["l"], wide["l"], strict=True))
    return float(right + left)


@pytest.fixture(scope="module", params=["humanoid", "humanoid-planar"])
def linear(request):
    """A gait off every optimum, with its linearisation."""
    solver = solver_for(WalkerSpec(request.param))
    x = load_library(request.param)["reference"].gait.to_vector()
    x = x + 1e-3 * np.random.default_rng(0).normal(size=x.size)
    return solver, solver.linearise(x)


def directions(size):
    rng = np.random.default_rng(1)
    yield rng.normal(size=size)
    yield np.eye(size)[-1]  # half period
    yield np.eye(size)[-2]  # step length


def by_term(solver, *terms):
    """Name and columns of each cost's term, then root and anchors, of several Terms."""
    for place in solver.problem.stack.places:
        yield place.cost.name, *(t.costs[:, place.columns] for t in terms)
    yield "root", *(t.root for t in terms)
    yield "anchors", *(t.anchors for t in terms)


def test_jacobian_agrees_with_finite_differences(linear):
    solver, lin = linear
    x = lin.evaluation.x

    def residual(y):
        return weighted(solver.problem.stack, solver.problem.evaluate(y), W, SOFT)

    for dx in directions(x.size):
        eps = 1e-7
        ahead, behind = residual(x + eps * dx), residual(x - eps * dx)
        for name, a, b, c in by_term(solver, lin.at(W, SOFT).times(dx), ahead, behind):
            numeric = (b - c) / (2 * eps)
            np.testing.assert_allclose(
                a, numeric, atol=2e-5 * np.abs(numeric).max(initial=0) + 1e-9, err_msg=name
            )


def test_transposed_jacobian_is_the_adjoint(linear):
    _, lin = linear
    rng = np.random.default_rng(2)
    dx = rng.normal(size=lin.evaluation.x.size)
    at = lin.at(W, SOFT)
    forward = at.times(dx)
    y = forward.like(rng.normal(size=forward.flat().size))
    assert forward.flat() @ y.flat() == pytest.approx(at.transpose_times(y) @ dx, rel=1e-9)


def test_normal_matrix_is_jacobian_transposed_times_jacobian(linear):
    solver, lin = linear
    at = lin.at(W, SOFT)
    factor = half_hessian(at, solver.structure, is_exact=False).factor(1e-2)
    for dx in directions(lin.evaluation.x.size):
        rhs = at.transpose_times(at.times(dx)) + 1e-2 * dx
        np.testing.assert_allclose(factor.solve(rhs), dx, atol=1e-6)


def test_gradient_is_the_transposed_jacobian_times_the_residuals(linear):
    at = linear[1].at(W, SOFT)
    np.testing.assert_allclose(
        at.gradient,
        at.transpose_times(at.residuals),
        rtol=1e-9,
        atol=1e-9 * np.abs(at.gradient).max(),
    )


def test_weighted_squares_sum_to_the_total_and_folded_costs_mix_linearly(linear):
    solver, lin = linear
    ev = lin.evaluation
    for w in (W, np.eye(6)[2], np.full(6, 1 / 6)):
        squares = weighted(solver.problem.stack, ev, w, SOFT).flat()
        assert squares @ squares == pytest.approx(ev.total(w, SOFT), rel=1e-12)
        whole = w @ ev.total_costs() + ev.anchoring
    assert whole == pytest.approx(ev.total(w, ROOT_PENALTY), rel=1e-12)


@BODIES
def test_costs_of_a_gait_and_of_its_mirror_image_are_equal(body):
    problem = solver_for(WalkerSpec(body)).problem
    gait = load_library(body)["work x3"].gait
    q = gait.q @ problem.walker.mirror.T
    mirrored = Gait(q - [q[0, 0], *np.zeros(q.shape[1] - 1)], gait.step_length, gait.half_period)
    folded = problem.evaluate(gait.to_vector()).total_costs()
    np.testing.assert_allclose(
        problem.evaluate(mirrored.to_vector()).total_costs(), folded, rtol=1e-6
    )


@BODIES
def test_optimal_gaits_are_physical_and_do_not_pass_through_themselves(body):
    problem = solver_for(WalkerSpec(body)).problem
    for name, shipped in load_library(body).items():
        ev = problem.evaluate(shipped.gait.to_vector())
        assert np.abs(ev.root).max() < 5e-4, name  # of body weight
        np.testing.assert_allclose(ev.total_costs(), shipped.total_costs, rtol=1e-6)
        of = {p.cost.name: ev.residuals[:, p.columns] for p in problem.stack.places}
        assert np.abs(of["limits"]).max() < np.deg2rad(1.0), name
        if problem.walker.is_lateral:
            lack = dict(zip(GAPS, of["gap"].min(axis=0), strict=True))
            for point, gap in GAPS.items():
                assert gap + lack[point] > leg_width(problem.walker.model, point), (name, point)


@BODIES
def test_a_gait_is_a_trajectory_of_the_simulator(body):
    """At the knot timestep, torques of inverse dynamics reproduce the next knot."""
    walker = load_walker(body)
    gait = load_library(body)["reference"].gait
    q, v, a = cycle_motion(gait, walker.mirror)
    model = walker.model_at(gait.timestep)
    data = mujoco.MjData(model)
    inverse = mujoco.MjData(walker.model)
    for k in range(0, gait.n_knots - 1, 7):
        inverse.qpos[:], inverse.qvel[:], inverse.qacc[:] = q[k], v[k], a[k]
        mujoco.mj_inverse(walker.model, inverse)
        data.qpos[:], data.qvel[:] = q[k], v[k]
        data.ctrl[:] = inverse.qfrc_inverse[walker.n_root :]
        mujoco.mj_step(model, data)
        np.testing.assert_allclose(data.qpos, q[k + 1], atol=1e-5)


@pytest.mark.parametrize(
    ("bad", "says"),
    [
        (np.ones(5), "expected 6 weights .*got 5"),
        ([1, 1, 1, 1, 1, -1], "finite, >= 0 and not all zero"),
        ([1, 1, 1, 1, 1, np.nan], "finite, >= 0 and not all zero"),
        (np.zeros(6), "finite, >= 0 and not all zero"),
    ],
)
def test_bad_weights_are_named(bad, says):
    with pytest.raises(InvalidInputError, match=says):
        check_weights(np.asarray(bad, dtype=float))


def test_each_objective_is_best_in_the_gait_that_weighs_it_most():
    library = load_library()
    costs = np.array([library[f"{o.name} x3"].total_costs for o in OBJECTIVES])
    np.testing.assert_array_equal(costs.argmin(axis=0), np.arange(len(OBJECTIVES)))
