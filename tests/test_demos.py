"""The demos run without a screen and leave what they promise; the planar body makes them quick."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from walking_irl.recording.reader import Recording, inspect_recording

DEMOS = Path(__file__).parents[1] / "demos"
LONGEST = 100  # lines


def demo(name, *argv, folder):
    """Output of a demo that runs in an empty folder, without a screen."""
    env = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    done = subprocess.run(
        [sys.executable, DEMOS / name, *argv],
        cwd=folder, env=env, capture_output=True, text=True, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("path", sorted(DEMOS.glob("*.py")), ids=lambda p: p.name)
def test_demos_are_short_and_guarded(path):
    text = path.read_text()
    assert len(text.splitlines()) <= LONGEST
    assert 'if __name__ == "__main__":' in text  # worker processes import the file


def rows(out, names):
    """Numbers of a demo's lines that begin with the names."""
    lines = [line.replace("..", " ").split() for line in out.splitlines() if line.strip()]
    return np.array([[float(v) for v in line[1:]] for line in lines if line[0] in names])


@pytest.mark.parametrize("seed", ["0", "4"])
def test_a_shopkeepers_books_tell_what_they_were_kept_for(tmp_path, seed):
    out = demo("own_problem.py", "--seed", seed, folder=tmp_path)
    w, low, high = rows(out, ("holding", "shortage", "delivery")).T
    (hidden,) = rows(out, ("hidden",))
    assert np.all((low <= hidden) & (hidden <= high)) and (high - low).max() < 0.5
    assert np.abs(w - hidden).max() < 0.15
    assert float(out.split(" %")[0].split()[-1]) >= 90
    assert not list(tmp_path.iterdir()), "it leaves no files"


@pytest.mark.slow
def test_main_job_as_a_library_user_writes_it(tmp_path):
    out = demo("humanoid_walking.py", "--planar", "--seed", "3", folder=tmp_path)
    error = float(out.strip().rsplit(maxsplit=1)[-1])
    assert "Newton" in out and error < 0.01
    content = inspect_recording(tmp_path / "walking.rrd")
    assert content["seed"] == 3 and content["ending"] is None
    assert content["iterations"] == sum(" regret " in line for line in out.splitlines())


@pytest.mark.slow
def test_six_gaits_differ_in_what_they_were_weighed_for(tmp_path):
    out = demo("one_gait.py", "--planar", folder=tmp_path)
    assert "6 of 6" in out
    assert (tmp_path / "gaits.png").read_bytes().startswith(b"\x89PNG")
    recording = Recording(tmp_path / "gaits.rrd")
    assert recording.has_blueprint
    assert len(recording.column("/summary", "TextDocument:text").rows) == 6


@pytest.mark.parametrize("K", ["3", "4"])
def test_four_centres_of_one_polyhedron(tmp_path, K):
    out = demo("four_centres.py", "--objectives", K, folder=tmp_path)
    lines = [line.split() for line in out.splitlines() if line.strip()[:1].isdigit()]
    lines, means = lines[:-1], np.array(lines[-1], float)
    errors = np.array([[float(e) for e in line[1:]] for line in lines])
    assert errors.shape[1] == 4
    assert np.ptp(errors[0]) < 1e-5, "all centres of the whole simplex are its middle"
    assert (errors[-1] < 0.02).all()
    recording = Recording(tmp_path / "centres.rrd")
    seen = [e for e in recording.entities if e.startswith("/polyhedron/all/other/")]
    curves = [e for e in recording.entities if e.startswith("/distance/")]
    assert len(seen) == len(curves) == 4
    for path, column in zip(sorted(curves), np.argsort(ORDER), strict=True):
        *drawn, end = [row[0] for row in recording.column(path, "Scalars:scalars").rows]
        assert end == drawn[-1], "a curve goes on to the end"
        assert np.allclose(10 ** np.array(drawn), errors[:, column], atol=1e-5)
    n = int(K) - 1
    gravity = next(e for e in recording.entities if e.startswith("/share/") and "gravity" in e)
    *left, _ = [row[0] for row in recording.column(gravity, "Scalars:scalars").rows]
    assert max(left) <= 1 - (n / (n + 1)) ** n + 1e-6, "Gruenbaum's bound"
    assert np.exp(np.mean(np.log(left))) == pytest.approx(means[1], abs=1e-5)
    content = inspect_recording(tmp_path / "centres.rrd")
    assert content["iterations"] == len(lines) and content["ending"] is None


ORDER = ["analytic centre", "centre of gravity", "centre of the inscribed ellipsoid",
         "Chebyshev centre"]  # fmt: skip


@pytest.mark.slow
def test_a_bad_walk_is_beaten_in_every_objective(tmp_path):
    out = demo("suboptimal_expert.py", "--planar", folder=tmp_path)
    assert "one policy is at least as good as the expert in every feature" in out
    rows = [
        line.split() for line in out.splitlines() if line.endswith(" %") and "regret" not in line
    ]
    assert len(rows) == 6
    for _, walker, found, *_ in rows:
        assert float(found) <= float(walker)
    content = inspect_recording(tmp_path / "better.rrd")
    assert content["status"] == "dominated" and 0 < content["bracket"][0] <= content["bracket"][1]


@pytest.mark.slow
def test_the_average_adult_is_near_a_gait_of_the_body(tmp_path):
    files = ("--json", "adult.json", "--save", "adult.csv")
    out = demo("average_adult.py", "--starts", "1", *files, folder=tmp_path)
    w, half = rows(out.replace("+-", " "), NAMES).T
    assert w.sum() == pytest.approx(1, abs=0.01) and (half >= 0.02).all()
    content = json.loads((tmp_path / "adult.json").read_text())
    low, high = content["suboptimality"]
    assert 0 <= low <= high < 0.1 and content["nearest"]["root"] < 1e-4
    assert content["nearest"]["sagittal"] < 5.5  # degrees: as near as to healthy adults
    assert len((tmp_path / "adult.csv").read_text().splitlines()) == 102


NAMES = ("effort", "work", "smooth", "stability", "impact", "time")
