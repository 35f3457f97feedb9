import csv
import json
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from walking_irl.domains import load
from walking_irl.errors import InvalidInputError
from walking_irl.experiments import (
    TABLES,
    gridworld,
    humanoid,
    lqr,
    run,
    run_tables,
    runner,
    walking_path,
)
from walking_irl.experiments.picture import solves_chart, steps_chart
from walking_irl.experiments.runner import Row, Runner
from walking_irl.experiments.table import COLUMNS
from walking_irl.experiments.tasks import Task, run_task, synthetic_expert

SVG = "{http://www.w3.org/2000/svg}"
CLOCKED = ("seconds", "query_seconds")
SMALL_GRID = gridworld.Config(
    grids=((9, 3, 0.9, "patches"),),
    large=(),
    samples=(100, 200),
    seeds=2,
    max_solves=30,
    mwal_rounds=(20,),
)
SMALL_LQR = lqr.Config(sizes=(2, 3), seeds=1, mwal_rounds=(20,), max_solves=20)
SMALL_WALK = humanoid.Config(max_solves=1, seeds=1, bodies=("humanoid-planar",))
SMALL_PATH = walking_path.Config(n_intervals=6, seeds=1, max_solves=2, mwal_rounds=(2,))


def untimed(outcomes):
    return [{k: v for k, v in o.items() if k not in CLOCKED} for o in outcomes]


def test_all_thesis_tables_are_there():
    assert list(TABLES) == [
        "2.1",
        "3.1a",
        "3.1b",
        "3.1c",
        "7.1",
        "fig7.1",
        *(f"7.{i}" for i in range(2, 14)),
    ]


@pytest.mark.parametrize(
    ("name", "config"),
    [
        *((name, SMALL_GRID) for name in ("7.1", "fig7.1", "7.2")),
        *((name, SMALL_LQR) for name in ("7.3", "7.4", "7.5", "7.6")),
        pytest.param("7.7", SMALL_PATH, marks=pytest.mark.slow),
        pytest.param("7.8", SMALL_PATH, marks=pytest.mark.slow),
        pytest.param("7.9", SMALL_PATH, marks=pytest.mark.slow),
        pytest.param("7.10", SMALL_PATH, marks=pytest.mark.slow),
        pytest.param("7.11", SMALL_WALK, marks=pytest.mark.slow),
        pytest.param("7.12", SMALL_WALK, marks=pytest.mark.slow),
    ],
)
def test_every_cell_is_filled_or_says_why_not(name, config):
    table = run(name, config)
    assert table.rows and {len(row) for row in table.rows} == {len(table.columns)}
    for row in table.rows:
        assert all(row)
        if set(row[2:]) == {"n/a"}:
            assert any(row[1] in note and row[0] in note for note in table.notes)
    assert table.header["seeds"] == config.seeds
    assert "numpy" in table.header["versions"]
    assert not any("failed on" in note for note in table.notes)


def test_files_say_the_same_thrice(tmp_path, monkeypatch):
    monkeypatch.setitem(TABLES, "7.3", (lqr.table_7_3, SMALL_LQR))
    markdown, sheet, content, picture = run_tables(["7.3"], out=tmp_path / "new", seeds=1)
    table = run("7.3", SMALL_LQR, cache=tmp_path / "new" / "cells")
    rows = list(csv.reader(sheet.read_text().splitlines()))
    assert rows == [list(table.columns), *map(list, table.rows)]
    assert [tuple(r) for r in json.loads(content.read_text())["rows"]] == list(table.rows)
    assert markdown.read_text() == table.to_markdown()
    assert markdown.read_text().count("\n| n=2 |") == 5
    lines = [line for line in markdown.read_text().splitlines() if line.startswith("|")]
    n_cells = {len(re.split(r"(?<!\\)\|", line)) - 2 for line in lines}
    assert n_cells == {len(table.columns)}, "a table that Markdown draws has rows of one length"
    words = [t.text for t in ElementTree.parse(picture).iter(f"{SVG}text")]
    assert {"n=2", "n=3", "CPIRL-AC"} <= set(words) and words.count("CPIRL-MVIE") == 2


def bars(svg):
    """Widths and fills of a chart's bars."""
    return [
        (float(r.get("width")), r.get("fill"))
        for r in ElementTree.fromstring(svg).iter(f"{SVG}rect")
    ][1:]


def test_bars_are_as_long_as_the_logarithm_of_the_solves():
    rows = [("a", "CPIRL-AC", "10.0 +- 0.5", "3/3"), ("a", "MWAL", "100.0", "2/3"),
            ("b", "LPAL", "n/a", "n/a")]  # fmt: skip
    (short, ours), (long, hollow) = bars(solves_chart("title <1>", rows))
    assert long == pytest.approx(2 * short, abs=0.2)
    assert ours != "white" and hollow == "white"


def test_steps_are_drawn_where_they_belong():
    rows = [("100", "8.0", "2.0"), ("1000", "4.0", "1.0"), ("10000", "4.0", "1.0")]
    circles = list(ElementTree.fromstring(steps_chart("title", rows)).iter(f"{SVG}circle"))
    x = [float(c.get("cx")) for c in circles]
    y = [float(c.get("cy")) for c in circles]
    assert x[1] - x[0] == pytest.approx(x[2] - x[1], abs=0.2)
    assert y[1] == y[2] > y[0]


def test_finished_cells_are_not_run_again(tmp_path, monkeypatch):
    task = Task("lqr", {"n_objectives": 2}, arguments={"centre": "ac"})
    rows = [Row("n=2", "CPIRL-AC", task)]
    first = Runner(cache=tmp_path).table("x", "", rows, 3)
    calls = []

    def counted(task):
        calls.append(task.seed)
        return task.run()

    monkeypatch.setattr(runner, "run_job", counted)
    assert Runner(cache=tmp_path).table("x", "", rows, 3) == first
    assert calls == []
    Runner(cache=tmp_path).table("x", "", rows, 4)
    assert calls == [3]


def test_an_executor_changes_nothing_but_the_clock():
    tasks = [Task("lqr", {"n_objectives": 3}, arguments={"centre": "cg"}, seed=s) for s in range(4)]
    progress = []
    with ThreadPoolExecutor(2) as pool:
        parallel = Runner(pool, None, lambda *p: progress.append(p)).outcomes("x", tasks)
    assert untimed(parallel) == untimed(Runner().outcomes("x", tasks))
    assert progress == [("x", i, 4) for i in range(1, 5)]


def test_success_means_what_the_criterion_says():
    task = Task("lqr", {"n_objectives": 3}, arguments={"centre": "ac"}, share=1e-4)
    strict, loose = run_task(task), run_task(Task(**{**task.key(), "share": 0.2}))
    assert strict["success"] and loose["success"]
    assert strict["solves"] > loose["solves"]
    assert not run_task(Task(**{**task.key(), "share": 1e-12, "max_solves": 2}))["success"]


def test_a_failing_seed_is_reported_and_does_not_lose_the_table():
    rows = [Row("n=2", "LPAL", Task("lqr", {"n_objectives": 2}, method="lpal"))]
    table = Runner().table("x", "", rows, 2)
    assert "0/2" in table.rows[0]
    assert any("failed on 2 seeds" in n and "finitely many states" in n for n in table.notes)
    assert len(table.rows[0]) == len(COLUMNS)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"names": ["7.99"]},
            "unknown table '7.99'; choose from 2.1, 3.1a, 3.1b, 3.1c, 7.1, fig7.1",
        ),
        ({"names": ["7.1"], "seeds": 0}, "seeds must be at least 1"),
    ],
)
def test_bad_requests_are_named(arguments, message, tmp_path):
    with pytest.raises(InvalidInputError, match=message):
        run_tables(out=tmp_path, **arguments)


def test_output_that_is_a_file_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidInputError, match="cannot write to"):
        run_tables(["7.1"], out=tmp_path / "file")


@pytest.mark.parametrize(("n", "solves"), [(5, 10), (8, 13)])
def test_one_policy_dominates_every_clearly_suboptimal_lqr_expert(n, solves):
    """Mean solves over 10 experts by cuts alone, Algorithm 3 beside it; fewer with Newton steps."""
    options = {"n_objectives": n, "perturbation": 0.25}
    task = Task("lqr", options, criterion="dominance", least_advantage=0.002)

    def mean_solves(method="cpirl", **arguments):
        outcomes = [
            run_task(replace(task, method=method, arguments=arguments, seed=s)) for s in range(10)
        ]
        return np.mean([o["solves"] for o in outcomes]), all(o["success"] for o in outcomes)

    for centre in ("cg", "mvie"):
        mean, is_dominated = mean_solves(centre=centre)
        assert is_dominated and mean <= solves
    mean, is_dominated = mean_solves(centre="ac")
    assert is_dominated and mean <= solves + 1  # K = 8: 13.9
    mean, is_dominated = mean_solves(centre="ac", has_newton=True)
    assert is_dominated and mean <= 6
    utopian, is_dominated = mean_solves("utopia", centre="ac")
    assert utopian > 2 * mean and not is_dominated


def test_experts_are_drawn_until_one_is_clearly_suboptimal():
    task = Task("lqr", {"n_objectives": 3, "perturbation": 0.25}, criterion="dominance")
    domain = load("lqr", **task.options)
    for seed in range(5):
        strict = replace(task, least_advantage=0.002, seed=seed)
        expert, n_drawn = synthetic_expert(strict, domain, np.random.default_rng(seed))[1:]
        assert domain.advantage(expert.mu) >= 0.002 * np.abs(expert.mu).mean()
        first, one = synthetic_expert(task, domain, np.random.default_rng(seed))[1:]
        assert one == 1 and (n_drawn == 1) == bool((first.mu == expert.mu).all())
    optimal = domain.forward(np.array([0.2, 0.3, 0.5])).mu
    assert domain.advantage(optimal) == pytest.approx(0.0, abs=1e-9)
    assert domain.advantage(optimal - 1.0) == pytest.approx(1.0)


def test_a_broken_cell_is_run_again(tmp_path):
    task = Task("lqr", {"n_objectives": 2}, arguments={"centre": "ac"})
    [first] = Runner(cache=tmp_path).outcomes("x", [task])
    [cell] = tmp_path.iterdir()
    cell.write_text(cell.read_text()[:20])
    [again] = Runner(cache=tmp_path).outcomes("x", [task])
    assert untimed([again]) == untimed([first])


def test_the_longest_jobs_begin_first():
    """Whoever says nothing of its cost keeps its place behind them."""

    class Job:
        def __init__(self, name, cost=None):
            self.name = name
            if cost is not None:
                self.cost = cost

        def key(self):
            return {"name": self.name}

        def run(self):
            begun.append(self.name)
            return {"name": self.name}

    begun = []
    jobs = [Job("a"), Job("b", 1.0), Job("c", 9.0), Job("d")]
    with ThreadPoolExecutor(1) as executor:
        outcomes = Runner(executor=executor).outcomes("any", jobs)
    assert begun == ["c", "b", "a", "d"]
    assert [o["name"] for o in outcomes] == ["a", "b", "c", "d"]
