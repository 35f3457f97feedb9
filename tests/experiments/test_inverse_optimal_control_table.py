import pytest

from walking_irl.errors import InvalidInputError
from walking_irl.experiments import run
from walking_irl.experiments.inverse_optimal_control import COLUMNS, METHODS, Config, demonstration

PLANAR = "humanoid-planar"


@pytest.mark.slow
def test_exact_gaits_are_explained_exactly_by_all_but_the_search():
    quick = tuple(m for m in METHODS if "derivative-free" not in m)
    table = run("7.13", Config(bodies=(PLANAR,), noises=(0.0,), methods=quick, seeds=1))
    assert table.columns == COLUMNS
    rows = {row[2]: row for row in table.rows}
    assert list(rows) == list(quick)
    for method, row in rows.items():
        assert float(row[3]) <= 0.002, method
        assert (float(row[5]) == 0) == method.startswith("KKT")


def test_noise_lies_in_the_joints_alone_and_is_drawn_again_alike():
    w, exact = demonstration(PLANAR, 0, 0.0)
    _, noisy = demonstration(PLANAR, 0, 2.0)
    again = demonstration(PLANAR, 0, 2.0)[1]
    away = noisy.gait.q - exact.gait.q
    assert w.sum() == pytest.approx(1.0)
    assert not away[:, :3].any()
    assert 0.03 <= away[:, 3:].std() <= 0.04  # 2 degrees are .035
    assert (again.gait.q == noisy.gait.q).all()


def test_there_are_only_so_many_experts():
    with pytest.raises(InvalidInputError, match="6 experts"):
        demonstration(PLANAR, 6, 0.0)
