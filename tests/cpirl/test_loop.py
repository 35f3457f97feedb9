from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from problems import TWO_POLICIES, Menu, without_sensitivity
from scipy.optimize import minimize

from walking_irl.cpirl.loop import cpirl
from walking_irl.cpirl.probes import Probing
from walking_irl.cpirl.regret_model import reduced
from walking_irl.cpirl.summary import summarise
from walking_irl.domains.lqr import LQR
from walking_irl.errors import InvalidInputError
from walking_irl.expert import expert_from_returns
from walking_irl.geometry.plane import plane_basis
from walking_irl.types import Expert, Rule, Status


def hidden(seed, K):
    rng = np.random.default_rng(seed)
    return rng.dirichlet(np.ones(K)), rng


def test_lqr_matches_the_published_front():
    noisy = LQR(2, policy_noise=1.0)
    mu = noisy.forward(np.array([0.0, 1.0])).mu
    np.testing.assert_allclose(mu, [-306.5027, -152.3688], atol=1e-3)
    for K, value in ((2, -158.8403), (3, -203.1817), (5, -279.8584)):
        np.testing.assert_allclose(LQR(K).forward(np.full(K, 1 / K)).mu, value, atol=1e-3)


@pytest.mark.parametrize(("K", "curvature"), [(2, 95.00), (3, 120.01), (5, 170.33)])
def test_lqr_sensitivity_is_the_derivative_of_mu(K, curvature):
    problem, w, h = LQR(K), np.full(K, 1 / K), 1e-5
    direction = np.zeros(K)
    direction[:2] = 1.0, -1.0
    S = problem.forward(w).sensitivity
    numeric = (problem.forward(w + h * direction).mu - problem.forward(w - h * direction).mu) / (
        2 * h
    )
    projected = S @ direction - (S @ direction).mean()
    np.testing.assert_allclose(projected, numeric - numeric.mean(), rtol=1e-6, atol=1e-6)
    assert direction @ S @ direction / 2 == pytest.approx(curvature, abs=0.1)


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("K", [2, 3, 5, 8])
def test_newton_recovers_lqr_weights_in_12_solves(K, seed):
    w_E, rng = hidden(seed, K)
    problem = LQR(K)
    expert = problem.expert(w_E, rng)
    run = list(cpirl(problem.forward, expert, rng=rng, max_solves=12))
    assert run[-1].status in (Status.MATCHED, Status.CONVERGED)
    assert all(float(w_E @ (i.response.mu - expert.mu)) <= 1e-9 for i in run)
    assert np.abs(run[-1].estimate - w_E).max() <= 1e-3
    lo, hi = run[-1].intervals.T
    assert np.all((lo <= w_E + 1e-7) & (w_E <= hi + 1e-7))


@pytest.mark.parametrize("centre", ["ac", "cg", "mvie", "cc"])
def test_cutting_planes_alone_recover_lqr_weights(centre):
    w_E, rng = hidden(0, 3)
    expert = LQR(3).expert(w_E, rng)
    run = list(cpirl(without_sensitivity(LQR(3)), expert, centre=centre, rng=rng, max_solves=25))
    assert all(i.polyhedron.contains(w_E, 1e-9) for i in run)
    assert all(i.rule is Rule.CENTRE for i in run)
    assert np.abs(run[-1].estimate - w_E).max() <= 0.01


@pytest.mark.parametrize(("K", "solves"), [(2, 12), (3, 12), (5, 20), (8, 20)])
def test_analytic_centre_alone_comes_to_lqr_weights_within(K, solves):
    for seed in range(10):
        w_E, rng = hidden(seed, K)
        expert = LQR(K).expert(w_E, rng)
        run = list(cpirl(without_sensitivity(LQR(K)), expert, rng=rng, max_solves=solves))
        assert min(np.abs(i.w - w_E).max() for i in run) <= 0.01
        d = np.array([i.response.mu - expert.mu for i in run])
        assert (d @ w_E).max() <= 1e-9, "the expert's weights are never cut"


@pytest.mark.parametrize("noise", [1e-3, 3e-3, 1e-2, 3e-2])
def test_robust_cuts_keep_the_weights_that_naive_cuts_lose(noise):
    problem, kept_robust, kept_naive, n = LQR(3), 0, 0, 50
    for seed in range(n):
        w_E, rng = hidden(seed, 3)
        mu = problem.forward(w_E).mu
        noisy = expert_from_returns(mu * (1 + noise * rng.standard_normal((20, 3))))
        naive = Expert(noisy.mu, np.zeros(3))
        for kind, expert in (("robust", noisy), ("naive", naive)):
            run = list(cpirl(without_sensitivity(problem), expert, rng=rng, max_solves=15))
            cuts = np.array([i.response.mu - expert.mu - expert.error for i in run])
            kept = float((cuts @ w_E).max()) <= 1e-9
            kept_robust += kept and kind == "robust"
            kept_naive += kept and kind == "naive"
    assert kept_robust >= 0.95 * n
    assert kept_naive <= 0.7 * n


def test_measured_defect_removes_a_bias_of_the_measurement():
    problem, covered, errors = LQR(4), 0, {True: [], False: []}
    for seed in range(10):
        rng = np.random.default_rng(seed)
        w_E = 0.05 + 0.8 * rng.dirichlet(np.ones(4))
        bias = np.array([1.02, 1.0, 1.0, 1.01])

        def sample(k, rng=rng, bias=bias):
            mu = problem.evaluate(k)
            return mu * bias * (1 + 0.002 * rng.standard_normal((20, 4)))

        def measure(k, sample=sample):
            X = sample(k)
            return X.mean(axis=0), np.cov(X.T) / len(X)

        expert = expert_from_returns(sample(problem.gains(w_E)))
        for is_measured in (True, False):
            run = list(
                cpirl(problem.forward, expert, rng=rng, measure=measure if is_measured else None)
            )
            errors[is_measured].append(np.abs(run[-1].estimate - w_E).sum())
            lo, hi = run[-1].intervals.T
            covered += is_measured * int(((lo <= w_E) & (w_E <= hi)).sum())
    assert covered >= 0.95 * 40
    assert np.mean(errors[True]) < 0.5 * np.mean(errors[False])


@pytest.mark.parametrize("K", [2, 3, 5])
def test_level_mode_dominates_suboptimal_experts(K):
    for seed in range(4):
        w_E, rng = hidden(seed, K)
        problem = LQR(K, perturbation=0.25)
        expert = problem.expert(w_E, rng)
        last = list(cpirl(problem.forward, expert, mode="minimise", rng=rng, max_solves=30))[-1]
        is_clear = last.best_regret > 1e-3 * abs(last.estimate @ expert.mu)
        assert last.status is (Status.DOMINATED if is_clear else Status.NOT_OPTIMAL)
        assert np.all(last.response.mu >= expert.mu)


def test_set_mode_returns_weights_that_explain_the_expert():
    w_E, rng = hidden(0, 3)
    expert = LQR(3).expert(w_E, rng)
    run = list(cpirl(without_sensitivity(LQR(3)), expert, mode="set", tol=1e-3, rng=rng))
    assert run[-1].status is Status.MATCHED
    assert run[-1].regret <= 1e-3 * abs(run[-1].w @ expert.mu)
    assert all(i.polyhedron.contains(w_E) for i in run)


def test_set_mode_probes_to_the_exact_interval_of_each_weight():
    w_E, rng = hidden(3, 3)
    problem, level = LQR(3), 1e-3
    expert = problem.expert(w_E, rng)
    run = list(
        cpirl(without_sensitivity(problem), expert, mode="set", tol=level, probe=level, rng=rng)
    )
    probes = [i for i in run if i.rule is Rule.PROBE]
    assert 6 < len(probes) <= 60 and run[-1].status is Status.MATCHED
    assert all(i.status in (Status.CUT, Status.PROBE) for i in run[:-1])

    def slack(w):
        w = np.abs(w) / np.abs(w).sum()
        return level * w @ np.abs(expert.mu) - w @ (problem.forward(w).mu - expert.mu)

    for j in range(3):
        for side, sign in ((0, 1.0), (1, -1.0)):
            best = minimize(
                lambda w, j=j, sign=sign: sign * w[j],
                w_E,
                bounds=[(0, 1)] * 3,
                constraints=[
                    {"type": "eq", "fun": lambda w: w.sum() - 1},
                    {"type": "ineq", "fun": slack},
                ],
                method="SLSQP",
                options={"ftol": 1e-10},
            )
            assert run[-1].intervals[j, side] == pytest.approx(best.x[j], abs=2e-3)


def test_probes_tighten_intervals_around_the_truth_and_use_the_executor():
    w_E, rng = hidden(1, 3)
    expert = LQR(3).expert(w_E, rng)
    plain = list(cpirl(LQR(3).forward, expert, rng=rng))
    with ThreadPoolExecutor(2) as executor:
        run = list(cpirl(LQR(3).forward, expert, rng=rng, probe=Probing(1e-4, executor)))
    probes = [i for i in run if i.rule is Rule.PROBE]
    assert len(probes) == 6
    assert [i.status for i in run[:-1]].count(Status.PROBE) == 5
    lo, hi = run[-1].intervals.T
    assert np.all((lo <= w_E) & (w_E <= hi))
    assert (hi - lo).max() < np.diff(plain[-1].intervals).max()


def test_probed_half_widths_follow_the_hessian():
    w_E, rng = np.array([0.3, 0.4, 0.3]), np.random.default_rng(0)
    problem, tolerance = LQR(3), 1e-4
    expert = problem.expert(w_E, rng)
    run = list(cpirl(problem.forward, expert, rng=rng, probe=tolerance))
    U = plane_basis(3)
    C = U @ np.linalg.inv(reduced(problem.forward(w_E).sensitivity)) @ U.T
    predicted = np.sqrt(2 * tolerance * abs(w_E @ expert.mu) * np.diag(C))
    half = np.diff(run[-1].intervals, axis=1).ravel() / 2
    assert np.all(half >= 0.95 * predicted), "the tolerance set itself is never cut"
    assert np.all(half <= 2.0 * predicted), "cuts are tangent planes: a box of the ellipsoid"


def test_missing_sensitivities_reuse_the_last_good_one_and_free_policies_cut():
    w_E, rng = hidden(4, 4)
    problem = LQR(4)
    expert = problem.expert(w_E, rng)
    extra = np.array([problem.forward(w).mu for w in rng.dirichlet(np.ones(4), 30)])
    calls = []

    def forward(w):
        calls.append(w)
        response = problem.forward(w)
        is_good = len(calls) % 2 == 1
        return replace(
            response, sensitivity=response.sensitivity if is_good else None, evaluated=extra
        )

    run = list(cpirl(forward, expert, rng=rng, max_solves=15))
    assert run[-1].status in (Status.MATCHED, Status.CONVERGED)
    assert np.abs(run[-1].estimate - w_E).max() <= 1e-3
    assert len(run[1].polyhedron.cuts) > 10
    assert all(i.polyhedron.contains(w_E) for i in run)


def test_two_policy_counterexample_ends_with_a_dominating_mixture():
    expert = Expert(np.array([0.4, 0.4]), np.zeros(2))
    endings = {"optimal": Status.CONTRADICTED, "minimise": Status.MIXTURE_DOMINATES}
    for mode, status in endings.items():
        run = list(cpirl(TWO_POLICIES.forward, expert, mode=mode, rng=np.random.default_rng(0)))
        assert len(run) == 2
        assert run[-1].status is status and status.is_success == (mode == "minimise")
        assert run[-1].certificate == pytest.approx(-0.1)


def test_runs_are_deterministic_and_interruptible():
    w_E, rng = hidden(2, 5)
    expert = LQR(5).expert(w_E, rng)
    first = list(cpirl(LQR(5).forward, expert, rng=np.random.default_rng(0)))
    run = cpirl(LQR(5).forward, expert, rng=np.random.default_rng(0))
    again = next(run)
    run.close()
    np.testing.assert_array_equal(first[0].w, again.w)
    np.testing.assert_array_equal(
        [i.w for i in first],
        [i.w for i in cpirl(LQR(5).forward, expert, rng=np.random.default_rng(0))],
    )


def test_summary_names_the_weakest_trade_off():
    w_E, rng = hidden(0, 3)
    problem = LQR(3)
    expert = problem.expert(w_E, rng)
    recovery = summarise(list(cpirl(problem.forward, expert, rng=rng)), expert, problem.objectives)
    assert recovery.bracket[0] <= 0.0 <= recovery.bracket[1]
    assert 0.0 < recovery.volume_ratio < 1.0
    assert recovery.weakest is not None
    assert " against " in recovery.weakest


def test_unknown_mode_lists_the_names():
    rng = np.random.default_rng(0)
    with pytest.raises(InvalidInputError, match="unknown mode 'best'; choose from optimal, set"):
        next(cpirl(LQR(3).forward, LQR(3).expert(np.ones(3) / 3, rng), mode="best", rng=rng))


@pytest.mark.parametrize("mode", ["optimal", "set", "minimise"])
def test_an_expert_that_no_policy_equals_is_named(mode):
    w_E, rng = hidden(0, 3)
    expert = LQR(3).expert(w_E, rng)
    better = replace(expert, mu=0.8 * expert.mu)  # the same costs, a fifth lower
    with pytest.raises(InvalidInputError, match="no policy achieves"):
        list(cpirl(LQR(3).forward, better, mode=mode, rng=rng))


@pytest.mark.parametrize(
    ("covariance", "sentence"),
    [
        (np.eye(2), "needs finite shape"),
        (np.full((3, 3), np.nan), "needs finite shape"),
        (np.eye(3) + np.eye(3, k=1), "must be symmetric"),
        (-np.eye(3), "negative"),
        (4 * np.eye(3), "narrower than one standard error"),
    ],
)
def test_inconsistent_error_bars_are_named(covariance, sentence):
    w_E, rng = hidden(0, 3)
    expert = replace(LQR(3).expert(w_E, rng), error=np.ones(3), covariance=covariance)
    with pytest.raises(InvalidInputError, match=sentence):
        next(cpirl(LQR(3).forward, expert, rng=rng))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"mu": np.array([1.0, np.nan, 1.0])}, "finite mu"),
        ({"error": np.zeros(2)}, "one shape"),
        ({"error": np.array([0.1, -0.1, 0.0])}, "must not be negative"),
        ({"suboptimality": -1.0}, "must not be negative"),
    ],
)
def test_experts_that_make_no_sense_are_named(change, sentence):
    w_E, rng = hidden(0, 3)
    with pytest.raises(InvalidInputError, match=sentence):
        next(cpirl(LQR(3).forward, replace(LQR(3).expert(w_E, rng), **change), rng=rng))


@pytest.mark.parametrize("has_sensitivity", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_least_regret_within_the_bounds_of_the_weights(seed, has_sensitivity):
    """In "minimise" every query and the answer respect min_weight, and the answer is the best."""
    w_E, rng = hidden(seed, 3)
    problem, low = LQR(3), 0.2
    expert = problem.expert(w_E, rng)
    forward = problem.forward if has_sensitivity else without_sensitivity(problem)
    run = list(
        cpirl(forward, expert, mode="minimise", min_weight=low, rng=rng, probe=1e-4, max_solves=40)
    )
    assert w_E.min() < low and run[-1].status is Status.NOT_OPTIMAL
    assert run[-1].bracket.lower > 0.0, "none of the weights that count explains it"
    assert all(i.estimate.min() >= low - 1e-12 for i in run)
    assert all(i.w.min() >= low - 1e-12 for i in run if i.rule is not Rule.PROBE)
    best = minimize(
        lambda w: w @ (problem.forward(w / w.sum()).mu - expert.mu),
        np.full(3, 1 / 3),
        bounds=[(low, 1)] * 3,
        constraints={"type": "eq", "fun": lambda w: w.sum() - 1},
        options={"ftol": 1e-12},
    )
    v = run[-1].estimate
    found = v @ (problem.forward(v).mu - expert.mu)
    assert found <= best.fun + 1e-4 * abs(v @ expert.mu)


@pytest.mark.parametrize("mode", ["optimal", "set"])
def test_error_bars_without_covariance_end_in_a_match(mode):
    for seed in range(5):
        w_E, rng = hidden(seed, 4)
        expert = LQR(4).expert(w_E, rng)
        expert = replace(expert, error=0.02 * np.abs(expert.mu))
        run = list(cpirl(without_sensitivity(LQR(4)), expert, mode=mode, tol=1e-3, rng=rng))
        assert run[-1].status is Status.MATCHED
        robust = [i.w @ (i.response.mu - expert.mu - expert.error) for i in run]
        assert robust[-1] <= 1e-3 * abs(run[-1].w @ expert.mu)
        assert all(i.polyhedron.contains(w_E) for i in run)


def test_noisy_levels_fall_below_zero_until_the_gap_closes():
    problem = LQR(4)
    for seed in range(5):
        w_E, rng = hidden(seed, 4)
        mu = problem.forward(w_E).mu
        expert = expert_from_returns(mu * (1 + 0.03 * rng.standard_normal((20, 4))))
        run = list(cpirl(without_sensitivity(problem), expert, mode="minimise", rng=rng))
        assert run[-1].status is Status.GAP_CLOSED
        assert run[-1].intervals[:, 0].min() >= 0 and run[-1].best_regret < 0.2 * abs(w_E @ mu)
        lo, hi = run[-1].intervals.T
        assert np.all((lo <= w_E) & (w_E <= hi)), "intervals stay those of the robust set"


def test_intervals_of_a_run_that_ends_early_cover_the_weights():
    covered = n = 0
    for seed in range(30):
        w_E, rng = hidden(seed, 4)
        mu = LQR(4).forward(w_E).mu
        expert = expert_from_returns(mu * (1 + 0.01 * rng.standard_normal((20, 4))))
        run = list(cpirl(LQR(4).forward, expert, rng=rng, max_solves=2))
        lo, hi = run[-1].intervals.T
        covered += int(((lo <= w_E) & (w_E <= hi)).sum())
        n += 4
    assert covered >= 0.95 * n


def test_probes_of_a_set_with_error_bars_stop_where_its_bounds_are_reached():
    w_E, rng = hidden(3, 3)
    problem = LQR(3)
    gap = replace(problem.expert(w_E, rng), suboptimality=0.2)
    run = list(cpirl(without_sensitivity(problem), gap, mode="set", tol=1e-3, probe=1e-3, rng=rng))
    probes = sum(i.rule is Rule.PROBE for i in run)
    assert run[-1].status is Status.MATCHED and 6 <= probes <= 60, "90 where none is seen reached"
    assert all(i.status is Status.PROBE for i in run[:-1] if i.rule is Rule.PROBE)


def test_an_expert_of_zero_features_has_a_scale_all_the_same():
    rng = np.random.default_rng(0)
    w_E = np.array([0.2, 0.3, 0.5])
    M = np.vstack([np.full(3, -1e-13), -1.0 - rng.random((20, 3))])
    M[1:] += np.maximum(M[1:] @ w_E, 0.0)[:, None]
    run = list(cpirl(Menu(M).forward, Expert(np.zeros(3), np.zeros(3)), rng=rng))
    assert run[-1].status is Status.MATCHED
