"""Every notebook holds what it shows, and runs from top to bottom on the installed package."""

import os
import re
from pathlib import Path

import pytest
from pages import shown_lines_are_printed

nbformat = pytest.importorskip("nbformat", reason="notebooks need the extra 'test'")
nbclient = pytest.importorskip("nbclient", reason="notebooks need the extra 'test'")

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))
DATA = "THERMAL_ROBOT_DATA"


def test_there_are_notebooks():
    assert {path.stem for path in NOTEBOOKS} > {"first_diagnosis", "motion"}


def said(cell):
    """What a cell prints, and the plain text of what it shows."""
    return "\n".join(out.get("text") or out.get("data", {}).get("text/plain", "") for out in cell.outputs)


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs_and_shows_what_is_stored(path, tmp_path):
    if DATA in path.read_text(encoding="utf-8") and not os.environ.get(DATA):
        pytest.skip(f"{DATA} is not set: it names the folder of the public campaigns")
    notebook, folder = nbformat.read(path, as_version=4), tmp_path / path.stem
    folder.mkdir()
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    stored = [said(cell) for cell in code]
    nbclient.NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(folder)}}).execute()
    for cell, shown in zip(code, stored, strict=True):
        shown_lines_are_printed(shown, said(cell))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_what_it_shows_is_stored(path):
    text = path.read_text(encoding="utf-8")
    code = [cell for cell in nbformat.reads(text, as_version=4).cells if cell.cell_type == "code"]
    assert all(cell.outputs for cell in code)
    assert not any(output.output_type == "error" for cell in code for output in cell.outputs)
    assert not re.search(r"/(home|work|root|tmp|Users)/", text), "a path of the machine it ran on"
