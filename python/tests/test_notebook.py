"""The lecture in a notebook runs, and draws what it says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


SHOWS_PROGRESS = """
import pathspace as ps
image = ps.load("../../scenes/cornell-spheres.glb").render(integrator="bdpt", width=64, time="3s", progress=True)
"""


@pytest.mark.filterwarnings("ignore")
def test_a_render_is_seen_as_it_comes() -> None:
    """In a notebook, progress=True shows a bar, and the image about each second until the call returns it."""
    made: Any = nbformat.v4
    notebook = made.new_notebook(cells=[made.new_code_cell(SHOWS_PROGRESS)])
    seen = []

    class Client(NotebookClient):
        def process_message(self, message: Any, *more: Any) -> Any:
            if message["header"]["msg_type"] in ("display_data", "update_display_data"):
                seen.append(message["content"]["data"])
            return super().process_message(message, *more)

    Client(notebook, timeout=60, resources={"metadata": {"path": str(EXAMPLES)}}).execute()
    pictures = {data["image/png"] for data in seen if "image/png" in data}
    bars = [data["text/html"] for data in seen if "text/html" in data]
    assert len(pictures) >= 2, "the image has changed"
    assert "<progress" in bars[0] and 'value="1.0000"' in bars[-1] and " spp" in bars[-1]
    shown = [output["data"] for output in notebook.cells[0].outputs]
    assert len(shown) == 2 and not any("image/png" in data for data in shown), "and is gone at the end"


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
