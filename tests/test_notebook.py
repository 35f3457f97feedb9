"""The notebook runs from its first cell to its last, inside Jupyter's own kernel and loop."""

import os
from pathlib import Path

import pytest

NOTEBOOK = Path(__file__).parents[1] / "demos" / "walking.ipynb"


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # of Jupyter's own packages
def test_the_notebook_runs_and_shows_live_progress(tmp_path, monkeypatch):
    reason = "running notebooks needs the extra [notebook]"
    nbformat = pytest.importorskip("nbformat", reason=reason)
    nbclient = pytest.importorskip("nbclient", reason=reason)
    pytest.importorskip("ipykernel", reason=reason)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(NOTEBOOK.parents[1])]))
    book = nbformat.read(NOTEBOOK, as_version=4)
    assert not any(cell.get("outputs") for cell in book.cells), "it is kept without outputs"
    resources = {"metadata": {"path": tmp_path}}
    nbclient.NotebookClient(book, timeout=600, resources=resources).execute()
    outputs = [out for cell in book.cells for out in cell.get("outputs", ())]
    shown = {kind for out in outputs for kind in out.get("data", {})}
    assert {"image/svg+xml", "image/png"} <= shown
    text = "".join(out.get("text", "") for out in outputs)
    assert "ground truth" in text and "lqr.rrd" in text
    assert not list(tmp_path.iterdir()), "it leaves no files"
