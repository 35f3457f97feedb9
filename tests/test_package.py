"""The package as others get it: the wheel, the commands of the README, no trace of one machine."""

import re
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

import walking_irl

ROOT = Path(walking_irl.__file__).parents[1]
MODELS = ("humanoid.xml", "humanoid_planar.xml", "gaits.npz")
TEXT = {".py", ".md", ".toml", ".cff", ".yaml", ".xml", ".cfg", ".txt", ""}
MACHINE_PATHS = re.compile(r"(?<![\w.])/(?:work|root|home|Users|mnt)/|\.\./" + "shared")


def tracked():
    """Text files of the repository, or of the unpacked source where there is no git."""
    command = ["git", "ls-files", "-z"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    names = done.stdout.split("\0") if done.returncode == 0 else []
    files = [ROOT / n for n in names if n] or [p for p in ROOT.rglob("*") if ".venv" not in p.parts]
    return [p for p in files if p.is_file() and p.suffix in TEXT]


def code_blocks(text):
    return re.findall(r"^```\w*\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def commands(text):
    """Lines of a text's code blocks that start a fresh environment."""
    lines = [line for block in code_blocks(text) for line in block.splitlines()]
    return [line.removeprefix("$ ") for line in lines if "-m venv" in line]


def test_readme_has_two_commands_of_one_line_and_ci_runs_the_second():
    job, tests = commands((ROOT / "README.md").read_text())
    assert job.endswith("walking-irl recover") and "pytest" in tests
    ci = (ROOT / ".ci" / "run").read_text().splitlines()
    assert tests in ci


def test_no_file_knows_a_machine():
    for path in tracked():
        if path != Path(__file__):
            found = MACHINE_PATHS.search(path.read_text(errors="ignore"))
            assert found is None, f"{path.relative_to(ROOT)}: {found}"


def test_readme_links_exist():
    for name in ("README.md", "models/README.md"):
        text = (ROOT / name).read_text()
        for target in re.findall(r"\]\(([^)#:]+)\)", text):
            assert ((ROOT / name).parent / target).exists(), target


def test_pictures_of_the_readme_are_small():
    pictures = list((ROOT / "docs").glob("*.png"))
    assert pictures and all(p.stat().st_size <= 600_000 for p in pictures)


def test_versions_agree():
    assert f"version: {walking_irl.__version__}" in (ROOT / "CITATION.cff").read_text()


@pytest.mark.slow
def test_wheel_in_a_fresh_environment_finds_its_models(tmp_path):
    build = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", tmp_path, ROOT]
    subprocess.run(build, check=True, capture_output=True, text=True)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    assert {f"walking_irl/_models/{m}" for m in MODELS} | {"walking_irl/py.typed"} <= names
    assert not [n for n in names if n.startswith(("tests/", "demos/", "models/"))]

    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / "bin" / "python"
    install = [python, "-m", "pip", "install", "-q", "--no-deps", "--no-index", wheel]
    subprocess.run(install, check=True, capture_output=True, text=True)
    # Its dependencies are those of these tests; the package itself comes from the wheel.
    packages = next(p for p in map(Path, sys.path) if (p / "numpy").is_dir())
    code = (
        f"import sys; sys.path.append({str(packages)!r})\n"
        "from pathlib import Path\n"
        "import walking_irl\n"
        "from walking_irl.domains.humanoid.gait.library import load_gaits\n"
        "from walking_irl.files import model_path\n"
        f"for name in {MODELS}: print(model_path(name))\n"
        "print(len(load_gaits('humanoid-planar')))\n"
    )
    done = subprocess.run(
        [python, "-I", "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    *paths, n_gaits = done.stdout.split()
    assert int(n_gaits) >= 7
    assert all(Path(p).is_relative_to(tmp_path / "venv") for p in paths)
