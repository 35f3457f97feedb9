import ast
import subprocess
import sys
from pathlib import Path

import walking_irl

ROOT = Path(walking_irl.__file__).parent
CORE = [
    "dual_simplex",
    "gauge",
    "halfspaces",
    "polyhedron",
    "certificates",
    "newton",
    "modeller",
    "archive",
    "guide",
    "probing",
    "snapshot",
    "stopping",
]
UPPER = ["domains", "baselines", "recording", "experiments", "cli"]


def imports(path):
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module


def uses(path, names):
    return [m for m in imports(path) if any(m.startswith(f"walking_irl.{n}") for n in names)]


def test_core_knows_no_domain_recorder_or_command_line():
    for path in [*(ROOT / f"{n}.py" for n in [*CORE, "cpirl"]), *(ROOT / "centres").glob("*.py")]:
        assert not uses(path, UPPER), path


def test_lower_layers_do_not_know_the_loop():
    for path in [*(ROOT / f"{n}.py" for n in CORE), *(ROOT / "domains").rglob("*.py")]:
        assert not uses(path, ["cpirl"]), path
    assert not uses(ROOT / "polyhedron.py", ["centres", "certificates", "archive", "guide"])


def test_only_the_recorder_imports_rerun():
    for path in ROOT.rglob("*.py"):
        if "recording" not in path.relative_to(ROOT).parts:
            assert not [m for m in imports(path) if m.split(".")[0] == "rerun"], path


def test_importing_the_algorithm_stays_light():
    code = "import sys, walking_irl.cpirl; print(sorted(sys.modules))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    for heavy in ("mujoco", "dm_control", "rerun", "cvxpy"):
        assert f"'{heavy}'" not in out.stdout
