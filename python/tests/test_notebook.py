"""The notebook runs from its first cell to its last, and shows what it says."""

import pathlib

import pytest

FILE = pathlib.Path(__file__).resolve().parents[1] / "preonzo.ipynb"


def test_the_notebook_runs():
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    notebook = nbformat.read(FILE, as_version=4)
    pytest.importorskip("matplotlib")
    client = nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": FILE.parent}})
    client.execute()
    printed = [
        output["text"]
        for cell in notebook.cells
        for output in cell.get("outputs", [])
        if output["output_type"] == "stream"
    ]
    assert any("first red: 2012-04-27" in text for text in printed), printed
    pictures = [
        output
        for cell in notebook.cells
        for output in cell.get("outputs", [])
        if "image/png" in output.get("data", {})
    ]
    assert len(pictures) == 1
