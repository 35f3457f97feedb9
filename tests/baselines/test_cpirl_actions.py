from dataclasses import replace

import numpy as np
import pytest

from walking_irl.baselines.cpirl_actions import complete, cpirl_actions, estimate
from walking_irl.cpirl import cpirl
from walking_irl.domains.mdp.random_mdp import RandomMDP
from walking_irl.errors import InvalidInputError
from walking_irl.rl.demonstrations import Demonstrations, demonstrate
from walking_irl.rl.tabular import best_policy, loss, policy_value
from walking_irl.types import Expert, Response, Status


def seen(seed, n=5, H=20):
    domain = RandomMDP(seed=seed)
    rng = np.random.default_rng(seed)
    w = rng.dirichlet(np.ones(5))
    pi = best_policy(domain.mdp, domain.mdp.reward(w)).pi
    return domain.mdp, demonstrate(domain.mdp, pi, n, H, rng=rng), w, pi, rng


def test_completion_acts_as_demonstrated_and_is_the_best_that_does():
    mdp, D, w, _, rng = seen(0, n=2)
    counts = D.counts(50, 4)
    is_seen = counts.sum(axis=1) > 0
    assert 5 < is_seen.sum() < 45
    v = rng.dirichlet(np.ones(5))
    completed = complete(mdp, v, counts)
    shares = counts[is_seen] / counts[is_seen].sum(axis=1, keepdims=True)
    np.testing.assert_allclose(completed.policy[is_seen], shares)
    np.testing.assert_allclose(mdp.start @ completed.V, v @ completed.mu, atol=1e-9)
    for _ in range(50):  # no single change of action elsewhere, and no random policy, is better
        other = completed.policy.copy()
        free = np.flatnonzero(~is_seen)
        other[free] = np.eye(4)[rng.integers(4, size=len(free))]
        assert (policy_value(mdp, other, mdp.reward(v)) <= completed.V + 1e-9).all()
    Q = mdp.action_values(mdp.reward(v), completed.V)
    assert (Q.max(axis=0) <= completed.V + 1e-9)[~is_seen].all()
    assert estimate(mdp, w, counts).g == pytest.approx(0.0, abs=1e-9)  # the truth explains it


def test_on_random_worlds_no_demonstrated_action_is_left_suboptimal():
    for seed in range(10):
        mdp, D, w, _, rng = seen(seed)
        found = cpirl_actions(mdp, D, rng=rng)
        assert found.status is Status.MATCHED and not found.notes
        r = mdp.reward(found.w)
        V = best_policy(mdp, r).V
        Q = mdp.action_values(r, V)[D.actions.ravel(), D.states.ravel()]
        assert (V[D.states.ravel()] - Q).max() <= 1e-6 * np.abs(V).max()
        assert found.w.min() >= 0 and found.w.sum() == pytest.approx(1.0)


def test_the_shortfall_never_rises():
    for seed in range(5):
        mdp, D, _, pi, rng = seen(seed, n=3)
        noisy = D.actions.copy()  # an expert that errs: nothing explains it all
        wrong = rng.random(noisy.shape) < 0.1
        noisy[wrong] = rng.integers(4, size=int(wrong.sum()))
        found = cpirl_actions(mdp, Demonstrations(D.states, noisy), rng=rng)
        assert (np.diff(found.objective) <= 1e-12).all()
        assert found.info["shortfall"] > 0
        assert "prefer a likelihood method" in found.notes[0]


def test_few_demonstrations_suffice_where_the_expert_is_optimal():
    losses = []
    for seed in range(4):
        mdp, D, w, _, rng = seen(seed, H=50)
        found = cpirl_actions(mdp, D, rng=rng)
        losses.append(loss(mdp, mdp.reward(w), found.policy))
        assert found.info["solves"] <= 60
    assert np.mean(losses) <= 0.005


def test_a_complete_policy_gives_one_round_and_cpirl_itself():
    mdp, _, w, pi, _ = seen(4)
    every = Demonstrations(np.arange(50)[:, None], pi[:, None])
    world = replace(mdp, start=np.full(50, 1 / 50))
    found = cpirl_actions(mdp, every, rng=np.random.default_rng(0), w=np.full(5, 0.2))
    known, queries = [], []

    def forward(v):
        solved = best_policy(world, world.reward(v), pi=known[-1] if known else None).pi
        known.append(solved)
        queries.append(v)
        return Response(solved, world.feature_expectations(solved))

    mu_E = world.feature_expectations(pi)
    even = best_policy(world, world.reward(np.full(5, 0.2))).pi
    first = True

    def warm(v):
        nonlocal first
        answer = forward(v)
        if first:
            answer = replace(answer, evaluated=world.feature_expectations(even)[None])
            first = False
        return answer

    *_, last = cpirl(
        warm,
        Expert(mu_E, np.zeros(5)),
        mode="minimise",
        max_solves=25,
        rng=np.random.default_rng(0),
    )
    assert len(found.objective) == 2
    assert found.info["solves"] == len(queries) + 3
    np.testing.assert_allclose(found.info["intervals"], last.intervals, atol=1e-12)


def test_intervals_of_a_complete_policy_hold_the_truth():
    mdp, _, w, pi, rng = seen(5)
    every = Demonstrations(np.arange(50)[:, None], pi[:, None])
    low, high = cpirl_actions(mdp, every, rng=rng).info["intervals"].T
    assert (low - 1e-6 <= w).all() and (w <= high + 1e-6).all()
    assert (high - low).max() < 0.8  # of 1: cuts from every side


def test_bad_demonstrations_are_named():
    mdp, *_ = seen(6)
    with pytest.raises(InvalidInputError, match="states must lie from 0 to 49"):
        cpirl_actions(mdp, Demonstrations([[50]], [[0]]), rng=np.random.default_rng(0))
