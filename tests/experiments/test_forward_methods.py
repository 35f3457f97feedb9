from xml.etree import ElementTree

import pytest

from walking_irl.experiments import forward_grid, forward_lqr, run
from walking_irl.experiments.forward_methods import COLUMNS, Config, ForwardJob
from walking_irl.experiments.picture import Loss, loss_chart
from walking_irl.rl.registry import FINITE, LINEAR_QUADRATIC, METHODS

CHEAP = ("policy iteration", "approximate value iteration, linear", "Riccati equation", "LSPI")
SVG = "{http://www.w3.org/2000/svg}"


def test_every_registered_method_is_set_up_on_every_world_where_it_runs():
    for world, solvers in (
        (FINITE, forward_grid.SOLVERS),
        (LINEAR_QUADRATIC, forward_lqr.SOLVERS),
    ):
        assert set(solvers) == {name for name, m in METHODS.items() if world in m.worlds}


def test_table_2_1_has_a_row_for_each_method_and_world_and_a_reason_for_each_gap(tmp_path):
    config = Config(axes=(3, 8), methods=CHEAP, seeds=2)
    table = run("2.1", config, cache=tmp_path)
    assert [row[:2] for row in table.rows] == [
        ("gridworld", "policy iteration"),
        ("gridworld", "approximate value iteration, linear"),
        ("gridworld", "LSPI"),
        *((f"LQR, {n} axes", m) for n in (3, 8) for m in CHEAP[1:]),
    ]
    loss = COLUMNS.index("loss")
    assert {row[loss] for row in table.rows if row[1] == CHEAP[0]} == {"0 (0..0)"}
    (gap,) = [row for row in table.rows if row[loss] == "n/a"]
    assert gap[:2] == ("LQR, 8 axes", CHEAP[1])
    assert any(note.startswith(f"n/a for {gap[1]} ({gap[0]})") for note in table.notes)
    assert not any("failed on" in note for note in table.notes)
    words = [t.text for t in ElementTree.fromstring(table.picture()).iter(f"{SVG}text")]
    assert {"gridworld", "LQR, 3 axes", *CHEAP} <= set(words)
    assert len(list(tmp_path.iterdir())) == len(table.raw) == 16
    assert run("2.1", config, cache=tmp_path).rows == table.rows  # from the cells: same seconds


@pytest.mark.parametrize("name", ["REINFORCE", "GPOMDP", "natural gradient", "cross-entropy"])
def test_methods_without_a_model_come_near_the_best_gains(name):
    outcome = ForwardJob(name, 3, 5).run()
    assert outcome["loss"] <= 1e-3  # measured 1e-4: the steps' noise, see test_policy_gradient
    assert ForwardJob(name, 3, 5).run()["loss"] == outcome["loss"]


def test_bars_are_as_long_as_the_logarithm_of_the_loss():
    bars = [Loss("a", "MCE", v, v, v) for v in (1e-3, 1e-2, 1e-1)] + [Loss("b", "CPIRL", 0, 0, 0)]
    rects = list(ElementTree.fromstring(loss_chart("t", bars, "c")).iter(f"{SVG}rect"))[1:]
    widths = [float(r.get("width")) for r in rects]
    assert widths[1] == pytest.approx(2 * widths[0], abs=0.2)
    assert widths[2] == pytest.approx(3 * widths[0], abs=0.2)
    assert widths[3] < 2
    assert rects[3].get("fill") != rects[0].get("fill")
