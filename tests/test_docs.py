"""The documentation: what its pages show runs, and the site builds without a warning."""

import importlib.util
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(p for p in DOCS.rglob("*.md") if not {"_build", "_generated", "api"} & set(p.parts))
FENCE = re.compile(r"^```(\S*)[ ]*\n(.*?)^```[ ]*$", re.M | re.S)
NOT_RUN = {"", "text", "{image}", "{include}", "{toctree}", "{literalinclude}", "{eval-rst}"}
"""Kinds of blocks that hold no commands and no code of their own."""


def blocks(kind):
    """Blocks of one kind, each named by its page and its number on it."""
    return [
        pytest.param(code, id=f"{page.relative_to(DOCS)}-{i}")
        for page in PAGES
        for i, (found, code) in enumerate(FENCE.findall(page.read_text()))
        if found == kind
    ]


def test_every_block_of_the_pages_is_of_a_kind_that_is_tested_or_included():
    kinds = {kind for page in PAGES for kind, _ in FENCE.findall(page.read_text())}
    assert kinds - NOT_RUN == {"python", "console"}


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(DOCS)))
def test_a_displayed_formula_is_a_paragraph_of_its_own(page):
    """Within a paragraph MyST takes its dollars for those of two inline formulas."""
    lines = ["", *page.read_text().splitlines(), ""]
    for i, line in enumerate(lines):
        if line.strip().startswith("$$") and line.strip().endswith("$$") and len(line.strip()) > 2:
            assert not lines[i - 1].strip() and not lines[i + 1].strip(), line


@pytest.mark.parametrize("code", blocks("python"))
def test_a_code_block_of_the_pages_runs(code, tmp_path, monkeypatch):
    for name in ("gymnasium", "mo_gymnasium"):
        if f"import {name}\n" in code:
            pytest.importorskip(name, reason="needs the extra [gym]")
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "block", "exec"), {"__name__": "block"})


@pytest.mark.parametrize("text", blocks("console"))
def test_a_command_of_the_pages_is_one(text):
    from walking_irl.cli.main import build_parser

    lines = [line[2:] for line in text.splitlines() if line.startswith("$ ")]
    assert lines, "commands begin with a dollar sign"
    for line in lines:
        words = shlex.split(line, comments=True)
        if words[0] == "walking-irl":
            build_parser().parse_args(words[1:])


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted(DOCS.glob("tutorials/*.py")), ids=lambda p: p.stem)
def test_a_tutorial_runs(path, tmp_path):
    """The site's builder runs them, too; here they run where it is not installed."""
    if "matplotlib" in path.read_text():
        pytest.importorskip("matplotlib", reason="this tutorial draws: needs the extra [docs]")
    env = {**os.environ, "PYTHONPATH": str(ROOT), "MPLBACKEND": "agg"}
    done = subprocess.run(
        [sys.executable, path], cwd=tmp_path, env=env, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
@pytest.mark.skipif(
    importlib.util.find_spec("sphinx_gallery") is None,
    reason="the documentation's builder is not installed: needs the extra [docs]",
)
def test_the_site_builds_strictly_with_the_command_of_contributing(tmp_path):
    (command,) = re.findall(
        r"^\S+(?: -m sphinx .*) docs docs/_build$", (ROOT / "CONTRIBUTING.md").read_text(), re.M
    )
    words = [sys.executable, *shlex.split(command)[1:-1], str(tmp_path / "site")]
    assert "-W" in words
    done = subprocess.run(
        words, cwd=ROOT, capture_output=True, text=True, timeout=1800,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    site = tmp_path / "site"
    for page in (
        "index",
        "gallery/own_problem",
        "api/walking_irl.cpirl.loop",
        "_generated/commands",
    ):
        assert (site / f"{page}.html").stat().st_size > 1000, page
