"""A centre of one's own is a function, passed wherever a centre's name is."""

import numpy as np
import pytest

from walking_irl.cpirl.algorithm3 import algorithm3
from walking_irl.cpirl.loop import cpirl
from walking_irl.domains.lqr import LQR
from walking_irl.errors import FlatPolyhedronError, InvalidInputError
from walking_irl.geometry.centres import centre_rule
from walking_irl.geometry.centres.analytic import analytic
from walking_irl.geometry.polyhedron import WeightPolyhedron
from walking_irl.types import Status


def middle_of_vertices(P, *, rng):
    return P.vertices().mean(axis=0)


def made_up_expert(seed=0, K=4):
    rng = np.random.default_rng(seed)
    w_E = rng.dirichlet(np.ones(K))
    return LQR(K), w_E, LQR(K).expert(w_E, rng), rng


@pytest.mark.parametrize("find", [cpirl, algorithm3])
def test_own_centre_asks_and_recovers(find):
    problem, w_E, expert, rng = made_up_expert()
    asked = []

    def centre(P, *, rng):
        asked.append(middle_of_vertices(P, rng=rng))
        return asked[-1]

    run = list(find(problem.forward, expert, centre=centre, rng=rng, max_solves=25))
    np.testing.assert_allclose(run[0].w, 0.25)
    assert all(step.polyhedron.contains(w_E) for step in run)
    queries = [step.w for step in run]
    assert np.abs(np.array(asked)[:, None] - queries).max(axis=2).min(axis=0)[:2].max() <= 1e-12
    assert min(np.abs(q - w_E).max() for q in queries) <= 0.02
    if find is cpirl:
        assert run[-1].status in (Status.MATCHED, Status.CONVERGED)


def test_a_centre_given_as_function_is_the_one_of_that_name():
    problem, _, expert, rng = made_up_expert(1)
    by_name, by_rule = (
        list(cpirl(problem.forward, expert, centre=c, rng=rng)) for c in ("ac", analytic)
    )
    np.testing.assert_array_equal([i.w for i in by_name], [i.w for i in by_rule])


def test_weights_become_a_centre_with_a_ball_inside():
    P = WeightPolyhedron.simplex(3).cut(np.array([1.0, -1.0, 0.2]))
    found = centre_rule(middle_of_vertices)(P, rng=np.random.default_rng(0))
    np.testing.assert_allclose(found.w, P.vertices().mean(axis=0))
    reach = np.sqrt(np.einsum("ij,jk,ik->i", P.A, found.shape, P.A))
    assert (P.A @ found.z + found.inner * reach - P.b).max() == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    "answer", [np.ones(3), np.full(2, 0.5), np.array([0.9, 0.05, 0.05]), [np.nan] * 3, None]
)
def test_what_is_no_point_of_the_polyhedron_is_named(answer):
    P = WeightPolyhedron.simplex(3).cut(np.array([1.0, -1.0, 0.0]))
    with pytest.raises(InvalidInputError, match="must return 3 weights inside the polyhedron"):
        centre_rule(lambda P, *, rng: answer)(P, rng=np.random.default_rng(0))


def test_own_centre_is_not_asked_where_there_is_none():
    d = np.array([1.0, -1.0, 0.0])
    flat = WeightPolyhedron.simplex(3).cut_all(np.array([d, -d]))
    with pytest.raises(FlatPolyhedronError):
        centre_rule(lambda P, *, rng: pytest.fail("asked"))(flat, rng=np.random.default_rng(0))
