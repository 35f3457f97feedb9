"""Newton's solver: minima that are minima, statuses that are earned, sensitivities that predict."""

import copy
from dataclasses import replace

import numpy as np
import pytest

from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.learner import WarmStartSolver, check_weights, solver_for
from walking_irl.domains.humanoid.optimiser.newton import FAR, Status
from walking_irl.domains.humanoid.optimiser.solver import PHYSICAL, GaitSolver
from walking_irl.domains.humanoid.optimiser.stages import DIRECT, Stage
from walking_irl.domains.humanoid.optimiser.transcription import ROOT_PENALTY, Transcription
from walking_irl.domains.humanoid.spec import HUMANOID, PLANAR
from walking_irl.errors import SolverError

W = PLANAR.stack.reference_weights
NEAR = {
    s: check_weights(s.stack.reference_weights * [1.1, 1, 1, 0.95, 1, 1])
    for s in (HUMANOID, PLANAR)
}
OTHER = check_weights(W * [1, 1, 3, 1, 1, 1.5])


def reference(spec):
    return load_library(spec.body)["reference"].gait.to_vector()


@pytest.fixture(scope="module", params=[HUMANOID, PLANAR], ids=["spatial", "planar"])
def near(request):
    """A solver, weights near the reference's, the reference, and the optimum of the weights."""
    solver, w = solver_for(request.param), NEAR[request.param]
    x = reference(request.param)
    return solver, w, x, solver.solve(w, x, DIRECT, root=solver.dual(x))


def test_a_converged_gait_is_a_smooth_minimum(near):
    solver, w, x, found = near
    assert found.status is Status.CONVERGED
    lin = solver.linearise(found.x)
    decrement = solver.decrement(w, lin)  # of the true Hessian, no dual estimate
    assert -1e-14 < decrement < 1e-10  # below zero by rounding of its difference
    cost = w @ found.total_costs
    assert cost < w @ solver.problem.evaluate(x).total_costs()
    rng = np.random.default_rng(0)
    for _ in range(3):  # no step along a direction of small curvature lowers the cost
        dx = solver.sensitivity(w, lin)[1] @ rng.normal(size=6)
        for step in (1e-3, -1e-3):
            moved = found.x + step * dx / np.abs(dx).max()
            assert w @ solver.problem.evaluate(moved).total_costs() > cost


def test_the_last_iterations_converge_quadratically(near):
    solver, w, x, _ = near
    costs = []
    solver.solve(w, x, DIRECT, root=solver.dual(x), on_step=lambda i, c: costs.append(c))
    assert len(costs) <= 8  # Gauss-Newton's metric takes dozens
    assert costs == sorted(costs, reverse=True)


def test_sensitivities_predict_resolved_gaits(near):
    """d mu / d w and d x / d w of the exact Hessian against re-solves at moved weights."""
    solver, w, _, found = near
    M, by_w, _ = solver.sensitivity(w, solver.linearise(found.x), found.root)
    assert np.linalg.eigvalsh(M).min() > -1e-9 * np.abs(M).max()
    np.testing.assert_allclose(M @ w, 0, atol=0.02 * np.abs(M).max())
    for j in (0, 5):
        step = 0.001 * (np.eye(6)[j] - w)  # farther, contacts jump
        ends = [solver.solve(w + s * step, found.x, root=found.root) for s in (1, -1)]
        dx = (ends[0].x - ends[1].x) / 2
        dmu = -(ends[0].total_costs - ends[1].total_costs) / 2
        # central differences over 0.2 % of the weights: third derivatives remain
        np.testing.assert_allclose(dmu, M @ step, atol=0.005 * np.abs(dmu).max())
        np.testing.assert_allclose(dx, by_w @ step, atol=0.005 * np.abs(dx).max())


def test_a_solve_is_deterministic_and_passes_no_better_gait_than_its_answer():
    solver, x = solver_for(PLANAR), reference(PLANAR)
    first, again = (solver.solve(OTHER, x, root=solver.dual(x)) for _ in range(2))
    np.testing.assert_array_equal(first.x, again.x)
    assert len(first.passed) > 0
    # the anchors of the cycle are in what the solver minimises, and in nobody's costs
    assert (first.passed @ OTHER).min() >= OTHER @ first.total_costs * (1 - 1e-7)


def test_a_known_demonstration_ends_a_far_query_early():
    solver, x = solver_for(PLANAR), reference(PLANAR)
    known = float(OTHER @ solver.problem.evaluate(x).total_costs())
    whole = solver.solve(OTHER, x, root=solver.dual(x))
    early = solver.solve(OTHER, x, root=solver.dual(x), known=known)
    best = OTHER @ whole.total_costs
    assert known / best - 1 > FAR  # the query is far
    assert early.iterations < whole.iterations
    assert early.status in (Status.DECISIVE, Status.CONVERGED)
    left, regret = OTHER @ early.total_costs - best, known - best
    assert left < 0.25 * regret  # it cuts nearly as deep


def test_an_indefinite_hessian_gives_no_sensitivity():
    solver, x = solver_for(PLANAR), reference(PLANAR)
    moved = x + 0.05 * np.random.default_rng(1).normal(size=x.size)
    moved[-2:] = x[-2:]
    lin = solver.linearise(moved)
    assert solver.sensitivity(W, lin) is None
    assert solver.decrement(W, lin) == np.inf


def test_a_start_without_finite_cost_is_named():
    solver, x = solver_for(PLANAR), reference(PLANAR)
    with pytest.raises(SolverError, match="no finite cost; start from one of the known gaits"):
        solver.solve(W, np.full_like(x, np.nan))


def test_a_capped_solve_says_so():
    solver, x = solver_for(PLANAR), reference(PLANAR)
    capped = (Stage(ROOT_PENALTY, 1, 1e-12),)
    assert solver.solve(OTHER, x, capped).status is Status.CAPPED


def test_the_nearest_physical_gait_is_nearer_than_the_best_one():
    solver, x = solver_for(PLANAR), reference(PLANAR)
    start = solver.perturb(x, np.deg2rad(0.1), np.random.default_rng(2))
    assert solver.dual(start) is None  # not physical
    held = solver.physical(start)
    assert ROOT_PENALTY * solver.problem.evaluate(held).root_square < PHYSICAL
    np.testing.assert_array_equal(solver.physical(held), held)
    best = solver.solve(W, held, root=solver.dual(held)).x
    assert np.linalg.norm(held - start) < np.linalg.norm(best - start)


def uncovered(spec):
    """A solver of a body without closed-form derivatives."""
    model = copy.copy(spec.walker.model)
    model.geom_solimp[:, 4] = 3
    return GaitSolver(Transcription(replace(spec.walker, model=model)))


def test_a_body_without_closed_form_is_solved_in_gauss_newtons_metric():
    solver, x = uncovered(PLANAR), reference(PLANAR)
    assert "solimp" in solver.problem.dynamics.reason
    before = solver.problem.evaluate(x).total(W, ROOT_PENALTY)
    found = solver.solve(W, x, (Stage(ROOT_PENALTY, 4, 1e-6),))
    assert solver.problem.evaluate(found.x).total(W, ROOT_PENALTY) < 0.5 * before
    M = solver.sensitivity(W, solver.linearise(found.x))[0]
    assert np.linalg.eigvalsh(M).min() > -1e-9 * np.abs(M).max()


def test_a_warm_start_answers_with_the_demonstration_at_its_own_weights(near):
    solver, w, _, found = near
    spec = HUMANOID if solver.problem.nv == 25 else PLANAR
    gait = Gait.from_vector(found.x, solver.problem.nv)
    answer = WarmStartSolver(gait, spec)(w)
    np.testing.assert_allclose(-answer.mu, found.total_costs, rtol=1e-6)
    assert answer.sensitivity is not None
    assert answer.info["decrement"] < 1e-8


def test_a_demonstration_that_nobody_could_walk_is_made_physical_first(near):
    """As the mean of recorded cycles: near the optimum, and dearer by its root forces alone."""
    solver, w, _, found = near
    spec = HUMANOID if solver.problem.nv == 25 else PLANAR
    noise = np.random.default_rng(3).normal(size=found.x.size) * 1e-5
    shown = Gait.from_vector(found.x + noise, solver.problem.nv)
    learner = WarmStartSolver(shown, spec, mu=-found.total_costs)
    cost = float(w @ found.total_costs)
    assert w @ solver.problem.evaluate(shown.to_vector()).total_costs() > 1.001 * cost
    assert w @ learner.demonstrated < 1.001 * cost
    answer = learner(w)
    assert -answer.mu @ w == pytest.approx(cost, rel=1e-7)
    np.testing.assert_allclose(answer.policy.to_vector(), found.x, atol=1e-4)


@pytest.mark.parametrize("unknown", [-2, -1], ids=["step length", "half period"])
def test_a_gait_that_does_not_go_forward_is_no_start_and_no_step(unknown):
    """Its costs per metre are negative: it would be cheaper than every walk."""
    x = reference(PLANAR)
    x[unknown] *= -1
    with pytest.raises(SolverError):
        solver_for(PLANAR).solve(W, x)
