"""The exact Hessian of w.G against differences of the gradient, for shipped and other costs."""

from dataclasses import dataclass

import numpy as np
import pytest

from walking_irl.domains.humanoid.costs.base import (
    H,
    SharedCost,
    Term,
    read_joints,
    read_sensors,
)
from walking_irl.domains.humanoid.costs.defaults import DEFAULT_COSTS, REFERENCE_WEIGHTS
from walking_irl.domains.humanoid.costs.partials import first_partials, second_partials
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.optimiser.hessian import Structure, half_hessian
from walking_irl.domains.humanoid.optimiser.linearisation import Linearisation
from walking_irl.domains.humanoid.optimiser.ring import Ring
from walking_irl.domains.humanoid.optimiser.transcription import ROOT_PENALTY, Transcription
from walking_irl.domains.humanoid.spec import HUMANOID, PLANAR
from walking_irl.errors import InvalidInputError

W = REFERENCE_WEIGHTS
REACH = 8  # knots farther apart than this do not meet in the Hessian of one column's colour


@dataclass(frozen=True)
class Everything(SharedCost):
    """Residuals that couple what no shipped cost couples: every channel with every other."""

    name: str = "everything"
    unit: str = "1"
    coefficient: float = 1.0
    meaning: str = "Tests the chaining."

    def terms(self, walker):
        joint = walker.joints[walker.n_root :][:4]
        channels = ("q", "v", "v_next", "a", "tau", "tau_next")
        joints = [read_joints(walker, c, joint) for c in channels]
        shift = read_joints(walker, "q", walker.joints[walker.n_root :][1:5])
        point = [("heel_r", 0), ("toe_l", 0), ("ankle_r", 2), ("com", 0)]
        moving = [("touch_r", 0), ("angular_momentum", 1), ("trunk_axis", 0), ("touch_l", 0)]
        sensors = [read_sensors(walker, c, p) for c in ("s", "s_next") for p in (point, moving)]

        def residual(q, v, v_next, a, tau, tau_next, other, s, m, s_next, m_next, h):
            forces = 1 + 0.01 * tau * v_next + 0.003 * tau_next * v + 1e-4 * tau * tau_next
            motion = (
                forces * (q + 0.1 * other) + 1e-3 * a * q + (s_next - s) * (0.1 + 1e-3 * m_next)
            )
            return motion + 0.05 * (s_next - s) / (50 * h) + 1e-3 * m * q + 1e-4 * (m_next - m) * v

        return [Term((*joints, shift, *sensors, H), residual)]


CASES = {
    "spatial": (HUMANOID, DEFAULT_COSTS),
    "planar": (PLANAR, DEFAULT_COSTS),
    "coupled": (PLANAR, (*DEFAULT_COSTS, Everything())),
}


@pytest.fixture(scope="module", params=CASES)
def case(request):
    """A problem, its structure, and a gait near, not on, a shipped one."""
    spec, costs = CASES[request.param]
    problem = Transcription(spec.walker, costs)
    x = load_library(spec.body)["reference"].gait.to_vector()
    joints = np.arange(problem.nv) >= problem.walker.n_root
    noise = np.random.default_rng(0).normal(size=(problem.n_knots, problem.nv)) * joints
    return problem, Structure(problem), x + np.concatenate([1e-3 * noise.ravel(), [0, 0]])


def dense(matrix):
    """The bordered band as a square array, unknowns in natural order."""
    n = matrix.band.shape[1]
    inner = np.zeros((n, n))
    for k, diagonal in enumerate(matrix.band):
        i = np.arange(n - k)
        inner[i + k, i] = inner[i, i + k] = diagonal[: n - k]
    out = np.zeros((n + 2, n + 2))
    out[np.ix_(matrix.permutation, matrix.permutation)] = inner
    out[matrix.permutation, n:], out[n:, matrix.permutation] = matrix.border, matrix.border.T
    out[n:, n:] = matrix.corner
    return out


def gradient(problem, x, penalty):
    return Linearisation(problem, problem.evaluate(x)).at(W, penalty).gradient


def numeric_columns(problem, x, penalty, joint, step):
    """Central differences of the gradient: columns of one joint at all knots, by colours."""
    n, nv = problem.n_knots, problem.nv
    out = np.zeros((n, x.size))
    for colour in range(REACH):
        knots = np.arange(colour, n, REACH)
        e = np.zeros(x.size)
        e[knots * nv + joint] = step
        d = (gradient(problem, x + e, penalty) - gradient(problem, x - e, penalty)) / (2 * step)
        for k in knots:
            near = ((k + np.arange(-3, 4)) % n)[:, None] * nv + np.arange(nv)
            out[k, near.ravel()] = d[near.ravel()]
    return out


@pytest.mark.parametrize("penalty", [0.0, ROOT_PENALTY], ids=["no penalty", "full penalty"])
def test_the_exact_hessian_agrees_with_differences_of_the_gradient(case, penalty):
    """At no penalty the objectives' own curvature is seen, which a full one drowns."""
    problem, structure, x = case
    at = Linearisation(problem, problem.evaluate(x)).at(W, penalty)
    H_exact = dense(half_hessian(at, structure))
    H_gauss = dense(half_hessian(at, structure, is_exact=False))
    nv = problem.nv
    for joint in (0, 2, 5, nv - 2):
        columns = np.arange(problem.n_knots) * nv + joint
        exact, gauss = H_exact[:-2, columns].T, H_gauss[:-2, columns].T
        numeric = numeric_columns(problem, x, penalty, joint, 1.5e-7)[:, :-2]
        scale = np.abs(numeric).max()
        error = np.abs(exact - numeric).max(axis=1)
        assert np.median(error) < 5e-5 * scale  # single knots lie at a border of the cone
        assert np.median(error) < 1e-2 * np.median(np.abs(gauss - numeric).max(axis=1))


@pytest.mark.parametrize("penalty", [0.0, ROOT_PENALTY], ids=["no penalty", "full penalty"])
def test_columns_of_step_length_and_period_agree_with_differences(case, penalty):
    problem, structure, x = case
    at = Linearisation(problem, problem.evaluate(x)).at(W, penalty)
    exact = dense(half_hessian(at, structure))
    for j in (-2, -1):
        e = np.eye(x.size)[j] * 1.5e-7
        numeric = gradient(problem, x + e, penalty) - gradient(problem, x - e, penalty)
        numeric /= 2 * 1.5e-7
        tol = (1e-6 if penalty else 5e-5) * np.abs(numeric).max()
        np.testing.assert_allclose(exact[:, j], numeric, atol=tol)
        np.testing.assert_array_equal(exact[j], exact[:, j])


def test_the_difference_falls_with_the_square_of_the_step(case):
    """What differs is the truncation of the differences, not the Hessian."""
    problem, structure, x = case
    at = Linearisation(problem, problem.evaluate(x)).at(W, 0.0)
    columns = np.arange(problem.n_knots) * problem.nv + 2
    exact = dense(half_hessian(at, structure))[:-2, columns].T
    coarse, fine = (
        np.median(np.abs(numeric_columns(problem, x, 0.0, 2, step)[:, :-2] - exact).max(axis=1))
        for step in (8e-6, 4e-6)
    )
    assert 3.0 < coarse / fine < 5.0


def test_gauss_newton_is_the_jacobian_transposed_times_itself(case):
    problem, structure, x = case
    at = Linearisation(problem, problem.evaluate(x)).at(W, ROOT_PENALTY)
    J = half_hessian(at, structure, is_exact=False)
    rng = np.random.default_rng(1)
    for dx in (rng.normal(size=x.size), np.eye(x.size)[-1], np.eye(x.size)[-2]):
        expected = at.transpose_times(at.times(dx))
        np.testing.assert_allclose(dense(J) @ dx, expected, atol=1e-9 * np.abs(expected).max())


def test_a_factor_solves_and_refuses_indefinite_matrices(case):
    problem, structure, x = case
    at = Linearisation(problem, problem.evaluate(x)).at(W, 1e-4 * ROOT_PENALTY)
    matrix = half_hessian(at, structure, is_exact=False)
    rhs = np.random.default_rng(2).normal(size=x.size)
    found = matrix.factor(1e-3).solve(rhs)
    np.testing.assert_allclose(dense(matrix) @ found + 1e-3 * found, rhs, atol=1e-5)
    with pytest.raises(np.linalg.LinAlgError, match="band"):
        matrix.factor(-2 * np.abs(matrix.band[0]).max())
    bent = matrix._replace(corner=matrix.corner - 1e13 * np.eye(2))
    with pytest.raises(np.linalg.LinAlgError, match="step length"):
        bent.factor(1e-3)


def test_blends_are_linear(case):
    problem, structure, x = case
    at = Linearisation(problem, problem.evaluate(x)).at(W, ROOT_PENALTY)
    gauss, exact = (half_hessian(at, structure, is_exact=e) for e in (False, True))
    expected = 0.75 * dense(gauss) + 0.25 * dense(exact)
    np.testing.assert_allclose(
        dense(gauss.blend(exact, 0.25)), expected, atol=1e-9 * np.abs(expected).max()
    )


def test_given_multipliers_of_the_root_enter_the_curvature(case):
    problem, structure, x = case
    ev = problem.evaluate(x)
    at = Linearisation(problem, ev).at(W, ROOT_PENALTY)
    own = ROOT_PENALTY / problem.n_knots * ev.root
    expected = dense(half_hessian(at, structure))
    given = dense(half_hessian(at, structure, own))
    np.testing.assert_allclose(given, expected, atol=1e-9 * np.abs(expected).max())
    none = dense(half_hessian(at, structure, np.zeros_like(own)))
    assert np.abs(none - expected).max() > 1e-3 * np.abs(expected).max()


def reads_of(place, motion):
    """What a term reads of a motion."""
    return [
        np.full((1, 1), motion.h) if i is None else getattr(motion, r.channel)[:, i]
        for r, i in zip(place.term.reads, place.reads, strict=True)
    ]


def test_closed_first_partials_are_those_by_complex_steps(case):
    problem, _, x = case
    stack, motion = problem.stack, problem.evaluate(x).motion
    assert any(place.term.first is not None for place in stack.places)
    for place, block in zip(stack.places, stack.first(motion).blocks, strict=True):
        if place.term.first is None:
            continue
        reads = reads_of(place, motion)
        exact = first_partials(place.term.residual, reads, block.shape[1:])
        scale = np.abs(exact).max(axis=(1, 2), keepdims=True)
        assert (np.abs(block - exact) <= 1e-13 * scale).all(), place.cost.name  # rounding


def test_closed_second_partials_agree_with_differences_of_complex_steps(case):
    problem, _, x = case
    stack, motion = problem.stack, problem.evaluate(x).motion
    for place, block in zip(stack.places, stack.second(motion), strict=True):
        if place.term.second is None:
            continue
        reads = reads_of(place, motion)
        sizes = [np.full(v.shape[1], 1e-3 * (np.abs(v).max() + 1)) for v in reads]
        sizes = [
            np.minimum(s, 2e-3) if r.channel[0] in "sh" else s
            for s, r in zip(sizes, place.term.reads, strict=True)
        ]
        numeric = second_partials(place.term.residual, reads, sizes, block.shape[2:])
        scale = np.abs(numeric).max(axis=(2, 3), keepdims=True)
        assert (np.abs(block - numeric) <= 1e-5 * scale + 1e-12).all(), place.cost.name


def test_too_few_knots_are_refused():
    with pytest.raises(InvalidInputError, match="at least 8 knots, got 6"):
        Ring(6, 3)
