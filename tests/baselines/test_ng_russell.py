import cvxpy
import numpy as np
import pytest
from small_mdps import random_mdp

from walking_irl.baselines.loop import Setting
from walking_irl.baselines.ng_russell_1 import critical_penalty, ng_russell_1
from walking_irl.baselines.ng_russell_2 import advantage_rows, margin_program, ng_russell_2
from walking_irl.baselines.ng_russell_3 import ng_russell_3
from walking_irl.domains.lqr import LQR
from walking_irl.domains.mdp.gridworld import Gridworld
from walking_irl.errors import InvalidInputError
from walking_irl.rl.finite_mdp import FiniteMDP
from walking_irl.rl.tabular import best_policy, loss, policy_value
from walking_irl.types import Response, Status


def optimal(seed, **sizes):
    rng = np.random.default_rng(seed)
    mdp = random_mdp(rng, **sizes)
    w = rng.dirichlet(np.ones(mdp.n_objectives))
    return mdp, best_policy(mdp, mdp.reward(w)).pi, w, rng


def dense_program(mdp: FiniteMDP, pi: np.ndarray, l1: float) -> float:
    """Value of the paper's program with the inverse (I - gamma T_pi)^-1 in it."""
    S, A = mdp.n_states, mdp.n_actions
    T = mdp.dense
    own = T[pi, np.arange(S)]
    inverse = np.linalg.inv(np.eye(S) - mdp.discount * own)
    r, t = cvxpy.Variable(S), cvxpy.Variable(S, nonneg=True)
    rules = [cvxpy.abs(r) <= 1]
    for a in range(A):
        other = np.flatnonzero(np.abs(own - T[a]).max(axis=1) > 1e-12)
        rules.append(((own - T[a]) @ inverse)[other] @ r >= t[other])
    problem = cvxpy.Problem(cvxpy.Maximize(cvxpy.sum(t) - l1 * cvxpy.norm1(r)), rules)
    problem.solve(solver=cvxpy.CLARABEL, tol_gap_abs=1e-10, tol_gap_rel=1e-10)
    return problem.value


def advantages(mdp, pi, reward):
    V = policy_value(mdp, pi, reward)
    Q = mdp.action_values(reward, V)
    return V - Q


def test_sparse_program_has_the_value_of_the_papers_dense_one():
    for seed in range(3):
        mdp, pi, _, _ = optimal(seed, S=12)
        found = ng_russell_1(mdp, pi, l1=0.3)
        assert found.objective[0] == pytest.approx(dense_program(mdp, pi, 0.3), abs=1e-7)


def test_expert_is_optimal_for_the_reward_and_the_reward_bounded():
    for seed in range(3):
        mdp, pi, _, _ = optimal(seed)
        found = ng_russell_1(mdp, pi, r_max=2.0)
        assert advantages(mdp, pi, found.reward).min() >= -1e-9
        assert 0 < np.abs(found.reward).max() <= 2.0 + 1e-9
        np.testing.assert_array_equal(found.policy, pi)


def test_reward_vanishes_just_above_the_critical_penalty_and_not_below():
    mdp, pi, _, _ = optimal(3)
    critical = critical_penalty(mdp, pi)
    assert not ng_russell_1(mdp, pi, l1=1.001 * critical).reward.any()
    below = ng_russell_1(mdp, pi, l1=0.999 * critical)
    assert np.abs(below.reward).max() > 0.1
    assert np.count_nonzero(below.reward) < np.count_nonzero(ng_russell_1(mdp, pi, l1=0.0).reward)


def test_actions_that_do_the_same_bound_nothing():
    mdp, _, _, _ = optimal(4, S=6, A=2)
    T = mdp.T.toarray().reshape(2, 6, 6)
    T[1, :3] = T[0, :3]  # in three states both actions are one
    twin = FiniteMDP(type(mdp.T)(T.reshape(12, 6)), mdp.Phi, mdp.start, mdp.discount)
    found = ng_russell_1(twin, np.zeros(6, dtype=int), l1=0.0)
    assert np.abs(found.reward).max() == pytest.approx(1.0)
    assert advantages(twin, np.zeros(6, dtype=int), found.reward).min() >= -1e-9
    T[1] = T[0]
    flat = FiniteMDP(type(mdp.T)(T.reshape(12, 6)), mdp.Phi, mdp.start, mdp.discount)
    assert not ng_russell_1(flat, np.zeros(6, dtype=int), l1=0.1).reward.any()


def test_grid_walls_leave_a_reward_that_explains_the_expert():
    grid = Gridworld(8, 2)
    r = grid.mdp.Phi @ np.array([0.1, 0.2, 0.3, 0.4])
    found = ng_russell_1(grid.mdp, best_policy(grid.mdp, r).pi)
    assert loss(grid.mdp, r, found.policy) <= 1e-9
    assert loss(grid.mdp, r, found.info["other_policy"]) <= 0.2  # ties broken by another solver


@pytest.mark.parametrize("is_simplex", [False, True])
def test_margin_program_equals_its_concave_form(is_simplex):
    mdp, pi, _, rng = optimal(5)
    X, owner = advantage_rows(mdp, pi, rng.choice(25, 20, replace=False))
    X = X + 0.2 * rng.standard_normal(X.shape)  # not all advantages can be kept
    w, value = margin_program(X, owner, is_simplex=is_simplex)
    v = cvxpy.Variable(4)
    least = [cvxpy.min(X[owner == s] @ v) for s in range(owner.max() + 1)]
    total = cvxpy.sum([cvxpy.minimum(x, 2 * x) for x in least])
    rules = [v >= 0, cvxpy.sum(v) == 1] if is_simplex else [cvxpy.abs(v) <= 1]
    problem = cvxpy.Problem(cvxpy.Maximize(total), rules)
    problem.solve(solver=cvxpy.CLARABEL)
    assert value == pytest.approx(problem.value, abs=1e-6)
    reached = np.array([(X[owner == s] @ w).min() for s in range(owner.max() + 1)])
    assert np.minimum(reached, 2 * reached).sum() == pytest.approx(value, abs=1e-9)


def test_large_state_spaces_need_few_states_for_a_linear_reward():
    losses = []
    for seed in range(4):
        mdp, pi, w, rng = optimal(seed, S=50)
        found = ng_russell_2(mdp, pi, rng=rng, n_states=40, is_simplex=True)
        losses.append(loss(mdp, mdp.reward(w), found.policy))
        assert found.space == "simplex" and found.w.sum() == pytest.approx(1.0)
    assert np.mean(losses) <= 0.1


def lqr_rows(problem: LQR, k, h, rng, n_states=60, n_rivals=30):
    """Advantages of u = k x over sampled inputs in each feature, from the closed-form Q_j."""
    Q, R = problem._charges()
    P = (Q + R * k**2) / (1 - problem.discount * (1 + k) ** 2)
    x = problem.start * rng.standard_normal((n_states, 1, problem.n_objectives))
    own = k * x
    other = own + h * np.abs(x) * rng.standard_normal((n_states, n_rivals, problem.n_objectives))

    def q(u):
        return -(R * u[..., None, :] ** 2 + problem.discount * P * (x + u)[..., None, :] ** 2).sum(
            axis=-1
        )

    X = (q(own) - q(other)).reshape(-1, problem.n_objectives)
    return X, np.repeat(np.arange(n_states), n_rivals)


def test_on_the_lqr_the_error_falls_with_the_distance_of_the_rival_inputs():
    problem, errors = LQR(3), {}
    for h in (0.9, 0.3, 0.1):
        errors[h] = []
        for seed in range(5):
            rng = np.random.default_rng(seed)
            w_E = rng.dirichlet(np.ones(3))
            X, owner = lqr_rows(problem, problem.gains(w_E), h, rng)
            errors[h].append(np.abs(margin_program(X, owner, is_simplex=True)[0] - w_E).max())
    mean = {h: np.mean(e) for h, e in errors.items()}
    assert 2 <= mean[0.9] / mean[0.3] <= 4.5  # the law: error ~ h
    assert 2 <= mean[0.3] / mean[0.1] <= 4.5


def finite_forward(mdp):
    def forward(w):
        pi = best_policy(mdp, mdp.reward(w)).pi
        return Response(pi, mdp.feature_expectations(pi))

    return forward


@pytest.mark.parametrize("is_simplex", [False, True])
def test_from_trajectories_ends_and_says_why(is_simplex):
    ends = set()
    for seed in range(6):
        mdp, pi, _, rng = optimal(seed)
        mu_E = mdp.feature_expectations(pi)
        expert = type("Known", (), {"mu": mu_E})()
        *_, last = ng_russell_3(
            finite_forward(mdp), expert, rng=rng, setting=Setting(not is_simplex)
        )
        assert last.status in (Status.STALLED, Status.MATCHED)
        assert len(last.W) <= 40 and last.mixture.sum() == pytest.approx(1.0)
        low = 0.0 if is_simplex else -1.0
        assert last.W.min() >= low and last.W.max() <= 1.0
        ends.add(last.status)
    assert Status.STALLED in ends


def test_from_trajectories_stops_at_its_budget():
    mdp, pi, _, rng = optimal(7)
    expert = type("Known", (), {"mu": mdp.feature_expectations(pi)})()
    found = list(ng_russell_3(finite_forward(mdp), expert, rng=rng, max_solves=1))
    assert [a.status for a in found] == [Status.BUDGET]


def test_bad_policies_and_settings_are_named():
    mdp, pi, _, rng = optimal(8)
    for policy, message in (
        (pi[:-1], "each of 25 states"),
        (np.full(25, 7), "from 0 to 2"),
        (np.full((25, 3), 1 / 3), "deterministic"),
    ):
        with pytest.raises(InvalidInputError, match=message):
            ng_russell_1(mdp, policy)
        with pytest.raises(InvalidInputError, match=message):
            ng_russell_2(mdp, policy, rng=rng)
    with pytest.raises(InvalidInputError, match="penalty"):
        margin_program(np.ones((2, 2)), np.array([0, 1]), penalty=0.5)
