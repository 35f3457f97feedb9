"""What domains offer beside their solver, for methods that ask for it: see domains.contract."""

from functools import lru_cache

import numpy as np
import pytest

from walking_irl.baselines.girl import girl
from walking_irl.baselines.registry import run_method
from walking_irl.domains import load
from walking_irl.domains.humanoid.gait.gait import Gait
from walking_irl.domains.humanoid.gait.library import load_library
from walking_irl.domains.humanoid.learner import solver_for
from walking_irl.domains.lqr import LQR
from walking_irl.domains.path.walking_path import WalkingPath
from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.types import Expert

PATH = WalkingPath([(2.0, 1.0, 45.0), (3.0, 0.5, 0.0)], n_intervals=8)
W = {"lqr": np.array([0.5, 0.3, 0.2]), "walking-path": np.array([0.3, 0.2, 0.15, 0.15, 0.2])}


@lru_cache
def planar():
    """Domain, weights and a gait that is optimal for them to rounding."""
    domain, known = load("humanoid-planar"), load_library("humanoid-planar")["typical 0"]
    solver, x = solver_for(domain.spec), known.gait.to_vector()
    x = solver.solve(known.w, x, root=solver.dual(x)).x
    return domain, known.w, Gait.from_vector(x, len(domain.walker.joints))


def cases(name):
    if name == "planar":
        return planar()
    domain = LQR(3) if name == "lqr" else PATH
    return domain, W[name], domain.forward(W[name]).policy


@pytest.mark.parametrize("name", ["lqr", "walking-path", "planar"])
def test_an_optimal_policy_beats_its_deviations_under_its_own_weights(name):
    domain, w, policy = cases(name)
    X, owner = domain.advantages(policy, size=0.01, rng=np.random.default_rng(0))
    assert X.shape == (len(owner), len(w)) and len(np.unique(owner)) == owner.max() + 1
    value = X @ w
    assert value.min() >= -1e-6 * np.abs(X).max()  # the planar gait is optimal to about that
    assert np.linalg.matrix_rank(X / np.abs(X).max(axis=0)) == len(w)  # every weight has a say


@pytest.mark.parametrize(("name", "least"), [("lqr", 2.0), ("walking-path", 1.5), ("planar", 2.0)])
def test_error_of_the_margin_program_is_of_the_order_of_the_deviations(name, least):
    """Smaller by ``least`` at least where deviations are three times as small."""
    domain, w, policy = cases(name)
    expert = domain.expert(w, np.random.default_rng(0)) if name != "planar" else None
    if expert is None:
        expert = Expert(np.ones(6), np.zeros(6), demonstration=policy)
    sizes = (0.03, 0.01) if name != "planar" else (0.009, 0.003)
    errors = [
        np.mean(
            [
                np.abs(
                    run_method(
                        "ng-russell-2", domain, expert, rng=np.random.default_rng(s), size=size
                    ).w
                    - w
                ).sum()
                for s in range(3)
            ]
        )
        for size in sizes
    ]
    assert errors[1] <= 0.12 and errors[1] <= errors[0] / least


@pytest.mark.parametrize("name", ["lqr", "walking-path"])
def test_slope_of_the_optimal_policy_is_the_one_of_differences(name):
    domain, w, policy = cases(name)
    compared = domain.nearest(policy)
    here, h = compared(w), 1e-6
    assert np.abs(here.residual).max() <= 1e-8
    np.testing.assert_allclose(here.mu, domain.forward(w).mu)
    S = here.slope()
    for j in range(1, len(w)):
        d = np.eye(len(w))[j] - np.eye(len(w))[0]
        difference = (compared(w - h * d).residual - compared(w + h * d).residual) / (2 * h)
        assert np.abs(difference - S @ d).max() <= 1e-5 * np.abs(difference).max()


@pytest.mark.parametrize(("name", "tol"), [("lqr", 1e-5), ("walking-path", 1e-3)])
def test_matching_policies_finds_the_weights_of_an_optimal_one(name, tol):
    """Gauss-Newton ends where no weight changes by 1e-4; its last step is of second order."""
    domain, w, _ = cases(name)
    expert = domain.expert(w, np.random.default_rng(0))
    found = run_method("neu-szepesvari", domain, expert, rng=np.random.default_rng(0))
    np.testing.assert_allclose(found.w, w, atol=tol)


def test_the_gradient_of_an_optimal_gait_vanishes_for_its_weights_alone():
    """GIRL on the reduced gradient: the KKT residual of inverse optimal control."""
    domain, w, gait = planar()
    found = girl(domain.policy_gradient(gait))
    assert np.abs(found.w - w).sum() <= 1e-6
    assert found.info["residual"] <= 1e-6 and found.info["singular_values"][-2] >= 1e-4


def test_paths_of_another_number_of_intervals_are_refused():
    other = WalkingPath([(2.0, 1.0, 45.0), (3.0, 0.5, 0.0)], n_intervals=6)
    with pytest.raises(InvalidInputError, match="must have 6 intervals, got 25 parameters"):
        other.nearest(PATH.forward(W["walking-path"]).policy)


def test_deviations_too_large_to_arrive_are_told():
    policy = PATH.forward(W["walking-path"]).policy
    with pytest.raises(SolverError, match="of other ways to .* only .* arrive"):
        PATH.advantages(policy, size=20.0, rng=np.random.default_rng(0))
