"""Every benchmark runs and says what it should; no test asserts a time."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
ROWS = {
    "centres": ["ac    3 / 20", "cc    3 / 20", "mvie  3 / 20", "cg    3 / 20"],
    "closed_loop": ["reference"],
    "environment": [
        "bare mj_step",
        "environment, policy",
        "Gymnasium, baseline agent",
        "rollout: policy, all recorded",
    ],
    "evaluated_policies": ["lqr, queries alone", "lqr, demonstration", "gridworld, iterates"],
    "faults": ["kill -9", "Ctrl-C", "SIGTERM", "full disk"],
    "forward_solver": ["gait solver, one iteration", "mujoco.minimize.least_squares"],
    "growth": ["3-D, 40 knots, 6 objectives", "80 knots", "planar", "9 objectives"],
    "known_walkers": ["typical 0, 1 deg"],
    "recovery": ["MuJoCo's inverse dynamics", "linear algebra", "Hessians", "queries"],
}
SLOW = ("recovery", "faults", "known_walkers")
HEADLINES = {
    "centres": r"^ac: .* \(target >= 5\): .*\n^cc: .*\n^mvie: ",
    "closed_loop": r"^2 walks of 3 s: \d falls .*\n^pushes of 80 N: \d of 4 .*\n^pushes of 150 N: ",
    "environment": r"^policy in the loop: \d\.\d\d of .* \(target >= 0\.5\): (met|NOT MET)$",
    "evaluated_policies": r"^lqr: \d+\.\d\d x fewer solves .*\n^gridworld: .* \(1 experts?\)$",
    "faults": r"^\d+ of \d+ faults survived: met$",
    "forward_solver": r"^one iteration takes .* \(target <= 33\): .*\n^derivatives are .* faster",
    "growth": r"^2 threads: .*\n^time grows with the power .* \(target <= 1\.2\): (met|NOT MET)$",
    "known_walkers": r"^nearer than the start: \d of 1\n^half widths hold \d+ % .*: (met|NOT MET)$",
    "recovery": r"^queries take \d+\.\d% of .* \(target <= 5 %\): (met|NOT MET)$",
}


def output(name: str) -> str:
    """What a benchmark prints with its smallest setting."""
    done = subprocess.run(
        [sys.executable, f"{name}.py", "--quick"],
        cwd=BENCHMARKS,
        env=os.environ,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_benchmark_is_tested():
    scripts = {p.stem for p in BENCHMARKS.glob("*.py") if "__main__" in p.read_text()}
    assert scripts == set(ROWS)


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow) if n in SLOW else n for n in ROWS]
)
def test_benchmark_prints_its_table_and_headline(name):
    text = output(name)
    lines = text.splitlines()
    rule = next(i for i, line in enumerate(lines) if set(line) == {"-"})
    for row in ROWS[name]:
        assert any(line.startswith(row) for line in lines[rule + 1 :]), text
    if name in HEADLINES:
        assert re.search(HEADLINES[name], text, re.MULTILINE), text


def test_readme_names_every_benchmark():
    text = (BENCHMARKS / "README.md").read_text()
    for name in ROWS:
        assert f"{name}.py" in text
