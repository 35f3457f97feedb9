"""Studies: their figures against laws that are known, their files, and what survives a stop."""

import csv
import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.stats import binom
from scipy.stats import t as student

from walking_irl.errors import InvalidInputError, SolverError
from walking_irl.experiments import runner
from walking_irl.experiments.study import Study, run_study
from walking_irl.experiments.study import expert as study_expert
from walking_irl.experiments.study.command import recover_command
from walking_irl.experiments.study.coverage import (
    LEVELS,
    binomial_share,
    calibration,
    scored,
    strain,
)
from walking_irl.experiments.study.files import to_markdown, write_study
from walking_irl.experiments.study.result import Result
from walking_irl.expert import student_quantile
from walking_irl.run import session
from walking_irl.run.setup import Setup

LQR = Setup(domain="lqr")
CLOCKS = ("seconds", "cpu_seconds")


def untimed(result):
    return [{k: v for k, v in o.items() if k not in CLOCKS} for o in result.outcomes]


@pytest.mark.parametrize(("k", "n"), [(0, 20), (1, 20), (13, 20), (20, 20), (97, 100)])
def test_binomial_intervals_end_where_the_tails_hold_a_fortieth(k, n):
    """The definition of Clopper and Pearson, by the binomial distribution itself."""
    value, low, high = binomial_share(k, n)
    assert value == k / n
    if k > 0:
        assert binom.sf(k - 1, n, low) == pytest.approx(0.025, rel=1e-6)
    if k < n:
        assert binom.cdf(k, n, high) == pytest.approx(0.025, rel=1e-6)
    assert (low == 0.0) == (k == 0) and (high == 1.0) == (k == n)


def drawn(n, n_samples, spread=1.0, K=3, seed=0):
    """Outcomes whose errors follow Student's law exactly, times ``spread``."""
    rng = np.random.default_rng(seed)
    se, w = 0.01, np.full(K, 1 / K)
    half = se * student.ppf(1 - 0.025 / K, n_samples - 1)  # for all weights at once
    return [
        {
            "seed": i,
            "objectives": [f"o{j}" for j in range(K)],
            "w": w.tolist(),
            "w_expert": (w + spread * se * rng.standard_t(n_samples - 1, K)).tolist(),
            "intervals": np.c_[w - half, w + half].tolist(),
            "least": 0.0,
            "n_samples": n_samples,
            "l1_error": 0.01,
            "ending": "converged",
            "status": "a sentence",
            "error": None,
        }
        for i in range(n)
    ]


@pytest.mark.parametrize("n_samples", [5, 20])
def test_calibration_of_errors_that_follow_the_law_is_the_diagonal(n_samples):
    """4 standard errors of 6000 independent draws: chance fails it once in 3000 runs; seeded."""
    measured = calibration(scored(drawn(2000, n_samples)))
    for level in LEVELS:
        tolerance = 4 * np.sqrt(level * (1 - level) / 6000)
        assert measured[level].value == pytest.approx(level, abs=tolerance)


def test_errors_larger_than_told_are_seen_at_every_level():
    measured = calibration(scored(drawn(500, 20, spread=2.0)))
    assert all(measured[level].high < level for level in LEVELS)


def test_intervals_of_exact_experts_are_the_same_at_every_level():
    found = scored([{**o, "n_samples": 0} for o in drawn(200, 20)])
    assert len({share.value for share in calibration(found).values()}) == 1


def test_a_side_that_the_simplex_cuts_off_is_no_narrower_than_the_other():
    [outcome] = drawn(1, 20)
    outcome |= {"w": [0.01, 0.5, 0.49], "w_expert": [0.0, 0.5, 0.5]}
    outcome["intervals"] = [[0.0, 0.04], [0.4, 0.6], [0.4, 0.6]]
    found = scored([outcome])
    assert found.half[0, 0] == pytest.approx(0.03)
    assert strain(found)[0] == pytest.approx([1 / 3, 0.0, 0.1 / 1.1])


def test_student_and_normal_quantiles_meet():
    many = np.array([10**6])
    assert student_quantile(0.95, many) == pytest.approx(1.959964, abs=1e-4)
    assert student_quantile(0.95, many, 5) == student_quantile(0.99, many)


def test_intervals_of_all_weights_at_once_hold_at_their_level():
    """4 standard errors of 2000 experts; weights are independent, so that Bonferroni is near."""
    inside = scored(drawn(2000, 20)).inside.all(axis=1).mean()
    assert inside == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / 2000))


def test_only_the_part_that_noise_explains_goes_with_the_level():
    none = [0.0, 0.0, 0.0]
    found = [{**o, "parts": {"noise": none, "gap": none, "solver": none}} for o in drawn(50, 20)]
    assert len({share.value for share in calibration(scored(found)).values()}) == 1


def test_experts_that_lie_inside_without_the_part_from_sub_optimality_are_counted():
    parts = {"noise": [0.01] * 3, "gap": [0.5] * 3, "solver": [0.02] * 3}
    wide = [[0.0, 1.0]] * 3
    found = [{**o, "parts": parts, "intervals": wide, "w": [0.3, 0.3, 0.4]} for o in drawn(3, 20)]
    for outcome, off in zip(found, (0.0, 0.029, 0.031), strict=True):
        outcome["w_expert"] = [0.3 + off, 0.3 - off, 0.4]
    result = Result(LQR, tuple(found))
    assert result.inside_if_vouched.value == pytest.approx(2 / 3)
    assert result.beyond_half_if_vouched.value == pytest.approx(4 / 9)
    assert result.experts_inside.value == 1.0
    assert result.spreads["of it from the solver"] == pytest.approx((0.02, 0.02, 0.02))


@pytest.fixture(scope="module")
def six(tmp_path_factory):
    """A study of six experts, and the folder of its cells."""
    cells = tmp_path_factory.mktemp("study") / "cells"
    return run_study(Study(LQR, 6), cells=cells), cells


def test_every_expert_of_the_lqr_lies_inside(six):
    result, _ = six
    assert result.n == 6 and [o["seed"] for o in result.outcomes] == list(range(6))
    assert result.experts_inside.value == result.successes.value == 1.0
    assert result.experts_inside.low == pytest.approx(0.025 ** (1 / 6))  # 6 of 6
    [(ending, n, sentence)] = result.endings
    assert n == 6 and ending == "matched" and "optimal" in sentence


def test_an_outcome_is_that_of_the_command_that_repeats_it(six):
    result, _ = six
    outcome = result.outcomes[4]
    assert recover_command(replace(LQR, seed=4)) == "walking-irl recover --domain lqr --seed 4"
    report = session.run(replace(LQR, seed=4))
    assert outcome["w"] == report.w.tolist() and outcome["status"] == report.status
    assert outcome["l1_error"] == report.l1_error
    widths = np.sum([outcome["parts"][part] for part in ("noise", "gap", "solver")], axis=0)
    assert report.summary.certainty.half_widths == pytest.approx(widths)
    assert outcome["solves"] + outcome["probes"] == len(report.iterations)


def test_files_tell_the_same(six, tmp_path):
    result, _ = six
    markdown, sheet, content, picture = write_study(result, tmp_path)
    rows = list(csv.DictReader(sheet.read_text().splitlines()))
    assert [float(row["w axis 1"]) for row in rows] == [o["w"][0] for o in result.outcomes]
    told = json.loads(content.read_text())
    assert told["experts_inside"]["value"] == 1.0 and len(told["outcomes"]) == 6
    assert "walking-irl study --domain lqr --experts 6 --seed 0" in markdown.read_text()
    assert "6 of 6: 100.0 % (54.1 - 100.0)" in markdown.read_text()
    for line in markdown.read_text().splitlines():
        assert not line.startswith("|") or line.count("|") >= 3
    words = [e.text for e in ElementTree.parse(picture).iter() if e.text]
    assert any("6 experts of lqr" in word for word in words)


def test_what_is_done_is_not_done_again(six, monkeypatch):
    result, cells = six
    assert len(list(cells.iterdir())) == 6
    called = []

    def counted(job):
        called.append(job.setup.seed)
        return job.run()

    monkeypatch.setattr(runner, "run_job", counted)
    assert run_study(Study(LQR, 6), cells=cells).outcomes == result.outcomes
    assert called == []
    run_study(Study(replace(LQR, seed=3), 4), cells=cells)
    assert called == [6]  # seeds 3 to 5 are known
    run_study(Study(replace(LQR, centre="cg"), 1), cells=cells)
    assert called == [6, 0]  # another centre is another expert


def test_an_executor_changes_nothing_but_the_clock(six):
    progress = []
    with ThreadPoolExecutor(2) as pool:
        result = run_study(Study(LQR, 6), executor=pool, progress=lambda *p: progress.append(p))
    assert untimed(result) == untimed(six[0])
    assert progress == [("study", i, 6) for i in range(1, 7)]


def test_an_expert_that_fails_is_counted_and_named(monkeypatch):
    run = session.run

    def failing(setup):
        if setup.seed == 1:
            raise SolverError("no gait found")
        if setup.seed == 2:
            raise ZeroDivisionError("of a kind that nobody foresaw")
        return run(setup)

    monkeypatch.setattr(study_expert.session, "run", failing)
    result = run_study(Study(LQR, 4))
    assert result.n == 4 and result.experts_inside.value == 0.5
    assert [w.seed for w in result.worst[:2]] == [1, 2]
    assert "no gait found" in result.worst[0].what
    assert result.worst[0].command.endswith("--seed 1")
    assert "ZeroDivisionError: of a kind" in to_markdown(result)


def test_the_worst_is_the_one_that_lies_farthest_out():
    outcomes = drawn(20, 20)
    outcomes[7] = {**outcomes[7], "w_expert": [0.9, 0.05, 0.05]}
    result = Result(LQR, tuple(outcomes))
    assert [w.seed for w in result.worst][0] == 7 and "OUTSIDE" in result.worst[0].what
    assert len(result.worst) == 3
    assert result.weights[0].inside.value < 1.0


def test_a_study_in_which_everybody_fails_for_one_reason_says_it(monkeypatch):
    def refusing(setup):
        raise InvalidInputError("there is nothing to see")

    monkeypatch.setattr(study_expert.session, "run", refusing)
    with pytest.raises(InvalidInputError, match="no expert could be recovered: there is nothing"):
        run_study(Study(LQR, 2))


@pytest.mark.parametrize(
    ("setup", "experts", "message"),
    [
        (LQR, 0, "experts must be at least 1"),
        (replace(LQR, weights=(1.0, 1.0, 1.0)), 2, "leave out weights"),
        (Setup(domain="lqr", options={"rollouts": 3}), 2, "takes no rollouts"),
        (Setup(domain="moon"), 2, "unknown domain 'moon'"),
    ],
)
def test_bad_requests_are_named(setup, experts, message):
    with pytest.raises(InvalidInputError, match=message):
        Study(setup, experts)
