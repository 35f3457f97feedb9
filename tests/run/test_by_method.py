import numpy as np
import pytest

from walking_irl.errors import InvalidInputError
from walking_irl.run.by_method import recover_by
from walking_irl.run.setup import Setup


@pytest.mark.parametrize(
    ("method", "loss"),
    [
        ("cpirl", 0.01),
        ("kelley", 0.01),
        ("projection", 0.05),
        ("mwal", 0.05),
        ("ng-russell-3", 0.3),
    ],
)
def test_methods_of_features_run_on_every_kind_of_toy_domain(method, loss):
    """Mixtures are as far off as their budget leaves them; Ng and Russell's third stalls."""
    for domain in ("random-mdp", "lqr"):
        report = recover_by(method, Setup(domain=domain, seed=3))
        assert report.n_trajectories == 0
        assert report.relative_loss <= loss
        assert report.to_json()["forward_solves"] >= 1


def test_methods_that_read_actions_see_demonstrations():
    report = recover_by("mce-likelihood", Setup(domain="random-mdp", seed=1))
    assert report.n_trajectories == 100
    assert abs(report.relative_loss) <= 0.01
    assert np.abs(report.weights).sum() == pytest.approx(1.0)
    few = recover_by("mce-likelihood", Setup(domain="random-mdp", seed=1), n_trajectories=3)
    assert few.to_json()["trajectories"] == 3
    assert np.abs(few.weights - report.weights).max() > 1e-3


def test_girl_finds_the_weights_of_the_lqr_to_rounding():
    report = recover_by("girl", Setup(domain="lqr", weights=(0.2, 0.5, 0.3)))
    np.testing.assert_allclose(report.weights, [0.2, 0.5, 0.3], atol=1e-9)
    assert report.relative_loss is None  # it finds no policy


def test_methods_without_weights_report_a_policy():
    report = recover_by("lpal", Setup(domain="random-mdp"))
    assert report.weights is None
    assert report.relative_loss <= 1e-9
    assert report.to_json()["weights"] is None


@pytest.mark.parametrize(
    ("method", "domain", "options", "message"),
    [
        ("guess", "lqr", {}, "unknown method 'guess'; choose from ng-russell-1"),
        ("mmp", "humanoid", {}, "needs finitely many states"),
        (
            "girl",
            "gridworld",
            {},
            "policies with parameters and the gradient of their features; gridworld offers none",
        ),
        ("cpirl", "lqr", {"n_trajectories": 5}, "takes no trajectories"),
        ("mmp", "gridworld", {"n_trajectories": 0}, "got 0 of 50"),
        ("mmp", "gridworld", {"n_trajectories": 5, "horizon": 0}, "got 5 of 0"),
        ("ng-russell-1", "gridworld", {"n_trajectories": 5}, "sees the expert's policy"),
    ],
)
def test_what_cannot_run_is_said_before_the_expert_is_solved_for(method, domain, options, message):
    with pytest.raises(InvalidInputError, match=message):
        recover_by(method, Setup(domain=domain), **options)
