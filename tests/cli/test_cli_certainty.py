"""What a run says of its ending and of its intervals, in terminal and JSON."""

import json

import numpy as np
import pytest

LQR = ("recover", "--domain", "lqr", "--no-record", "--json", "out.json")
PARTS = ("from_noise", "from_gap", "from_solver")


@pytest.mark.parametrize("mode", ["optimal", "set"])
def test_a_mode_whose_premise_fails_names_the_other_and_exits_1(call, tmp_path, mode):
    code, out, err = call(*LQR, "--expert", "suboptimal", "--mode", mode)
    told = json.loads((tmp_path / "out.json").read_text())
    assert code == 1 and not err
    assert "mode minimise" in told["status"] and "sub-optimal by" in told["status"]
    assert told["summary"]["bracket"][0] > 0.0
    assert "recovered" not in out.split("ended:")[0], "nothing was"
    code, _, _ = call(*LQR, "--expert", "suboptimal", "--mode", "minimise")
    assert code == 0


def test_a_spent_budget_says_what_is_left_to_learn_and_what_it_takes(call, tmp_path):
    code, _, _ = call(*LQR, "--max-solves", 3)
    told = json.loads((tmp_path / "out.json").read_text())["status"]
    assert code == 1 and "short of optimal" in told
    n = int(told.split("about ")[1].split(" more solve")[0])
    code, _, _ = call(*LQR, "--max-solves", 3 + 2 * n)
    assert code == 0, "it takes no more than twice what it said"


def test_half_widths_are_told_in_parts_that_add_up(call, tmp_path):
    code, out, _ = call(*LQR)
    content = json.loads((tmp_path / "out.json").read_text())
    parts = content["summary"]["half_widths"]
    half = np.sum([parts[name] for name in PARTS], axis=0)
    low, high = np.array(content["intervals"]).T
    w = np.array(content["w"])
    assert code == 0 and parts["gap_source"] == "measured"
    assert (low <= w - half + 1e-9).all() and (high >= w + half - 1e-9).all()
    assert content["summary"]["how_sure"] in " ".join(out.split())


def test_a_person_may_vouch_for_the_expert(call, tmp_path):
    widths = {}
    for gap in (0, 0.001):
        code, out, _ = call(*LQR, "--expert-gap", gap)
        content = json.loads((tmp_path / "out.json").read_text())
        assert code == 0 and content["expert_gap"] == gap
        assert "--expert-gap" in content["summary"]["how_sure"] and "--expert-gap" in out
        widths[gap] = np.array(content["summary"]["half_widths"]["from_gap"])
    assert not widths[0].any() and (widths[0.001] > 0.0).all()


IMPOSSIBLE = [("expert-gap", -0.1), ("expert-gap", 1), ("min-weight", "nan"), ("min-weight", 0.34)]


@pytest.mark.parametrize(("flag", "value"), IMPOSSIBLE)
def test_impossible_bounds_are_named(complaint, flag, value):
    assert flag in complaint("recover", "--domain", "lqr", "--no-record", f"--{flag}", value)


def test_ground_truths_below_the_least_weight_are_refused_by_name(call, complaint):
    planar = ("recover", "--domain", "humanoid-planar", "--weights", "1,1,0,0,1,4")
    sentence = complaint(*planar, "--rollouts", 0, "--no-record")
    assert "smooth 0, stability 0" in sentence and "at least 0.005" in sentence
    assert "--min-weight" in sentence
    bounded = (*LQR, "--weights", "1,4,15", "--min-weight", 0.1)
    assert "axis 1 0.05" in complaint(*bounded)
    assert "axis 2 0.0" in complaint(*LQR, "--seed", 1, "--min-weight", 0.1), "drawn ones, too"
    code, out, _ = call(*LQR, "--weights", "0,4,15")
    assert code == 0 and "ground-truth weights inside" in out


def test_a_better_gait_than_the_experts_is_told_instead_of_a_negative_loss(call, tmp_path):
    code, out, _ = call(*LQR, "--expert", "suboptimal", "--mode", "minimise")
    content = json.loads((tmp_path / "out.json").read_text())
    assert code == 0 and content["expert_beaten_by"] > 0.0
    assert "better than the expert's own" in " ".join(out.split())
    assert "ground-truth weights: 0.00000 %" in out
    code, out, _ = call(*LQR)
    content = json.loads((tmp_path / "out.json").read_text())
    assert content["expert_beaten_by"] <= 1e-9 and "better than" not in out
