import numpy as np
import pytest

from walking_irl.experiments import run
from walking_irl.experiments.irl_continuous import ON_LQR, Config, ContinuousJob

THREE = "LQR, 3 axes"


def mean_error(method, n=5):
    return np.mean([ContinuousJob(THREE, method, s).run()["dw"] for s in range(n)])


def test_every_method_of_the_lqr_has_its_error_and_its_solves():
    table = run("3.1c", Config(worlds=(THREE,), seeds=2))
    assert [row[:2] for row in table.rows] == [(THREE, method) for method in ON_LQR]
    figures = {row[1]: row for row in table.rows}
    assert float(figures["cpirl"][3]) > 1
    assert float(figures["girl, exact gradients"][3]) == 0
    assert float(figures["policywalk on CPIRL's archive"][3]) > 1
    assert float(figures["relative-entropy, 2000 gains"][5]) >= 1
    assert not any("failed on" in note for note in table.notes)


@pytest.mark.parametrize(
    ("method", "tolerance"), [("girl, exact gradients", 1e-9), ("cpirl", 1e-4)]
)
def test_exact_methods_find_the_weights(method, tolerance):
    assert mean_error(method) <= tolerance


def test_more_episodes_make_better_gradients_and_weights():
    """Error falls as n^-1/2: a factor of 10 for 100 times as many, 3 or more for certain."""
    few, many = mean_error("girl, 30 episodes", 8), mean_error("girl, 3000 episodes", 8)
    assert many <= few / 3


def test_the_error_of_sampled_controls_is_of_the_order_of_their_distance():
    """Ng & Russell's second program: error about h, ten times smaller for a tenth."""
    far, near = mean_error("ng-russell-2, h = 1"), mean_error("ng-russell-2, h = 0.1")
    assert near <= far / 3


def test_girl_is_exact_on_walking_paths():
    assert ContinuousJob("walking path", "girl, exact gradients", 0).run()["dw"] <= 1e-9
