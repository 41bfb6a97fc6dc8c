"""Every notebook runs from top to bottom on the installed package."""

from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat", reason="notebooks need the extra 'test'")
nbclient = pytest.importorskip("nbclient", reason="notebooks need the extra 'test'")

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))
SLOW = {"paper"}
"""Half a minute each."""


def test_there_are_notebooks():
    assert {path.stem for path in NOTEBOOKS} > SLOW


@pytest.mark.parametrize(
    "path", [pytest.param(p, id=p.stem, marks=[pytest.mark.slow] * (p.stem in SLOW)) for p in NOTEBOOKS]
)
def test_notebook_runs_and_shows_something(path, tmp_path):
    notebook = nbformat.read(path, as_version=4)
    nbclient.NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(tmp_path)}}).execute()
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(cell.outputs for cell in code), "every cell shows what it found"
    assert not any(output.output_type == "error" for cell in code for output in cell.outputs)
