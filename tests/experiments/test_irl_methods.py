from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from walking_irl.baselines.registry import METHODS
from walking_irl.experiments import GROUPS, TABLES, irl_methods, run, run_tables
from walking_irl.experiments.irl_cases import CASES
from walking_irl.experiments.irl_methods import Config, MethodJob, Setting
from walking_irl.experiments.irl_setups import LINES
from walking_irl.experiments.reward_maps import picture, reward_maps, shades
from walking_irl.rl.tabular import loss

SVG = "{http://www.w3.org/2000/svg}"
SMALL = Config(
    settings=(Setting("random MDP", False, (5, 20)), Setting("random MDP", True, (5, 20))),
    lines=("the expert itself", "ng-russell-1", "mce-likelihood", "lpal", "cpirl"),
    seeds=2,
)


def test_every_registered_method_of_finite_worlds_has_a_row():
    finite = {name for name, m in METHODS.items() if "finite" in m.worlds}
    assert {line.method for line in LINES.values()} - {""} == finite


def test_properties_come_from_the_registry():
    table = run("3.1a")
    assert [row[0] for row in table.rows] == list(METHODS)
    assert all(all(row) for row in table.rows)
    dots = list(ElementTree.fromstring(table.picture()).iter(f"{SVG}circle"))
    assert sum(d.get("fill") != "white" for d in dots) == sum(
        len(m.worlds) for m in METHODS.values()
    )


def test_losses_have_a_number_for_each_count_of_trajectories_and_gaps_where_nothing_can_run():
    table = run("3.1b", SMALL)
    rows = {row[0]: row[1:] for row in table.rows}
    assert list(rows) == list(SMALL.lines)
    assert [len(cell.split("/")) for cell in rows["mce-likelihood"][:2]] == [2, 2]
    assert rows["the expert itself"][0] == "0.000"
    assert float(rows["the expert itself"][1]) > 0.05
    assert rows["ng-russell-1"][1] == "n/a"
    assert not any("failed on" in note for note in table.notes)
    assert len(table.raw) == 2 * (2 + 1 + 3 * 4)
    mean = np.mean(
        [o["loss"] for o in table.raw if (o["line"], o["is_soft"], o["n"]) == ("lpal", False, 20)]
    )
    assert rows["lpal"][0].split("/")[1] == f"{mean:.3f}"


def test_rows_can_be_thinned_and_a_note_says_so():
    config = replace(
        SMALL,
        settings=(Setting("random MDP", False, (5, 20, 100)),),
        lines=("lpal",),
        thinned={"random MDP": ("lpal",)},
        few={"random MDP": ("lpal",)},
        few_seeds=1,
    )
    table = run("3.1b", config)
    assert [(o["n"], o["seed"]) for o in table.raw] == [(20, 0)]
    assert any("middle number" in note for note in table.notes)
    assert any("first 1 seeds" in note for note in table.notes)


def test_a_missing_package_leaves_a_gap_with_the_command(monkeypatch):
    monkeypatch.setattr(irl_methods.importlib.util, "find_spec", lambda name: None)
    table = run("3.1b", replace(SMALL, lines=("mmp-boost",), seeds=1))
    assert table.rows == (("mmp-boost", "n/a", "n/a", "n/a"),)
    assert any("pip install 'walking-irl[methods]'" in note for note in table.notes)


def test_a_case_is_that_of_its_seed_and_methods_see_no_reward():
    for make in CASES.values():
        one, two, other = make(True, 5, 1), make(True, 5, 1), make(True, 5, 2)
        np.testing.assert_array_equal(one.demonstrations.states, two.demonstrations.states)
        assert (one.demonstrations.states != other.demonstrations.states).any()
        assert 0 < loss(one.mdp, one.reward, one.policy) < 0.5
    first, second = (MethodJob("policywalk", "random MDP", False, 20, 0).run() for _ in range(2))
    assert first["loss"] == second["loss"]


@pytest.mark.parametrize("line", ["mce-likelihood", "neu-szepesvari", "mmp", "cpirl-actions"])
def test_methods_that_read_actions_lose_little_on_a_linear_world(line):
    losses = [MethodJob(line, "random MDP", False, 100, s).run()["loss"] for s in range(3)]
    assert np.mean(losses) <= 0.02  # 0 to 0.004 is usual


def test_a_group_of_tables_stands_for_its_parts(tmp_path, monkeypatch):
    monkeypatch.setitem(TABLES, "3.1b", (irl_methods.table_3_1b, replace(SMALL, lines=("lpal",))))
    monkeypatch.setitem(GROUPS, "3.1", ("3.1a", "3.1b"))
    names = [path.stem for path in run_tables(["3.1"], seeds=1, out=tmp_path)]
    assert set(names) == {"table_3_1a", "table_3_1b"}


def test_reward_maps_begin_with_the_truth_and_leave_out_methods_of_complete_policies():
    maps = reward_maps(5, 1, ("the expert itself", "ng-russell-1", "mce-likelihood", "lpal"))
    assert [(m.label, m.is_reward) for m in maps] == [
        ("truth", True),
        ("mce-likelihood", True),
        ("lpal", False),
    ]
    tree = ElementTree.fromstring(picture(maps, 5))
    words = [t.text for t in tree.iter(f"{SVG}text")]
    assert {m.label for m in maps} <= set(words)
    cells = [path.get("d").count("M") for path in tree.iter(f"{SVG}path")]
    assert sum(cells) == 3 * 256
    assert set(shades(maps[0].values, 16).ravel()) <= set(range(24))
