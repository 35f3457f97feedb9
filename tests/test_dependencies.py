"""Which package may import which; a rule a folder, so that a new file is held to it, too."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import walking_irl
from walking_irl.domains import DOMAINS

ROOT = Path(walking_irl.__file__).parent
LEAVES = {"archives", "arrays", "errors", "types", "expert", "files", "versions", "workers"}
ALLOWED = {
    "geometry": {"arrays", "errors"},
    "cpirl": LEAVES | {"geometry"},
    "rl": LEAVES,
    "domains": LEAVES | {"rl"},
    "baselines": LEAVES | {"geometry", "cpirl", "rl"},
    "environments": LEAVES | {"domains", "rl"},
    "recording": LEAVES | {"geometry", "cpirl", "domains"},
}
"""Packages of walking_irl that each folder may import, beside itself; the others may import all."""


def imports(path):
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def packages(path):
    """Packages and flat modules of walking_irl that a file imports."""
    own = [m.split(".") for m in imports(path)]
    return {m[1] for m in own if m[0] == "walking_irl" and len(m) > 1} - {"__version__"}


@pytest.mark.parametrize("folder", ALLOWED)
def test_a_package_imports_only_what_lies_below_it(folder):
    for path in sorted((ROOT / folder).rglob("*.py")):
        assert packages(path) - {folder} <= ALLOWED[folder], path


REGISTRIES = ("domains/__init__.py",)
"""Where a domain may be asked for its type or its name."""
TYPES = {"Humanoid", "LQR", "Gridworld", "Driving", "WalkingPath", "FiniteDomain", "ExactDomain"}


def asks_for_a_domain(node):
    """Whether a piece of code tests a domain's type, or compares something with its name."""
    if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "isinstance":
        return bool(TYPES & {n.id for n in ast.walk(node.args[1]) if isinstance(n, ast.Name)})
    if isinstance(node, ast.Compare) and isinstance(node.ops[0], ast.Eq | ast.NotEq):
        sides = [node.left, *node.comparators]
        return any(isinstance(n, ast.Constant) and n.value in DOMAINS for n in sides)
    called = getattr(getattr(node, "func", None), "attr", "")
    if isinstance(node, ast.Call) and called in ("startswith", "endswith"):
        words = [n.value for n in ast.walk(node) if isinstance(n, ast.Constant)]
        return any(isinstance(word, str) and "humanoid" in word for word in words)
    return False


def test_domains_answer_for_themselves():
    for path in ROOT.rglob("*.py"):
        if path.relative_to(ROOT).as_posix() not in REGISTRIES:
            asked = [
                n.lineno for n in ast.walk(ast.parse(path.read_text())) if asks_for_a_domain(n)
            ]
            assert not asked, (path, asked)


def test_the_search_for_such_questions_finds_one():
    questions = ("isinstance(d, Humanoid)", "d.name == 'lqr'", "name.startswith('humanoid')")
    for text in questions:
        assert any(asks_for_a_domain(node) for node in ast.walk(ast.parse(text))), text


def graph():
    """Folders and flat modules, and what each imports."""
    edges = {}
    for path in ROOT.rglob("*.py"):
        name = path.relative_to(ROOT).parts[0].removesuffix(".py")
        edges.setdefault(name, set()).update(packages(path) - {name})
    return edges


def test_packages_have_no_circles_and_few_levels():
    edges, level = graph(), {}

    def height(name, above=()):
        assert name not in above, f"a circle: {' > '.join((*above, name))}"
        if name not in level:
            below = [height(other, (*above, name)) for other in edges.get(name, ())]
            level[name] = 1 + max(below, default=0)
        return level[name]

    height("__main__")
    assert level["cli"] <= 10


def test_few_modules_lie_flat():
    assert len([p for p in ROOT.glob("*.py") if not p.name.startswith("__")]) <= 8


def test_only_the_recorder_imports_rerun():
    for path in ROOT.rglob("*.py"):
        if "recording" not in path.relative_to(ROOT).parts:
            assert not [m for m in imports(path) if m.split(".")[0] == "rerun"], path


@pytest.mark.parametrize("module", ["walking_irl", "walking_irl.cpirl", "walking_irl.geometry"])
def test_importing_the_algorithm_stays_light(module):
    code = f"import sys, {module}; print(sorted(sys.modules))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    for heavy in ("mujoco", "dm_control", "rerun", "cvxpy"):
        assert f"'{heavy}'" not in out.stdout
