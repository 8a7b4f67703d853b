"""The notebooks run from top to bottom, each in a kernel of its own, and their assertions hold."""

import re

import pytest

from conftest import ROOT

NOTEBOOKS = sorted((ROOT / "examples" / "notebooks").glob("*.ipynb"))


def test_there_are_six():
    assert len(NOTEBOOKS) == 6


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook(path):
    nbformat = pytest.importorskip("nbformat")
    client = pytest.importorskip("nbclient")
    pytest.importorskip("pandas")
    notebook = nbformat.read(path, as_version=4)
    stored = [outputs(cell) for cell in notebook.cells if cell.cell_type == "code"]
    client.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(path.parent)}}).execute()
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert sum(cell.source.count("assert ") for cell in cells) >= 4
    # What it shows is what is stored, up to the digits that differ between machines.
    for cell, before in zip(cells, stored):
        assert outputs(cell) == before, f"{path.name}: the stored output of this cell is old:\n{cell.source}"


def outputs(cell):
    """The texts that a cell shows, and whether it shows HTML; numbers are rounded."""
    found = []
    for output in cell.get("outputs", []):
        text = output.get("text") or output.get("data", {}).get("text/plain", "")
        text = re.sub(r"0x[0-9a-f]+", "", text)
        rounded = re.sub(r"-?\d+\.\d+(?:e[-+]?\d+)?", lambda one: f"{float(one.group()):.3g}", text)
        found.append((rounded, "text/html" in output.get("data", {})))
    return found
