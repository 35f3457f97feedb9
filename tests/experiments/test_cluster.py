"""Studies and tables on a Dask cluster: a scheduler and two workers on the loopback address."""

import json
import os
import re
import signal
import subprocess
import sys

import pytest

from walking_irl.errors import InvalidInputError
from walking_irl.experiments import cluster, lqr
from walking_irl.experiments.cluster import ClusterError
from walking_irl.experiments.study import Study, run_study
from walking_irl.experiments.table import Table
from walking_irl.run.setup import Setup

pytest.importorskip("distributed")
pytestmark = pytest.mark.filterwarnings("ignore")  # of distributed and tornado, as they close
DASK = [sys.executable, "-m", "distributed.cli.dask_{}", "--no-dashboard"]
QUICK = ("--domain", "gridworld", "--max-solves", "6")
CLOCKS = ("seconds", "cpu_seconds", "query_seconds")


def start(kind, *argv):
    """A scheduler or a worker, and the address it has told."""
    command = [word.format(kind) for word in DASK]
    process = subprocess.Popen([*command, *argv], stderr=subprocess.PIPE, text=True)
    told = r"Scheduler at:\s*(\S+)" if kind == "scheduler" else r"Registered to:\s*(\S+)"
    for line in process.stderr:
        found = re.search(told, line)
        if found:
            return process, found[1]
    raise AssertionError(f"{kind} did not start")


@pytest.fixture
def dask():
    """Address of a scheduler and the processes of its two workers; all ended afterwards."""
    scheduler, address = start("scheduler", "--host", "127.0.0.1", "--port", "0")
    alone = ("--nthreads", "1", "--no-nanny")
    pair = [start("worker", address, "--name", name, *alone)[0] for name in "ab"]
    yield address, scheduler, pair
    for process in (*pair, scheduler):
        process.kill()
        process.communicate()


def untimed(outcomes):
    return [{k: v for k, v in o.items() if k not in CLOCKS} for o in outcomes]


def run(folder, address, *argv):
    return subprocess.Popen(
        [sys.executable, "-m", "walking_irl", *argv, "--scheduler", address],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.slow
def test_a_worker_that_is_killed_loses_nothing_and_nothing_counts_twice(dask, tmp_path):
    address, _, (first, _) = dask
    process = run(tmp_path, address, "study", *QUICK, "--experts", "8")
    lines = []
    for line in process.stdout:
        lines.append(line)
        if line.startswith("study: 2 of 8"):
            os.kill(first.pid, signal.SIGKILL)  # both workers are busy: its expert is lost
    assert process.wait() == 0, process.stderr.read()
    counted = [line.split(",")[0] for line in lines if line.startswith("study: ")]
    assert counted == [f"study: {i} of 8 experts" for i in range(1, 9)]
    there = json.loads((tmp_path / "study" / "study.json").read_text())["outcomes"]
    assert len(list((tmp_path / "study" / "cells").iterdir())) == 8
    here = run_study(Study(Setup(domain="gridworld", max_solves=6), 8))
    assert untimed(there) == json.loads(json.dumps(untimed(here.outcomes)))


@pytest.mark.slow
def test_a_scheduler_that_is_killed_is_one_sentence_and_keeps_what_is_done(dask, tmp_path):
    address, scheduler, _ = dask
    job = ("study", *QUICK, "--experts", "8")
    process = run(tmp_path, address, *job)
    for line in process.stdout:
        if line.startswith("study: 2 of 8"):
            scheduler.kill()
    assert process.wait() == 2
    err = process.stderr.read()
    assert err.count("\n") == 1 and "was lost; finished jobs are kept" in err, err
    assert len(list((tmp_path / "study" / "cells").iterdir())) >= 2


@pytest.mark.slow
def test_a_job_that_kills_its_workers_is_one_sentence(monkeypatch):
    monkeypatch.setenv("DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", "0")  # 3 by default
    scheduler, address = start("scheduler", "--host", "127.0.0.1", "--port", "0")
    worker, _ = start("worker", address, "--nthreads", "1", "--no-nanny")
    try:
        with (
            pytest.raises(ClusterError, match="a job killed every worker that took it"),
            cluster.cluster(address) as pool,
        ):
            pool.submit(os._exit, 1).result()
    finally:
        for process in (worker, scheduler):
            process.kill()
            process.communicate()


@pytest.mark.slow
def test_ctrl_c_ends_a_study_on_a_cluster(dask, tmp_path):
    process = run(tmp_path, dask[0], "study", *QUICK, "--experts", "8")
    for line in process.stdout:
        if line.startswith("study: 2 of 8"):
            process.send_signal(signal.SIGINT)
            break
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130 and not err and "the same command goes on" in out
    assert len(list((tmp_path / "study" / "cells").iterdir())) >= 2


@pytest.mark.slow
def test_tables_run_there_as_they_do_here(dask, call, tmp_path, monkeypatch):
    from walking_irl import experiments

    small = lqr.Config(sizes=(2,), seeds=2, mwal_rounds=(20,), max_solves=20)
    monkeypatch.setitem(experiments.TABLES, "7.3", (lqr.table_7_3, small))
    code, _, err = call("tables", "7.3", "--out", "t", "--scheduler", dask[0])
    assert code == 0 and not err
    there = json.loads((tmp_path / "t" / "table_7_3.json").read_text())["outcomes"]
    here = experiments.run("7.3", small)
    assert isinstance(here, Table)
    assert untimed(there) == json.loads(json.dumps(untimed(here.raw)))


def test_a_worker_of_another_version_is_refused():
    here = {**cluster.software(), "numpy": "1.0"}
    with pytest.raises(InvalidInputError, match=r"has numpy .* instead of 1\.0; install the same"):
        cluster.run_there(here, max, 1, 2)
    assert cluster.run_there(cluster.software(), max, 1, 2) == 2


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense", "tcp://127.0.0.1"])
def test_an_address_without_a_scheduler_is_one_sentence(complaint, address, monkeypatch):
    monkeypatch.setattr(cluster, "CONNECT", 0.5)
    sentence = complaint("study", "--domain", "lqr", "--out", ".", "--scheduler", address)
    assert f"no Dask scheduler answers at {address}" in sentence


@pytest.mark.slow
def test_a_scheduler_without_workers_says_how_to_start_some(complaint, monkeypatch):
    monkeypatch.setattr(cluster, "FIRST_WORKER", 0.5)
    scheduler, address = start("scheduler", "--host", "127.0.0.1", "--port", "0")
    try:
        told = complaint("study", "--domain", "lqr", "--out", ".", "--scheduler", address)
    finally:
        scheduler.kill()
        scheduler.communicate()
    assert "no worker has joined" in told and f"dask worker {address}" in told
