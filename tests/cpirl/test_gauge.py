"""Weights that no behaviour tells apart are found out, and explain nothing."""

import numpy as np
import pytest

from walking_irl.cpirl.gauge import gauge_fixed, has_constant_sum, unidentifiable
from walking_irl.cpirl.loop import cpirl
from walking_irl.cpirl.summary import summarise
from walking_irl.domains.lqr import LQR
from walking_irl.domains.mdp.gridworld import Gridworld
from walking_irl.errors import InvalidInputError
from walking_irl.types import Status


def random_policies(domain, n, rng):
    K = len(domain.objectives)
    return np.array([domain.forward(w).mu for w in rng.dirichlet(np.ones(K), n)])


@pytest.mark.parametrize("share", [1.0, 0.5, 0.1])
def test_weights_of_one_ray_from_the_middle_make_the_same_policy_optimal(share):
    rng = np.random.default_rng(0)
    domain, w = Gridworld(16, 3, "macro"), rng.dirichlet(np.ones(9))
    on_ray = share * w + (1 - share) / 9
    np.testing.assert_allclose(domain.forward(on_ray).mu, domain.forward(w).mu, atol=1e-9)
    np.testing.assert_allclose(gauge_fixed(on_ray), gauge_fixed(w), atol=1e-12)
    assert gauge_fixed(np.full(9, 1 / 9)) is None


def test_gauge_is_seen_in_policies_and_only_where_there_is_one():
    rng = np.random.default_rng(1)
    macro = random_policies(Gridworld(16, 3, "macro"), 27, rng)
    np.testing.assert_allclose(np.abs(unidentifiable(macro)), [np.full(9, 1 / 3)], atol=1e-9)
    assert has_constant_sum(macro[1:] - macro[0])
    for domain in (Gridworld(16, 3), LQR(5)):
        M = random_policies(domain, 27, rng)
        assert unidentifiable(M).shape == (0, len(domain.objectives))
        assert not has_constant_sum(M[1:] - M[0])
    assert not has_constant_sum(np.zeros((3, 4)))
    with pytest.raises(InvalidInputError, match="at least 10 policies"):
        unidentifiable(macro[:9])


@pytest.mark.parametrize("seed", range(3))
def test_macro_cells_are_not_matched_by_uniform_weights(seed):
    rng = np.random.default_rng(seed)
    domain = Gridworld(16, 3, "macro")
    w_E = domain.random_weights("sparse", rng)
    expert = domain.expert(w_E, rng)
    run = list(cpirl(domain.forward, expert, rng=rng))
    assert run[-1].status is Status.MATCHED
    assert len(run) > 1 and run[0].status is Status.CUT
    assert all(i.polyhedron.contains(w_E) for i in run)
    v = gauge_fixed(run[-1].estimate)
    assert v is not None
    assert v @ (domain.forward(v).mu - expert.mu) <= 1e-6 * (v @ expert.mu)
    loss = w_E @ (expert.mu - run[-1].response.mu)
    # These weights explain the expert; they need not be its own.
    assert loss <= 1e-4 * (w_E @ expert.mu)
    gauge = summarise(run, expert, domain.objectives).gauge
    assert gauge is not None and "sum to a constant" in gauge


def test_no_gauge_is_reported_where_there_is_none():
    rng = np.random.default_rng(0)
    expert = LQR(3).expert(rng.dirichlet(np.ones(3)), rng)
    run = list(cpirl(LQR(3).forward, expert, rng=rng))
    assert summarise(run, expert).gauge is None
