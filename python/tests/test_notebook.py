"""The lecture in a notebook runs, and draws what it says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


@pytest.mark.filterwarnings("ignore")
def test_the_lecture() -> None:
    read: Any = nbformat.read
    notebook = read(EXAMPLES / "lecture.ipynb", as_version=4)
    # The figures are made anew by whoever runs it.
    assert not any(cell.get("outputs") for cell in notebook.cells)
    NotebookClient(notebook, timeout=60, resources={"metadata": {"path": str(EXAMPLES)}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    figures = [output for output in outputs if "image/png" in output.get("data", {})]
    text = "".join(output.get("text", "") for output in outputs if output["output_type"] == "stream")
    assert len(figures) >= 11
    assert not [output for output in outputs if output.get("name") == "stderr"], text
    (line,) = [line for line in text.splitlines() if line.startswith("weights sum to ")]
    assert abs(float(line.rsplit(" ", 1)[1]) - 1.0) < 1e-6
    (line,) = [line for line in text.splitlines() if line.startswith("largest difference from the image:")]
    assert float(line.rsplit(" ", 1)[1]) < 1e-3
