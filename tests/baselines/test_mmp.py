import sys

import cvxpy
import numpy as np
import pytest
from scipy import sparse
from small_mdps import random_mdp

from walking_irl.baselines.mmp import augmented, by_cuts, by_subgradients, margins, mmp
from walking_irl.baselines.mmp_boost import boost, mmp_boost
from walking_irl.errors import InvalidInputError
from walking_irl.rl.demonstrations import Demonstrations, demonstrate
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.rl.tabular import best_policy, loss
from walking_irl.types import Status

RIDGE = 1e-2


def problem(seed=0, n=8, S=20):
    rng = np.random.default_rng(seed)
    mdp = random_mdp(rng, S=S)
    w = rng.dirichlet(np.ones(4))
    D = demonstrate(mdp, best_policy(mdp, mdp.reward(w)).pi, n, 20, rng=rng)
    return mdp, D, D.feature_expectations(mdp.Phi, 0.9), margins(D.counts(S, 3)), w, rng


def quadratic_program(mdp, mu_E, l_sa, is_nonnegative=False):
    """Equation 3.10 with values V as variables, by cvxpy: the planner is in the constraints."""
    S, A = mdp.n_states, mdp.n_actions
    w, V, z = cvxpy.Variable(len(mu_E)), cvxpy.Variable(S), cvxpy.Variable()
    T = mdp.T.toarray().reshape(A, S, S)
    rules = [w @ mu_E + z >= mdp.start @ V] + ([w >= 0] if is_nonnegative else [])
    rules += [V >= mdp.Phi @ w + l_sa[:, a] + 0.9 * (T[a] @ V) for a in range(A)]
    program = cvxpy.Problem(cvxpy.Minimize(RIDGE / 2 * cvxpy.sum_squares(w) + z), rules)
    program.solve(solver=cvxpy.CLARABEL, tol_gap_abs=1e-10, tol_gap_rel=1e-10, tol_feas=1e-10)
    return w.value, program.value


def test_margins_are_the_shares_of_other_actions():
    np.testing.assert_allclose(
        margins(np.array([[3.0, 1.0], [0.0, 0.0], [2.0, 0.0]])), [[0.25, 0.75], [0, 0], [0, 1]]
    )


@pytest.mark.parametrize("is_nonnegative", [False, True])
def test_cuts_reach_the_value_of_the_quadratic_program(is_nonnegative):
    mdp, _, mu_E, l_sa, _, _ = problem()
    w, value = quadratic_program(mdp, mu_E, l_sa, is_nonnegative)
    found = by_cuts(mdp, mu_E, l_sa, ridge=RIDGE, tol=1e-9, is_nonnegative=is_nonnegative)
    assert found.c == pytest.approx(value, abs=1e-6)
    assert found.lower <= found.c + 1e-8
    np.testing.assert_allclose(found.w, w, atol=1e-4 * max(1.0, np.abs(w).max()))
    assert len(found.log) <= 60


def test_subgradients_bound_the_objective_from_below():
    mdp, _, mu_E, l_sa, _, rng = problem(1)
    points = 3 * rng.standard_normal((200, 4))
    at = [augmented(mdp, w, mu_E, l_sa, RIDGE) for w in points]
    slopes = np.array([mdp.Phi.T @ a.visits - mu_E for a in at]) + RIDGE * points
    values = np.array([a.c for a in at])
    for w, c in zip(points, values, strict=True):
        assert (c >= values + ((w - points) * slopes).sum(axis=1) - 1e-8).all()


def test_subgradient_method_comes_as_close_as_its_rate_says():
    mdp, _, _, _, w, _ = problem()
    pi = best_policy(mdp, mdp.reward(w)).pi
    mu_E, l_sa = mdp.feature_expectations(pi), margins(np.eye(3)[pi])
    _, value = quadratic_program(mdp, mu_E, l_sa)
    gaps = [by_subgradients(mdp, mu_E, l_sa, ridge=RIDGE, n_steps=n).c - value for n in (100, 1000)]
    assert -1e-8 <= gaps[1] <= gaps[0]
    # The bound of averaged subgradient steps, 2 G^2 / (ridge (T + 1)) with slopes up to G, is far
    # above what is reached: 9e-4 and 3e-5 here.
    assert gaps[0] <= 1e-3 and gaps[1] <= 1e-4
    kept = by_subgradients(mdp, mu_E, l_sa, ridge=RIDGE, n_steps=200, is_nonnegative=True)
    assert kept.w.min() >= 0


def test_without_margins_the_ridge_leaves_no_weights():
    mdp, _, _, l_sa, w, _ = problem()
    mu_E = mdp.feature_expectations(best_policy(mdp, mdp.reward(w)).pi)
    found = by_cuts(mdp, mu_E, 0 * l_sa, ridge=RIDGE, tol=1e-9)
    np.testing.assert_allclose(found.w, 0, atol=1e-4)
    assert found.c == pytest.approx(0, abs=1e-6)


def test_known_policies_are_cuts_for_new_features_too():
    mdp, _, mu_E, l_sa, _, _ = problem(2)
    cold = by_cuts(mdp, mu_E, l_sa, ridge=RIDGE, tol=1e-8)
    warm = by_cuts(mdp, mu_E, l_sa, ridge=RIDGE, tol=1e-8, cuts=cold.cuts)
    assert len(warm.log) <= 2
    assert warm.c == pytest.approx(cold.c, abs=1e-6)


def test_many_demonstrations_explain_the_expert():
    losses = []
    for seed in range(3):
        mdp, D, _, _, w, _ = problem(seed, n=100)
        found = mmp(mdp, D)
        assert found.status is Status.GAP_CLOSED
        losses.append(loss(mdp, mdp.reward(w), found.policy))
    assert np.mean(losses) <= 0.02
    assert mmp(mdp, D, method="subgradient", max_solves=50).status is Status.BUDGET


def test_too_small_samples_and_unfinished_runs_are_pointed_out():
    mdp, D, *_ = problem(3, n=2)
    found = mmp(mdp, D, has_own_start=False)
    assert found.info["c"] >= 0 or any("too few trajectories" in note for note in found.notes)
    assert "give it more solves" in mmp(mdp, D, max_solves=1).notes[0]
    with pytest.raises(InvalidInputError, match="choose from cuts, subgradient"):
        mmp(mdp, D, method="newton")
    with pytest.raises(InvalidInputError, match="ridge"):
        mmp(mdp, D, ridge=0.0)


def chessboard(size=12, block=3, success=0.7):
    """Stay or move on a grid whose blocks pay 0 and 1 in turn: not linear in x and y."""
    S = size**2
    y, x = np.divmod(np.arange(S), size)
    moves = [(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1)]
    target = [
        np.clip(y + dy, 0, size - 1) * size + np.clip(x + dx, 0, size - 1) for dy, dx in moves
    ]
    rows = []
    for a in range(5):
        p = np.full(5, (1 - success) / 4)
        p[a] = success
        columns = (np.tile(np.arange(S), 5), np.concatenate(target))
        rows.append(sparse.csr_array((np.repeat(p, S), columns), shape=(S, S)))
    X = np.column_stack([x, y]) / size
    mdp = FiniteMDP(sparse.vstack(rows).tocsr(), X, np.full(S, 1 / S), 0.9)
    return mdp, ((x // block + y // block) % 2).astype(float)


@pytest.mark.slow
def test_boosting_learns_a_chessboard_that_no_linear_reward_explains():
    pytest.importorskip("sklearn")
    mdp, r = chessboard()
    boosted, linear = [], []
    for seed in range(1):
        D = demonstrate(mdp, best_policy(mdp, r).pi, 100, 40, rng=np.random.default_rng(seed))
        found = mmp_boost(mdp, D, n_rounds=16)
        boosted.append(loss(mdp, r, found.policy))
        linear.append(loss(mdp, r, mmp(mdp, D).policy))
        np.testing.assert_allclose(found.info["model"].predict(mdp.Phi), found.reward, atol=1e-9)
    assert max(boosted) <= 0.1
    assert min(linear) >= 0.3


def test_the_boosted_cost_never_rises_and_stays_positive_for_exact_visits():
    pytest.importorskip("sklearn")
    mdp, r = chessboard(size=8, block=2)
    pi = best_policy(mdp, r).pi
    l_sa = margins(np.eye(5)[pi])
    model, fits = boost(mdp, mdp.Phi, mdp.visits(pi), l_sa, n_rounds=5, depth=3, ridge=1e-2)
    c = np.array([fit.c for fit in fits])
    assert (np.diff(c) <= 1e-3 * np.maximum(1, c[:-1])).all()
    assert c.min() >= -1e-9 and c[-1] < 0.9 * c[0]
    assert len(model.trees) == 5 and len(model.w) == 6


def test_boosting_transfers_by_features_alone():
    pytest.importorskip("sklearn")
    mdp, r = chessboard()
    D = demonstrate(mdp, best_policy(mdp, r).pi, 100, 40, rng=np.random.default_rng(3))
    model = mmp_boost(mdp, D, n_rounds=2).info["model"]
    turned = np.random.default_rng(0).permutation(mdp.n_states)
    np.testing.assert_array_equal(model.predict(mdp.Phi[turned]), model.predict(mdp.Phi)[turned])


def test_without_scikit_learn_one_sentence_names_the_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "sklearn.tree", None)
    mdp, D, *_ = problem()
    with pytest.raises(InvalidInputError, match=r"pip install 'walking-irl\[methods\]'"):
        mmp_boost(mdp, D)


def test_features_of_another_world_are_refused():
    mdp, D, *_ = problem()
    with pytest.raises(InvalidInputError, match="shape \\(20, d\\)"):
        mmp_boost(mdp, D, features=np.ones((3, 2)))
    with pytest.raises(InvalidInputError, match="states must lie"):
        mmp_boost(mdp, Demonstrations(np.array([[99]]), np.array([[0]])))
