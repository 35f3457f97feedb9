"""Sphinx's settings; the pages of :mod:`generate` are written before anything is read.

Sphinx, because the docstrings are its markup already (``:math:``, ``:class:``) and its API pages
check every reference in them; furo and MyST, because pages are then plain Markdown; sphinx-gallery,
because a tutorial is a script that a test runs, too.

    python -m sphinx -W --keep-going -b html docs docs/_build
"""

import inspect
import os
import re
import sys
import warnings
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1])]

import generate  # noqa: E402

from walking_irl import __version__  # noqa: E402

generate.write_all()
warnings.filterwarnings("ignore", message=".*has been deprecated", module="sphinx_gallery")

project, author, release = "walking_irl", "The walking_irl developers", __version__
copyright = "the walking_irl developers"
extensions = [
    "myst_parser",
    "sphinx.ext.apidoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = [
    "_build",
    "tables",
    "studies.md",
    "faults.md",
    "tutorials/*.md",
    "tutorials/*.rst",
    "_generated/parts",
]
nitpicky = True
html_theme = "furo"
html_title = f"walking_irl {release}"
html_static_path: list[str] = []
html_theme_options = {"source_repository": "", "sidebar_hide_name": False}

myst_enable_extensions = ["dollarmath", "colon_fence", "attrs_block"]
myst_heading_anchors = 3

apidoc_modules = [
    {
        "path": "../walking_irl",
        "destination": "api",
        "exclude_patterns": ["../walking_irl/__main__.py"],
        "separate_modules": True,
        "module_first": True,
        "automodule_options": {"members", "show-inheritance"},
    }
]
autodoc_member_order = "bysource"
autodoc_default_options = {"ignore-module-all": True}  # a name is described where it is defined
autodoc_typehints = "signature"
autodoc_type_aliases = {name: name for name in ("Array", "Indices", "Forward", "Actions")}
autodoc_preserve_defaults = True
napoleon_google_docstring, napoleon_numpy_docstring = True, False
napoleon_use_ivar = True
suppress_warnings = ["ref.python"]  # a short name such as .Step may mean two; the nearest is taken
nitpick_ignore_regex = [
    ("py:(class|obj)", r".*\.(Motion|Trajectory)(_contra)?"),  # type variables
    ("py:(class|obj)", r"walking_irl\..*\._\w+"),  # private
    ("py:class", r"walking_irl\.geometry\.centres\.Centre"),  # described where it is defined
    ("py:class", "(?!walking_irl).*"),  # types of other packages and of the standard library
    ("py:(func|mod|meth|attr|data|exc|obj)", "(?!walking_irl).*"),
]

sphinx_gallery_conf = {
    "examples_dirs": "tutorials",
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "default_thumb_file": str(Path(__file__).parent / "walk.png"),
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "show_memory": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
    "abort_on_example_error": True,
    "remove_config_comments": True,
}


def _is_noise(app, what, name, obj, skip, options):
    """Functions of other packages, and fields of named tuples without a text of their own."""
    home = getattr(obj, "__module__", None) or "walking_irl"
    if what == "module" and inspect.isroutine(obj) and not home.startswith("walking_irl"):
        return True
    text = getattr(obj, "__doc__", None) or ""
    return True if re.match(r"Alias for field number \d+$", text) else None


def _bars(app, what, name, obj, options, lines):
    """Absolute values, ``|x|``, are no substitutions of reStructuredText."""
    in_maths = False
    for i, line in enumerate(lines):
        is_indented = line.startswith((" ", "\t"))
        in_maths = line.lstrip().startswith(".. math::") or (in_maths and (is_indented or not line))
        if not in_maths and not line.lstrip().startswith(("| ", "+-")):
            parts = line.split("`")
            lines[i] = "`".join([p.replace("|", r"\|") if k % 2 == 0 else p
                                 for k, p in enumerate(parts)])  # fmt: skip


def setup(app):
    """Connect what is above."""
    app.connect("autodoc-process-docstring", _bars)
    app.connect("autodoc-skip-member", _is_noise)
