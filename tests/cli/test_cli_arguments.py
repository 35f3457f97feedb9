"""One clear sentence for every wrong argument."""

import pytest

from walking_irl.domains.humanoid.closed_loop.trials import DISTURBANCES, Trials
from walking_irl.domains.humanoid.domain import trials_of
from walking_irl.domains.humanoid.options import OPTIONS
from walking_irl.domains.humanoid.population import POPULATIONS
from walking_irl.geometry.centres import CENTRES
from walking_irl.run.setup import Setup

PLANAR = ("--domain", "humanoid-planar")
WRONG_WEIGHTS = {
    "too few": "1,2,3",
    "too many": "1,1,1,1,1,1,1",
    "negative": "-1,2,1,1,1,1",
    "negative inside": "1,-2,1,1,1,1",
    "NaN": "nan,1,1,1,1,1",
    "infinite": "1,inf,1,1,1,1",
    "all zero": "0,0,0,0,0,0",
    "words": "one,two,three,four,five,six",
    "empty": "",
    "hole": "1,,1,1,1,1",
}


@pytest.mark.parametrize("weights", WRONG_WEIGHTS.values(), ids=WRONG_WEIGHTS.keys())
@pytest.mark.parametrize("command", ["recover", "gait"])
def test_wrong_weights(complaint, command, weights):
    assert "weights" in complaint(command, *PLANAR, "--weights", weights)


def test_wrong_weights_of_another_domain(complaint):
    assert "expected 3 weights (axis 1, axis 2, axis 3), got 2" in complaint(
        "recover", "--domain", "lqr", "--weights", "1,2"
    )


@pytest.mark.parametrize(
    ("option", "value", "choice"),
    [
        ("--domain", "humanoid-spatial", "humanoid-planar"),
        ("--centre", "acc", "ac"),
        ("--mode", "best", "optimal"),
        ("--expert", "clumsy", "suboptimal"),
        ("--disturbance", "wind", "kicks"),
        ("--population", "normal", "uniform"),
    ],
)
def test_unknown_names_list_those_that_exist(complaint, option, value, choice):
    domain = () if option == "--domain" else PLANAR
    sentence = complaint("recover", *domain, option, value)
    assert repr(value) in sentence and choice in sentence


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--rollouts", "1"),
        ("--rollouts", "-3"),
        ("--rollouts", "many"),
        ("--noise", "-0.1"),
        ("--noise", "nan"),
        ("--seed", "-1"),
        ("--seed", "1.5"),
        ("--max-solves", "0"),
        ("--record", "walking.mp4"),
        ("--record", "walking.npz"),
        ("--frobnicate", "1"),
    ],
)
def test_wrong_options_of_recover(complaint, option, value):
    assert option.strip("-") in complaint("recover", *PLANAR, option, value) or option == "--record"


@pytest.mark.parametrize(
    "options",
    [
        ("--seconds", "0"),
        ("--seconds", "inf"),
        ("--save", "g.txt"),
        ("--png", "g.jpg"),
        ("--video", "g.mp4"),
        ("--record", "g.mp4"),
        ("--domain", "lqr"),
    ],
)
def test_wrong_options_of_gait(complaint, options):
    complaint("gait", *PLANAR, "--weights", "1,1,1,1,1,1", *options)


def test_no_command_and_an_unknown_one(complaint):
    assert "COMMAND" in complaint()
    assert "'walk'" in complaint("walk")


def test_settings_of_recorded_walkers_are_refused_elsewhere(complaint):
    for option, value in (("--rollouts", 5), ("--noise", "nan"), ("--population", "uniform")):
        sentence = complaint("recover", "--domain", "lqr", option, value, "--no-record")
        assert option[2:] in sentence and "known exactly" in sentence


@pytest.mark.parametrize(
    ("argv", "refused"),
    [
        (("--expert", "suboptimal", "--rollouts", 3), "rollouts"),
        (("--rollouts", 0, "--noise", 0.1), "noise"),
        (("--rollouts", 0, "--disturbance", "kicks"), "disturbance"),
        (("--weights", "1,1,1,1,1,1", "--population", "uniform"), "population"),
    ],
)
def test_options_without_effect_are_refused_by_name(complaint, argv, refused):
    assert f"leave out {refused}" in complaint("recover", *PLANAR, *argv)


def test_a_demonstration_takes_no_settings_of_synthetic_experts(complaint, demonstration):
    given = ("recover", *PLANAR, "--demonstration", demonstration[0])
    for option, value in (("--expert", "suboptimal"), ("--rollouts", 5)):
        assert f"leave out {option[2:]}" in complaint(*given, option, value)


def test_the_old_name_of_the_checkpoint_is_understood_and_told(call, complaint, tmp_path):
    job = ("recover", "--domain", "lqr", "--no-record")
    code, out, err = call(*job, "--archive", "a.npz")
    assert code == 0 and not err and "--checkpoint" in out and (tmp_path / "a.npz").exists()
    assert "one of them" in complaint(*job, "--archive", "b.npz", "--checkpoint", "c.npz")


def test_help_takes_its_defaults_from_where_they_live(call):
    out = " ".join(call("recover", "--help")[1].split())
    for part in (f"({Setup.centre})", f"({Setup.mode};", f"{', '.join(CENTRES)}", "who walks:",
                 "how it is drawn and recorded:", "algorithm:", "output:"):  # fmt: skip
        assert part in out, part
    for option in OPTIONS.values():
        assert f"({option.default})" in out and all(choice in out for choice in option.choices)


def test_options_of_walkers_are_what_walkers_understand():
    assert Trials() == trials_of({name: o.default for name, o in OPTIONS.items()})
    assert OPTIONS["population"].choices == tuple(POPULATIONS)
    assert OPTIONS["disturbance"].choices == DISTURBANCES
