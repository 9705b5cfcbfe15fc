"""The notebooks run from the first cell to the last, and say what they say they say."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from tests.places import ROOT

FOLDER = ROOT / "docs" / "notebooks"
SAID = {
    "own-mocap-csv": ("FIDIM (total least squares), full poses", "com_z_m", "report.html"),
    "closing-the-loop-by-hand": ("drag 0.06", "with drag       off by 0.1"),
}


def texts(cells: list[dict[str, Any]]) -> str:
    """All that the cells' outputs say in plain text."""
    said = []
    for cell in cells:
        for output in cell.get("outputs", ()):
            plain = output.get("text", output.get("data", {}).get("text/plain", ""))
            said.append("".join(plain))
    return "\n".join(said)


def errors(cells: list[dict[str, Any]]) -> list[str]:
    return [
        output["ename"]
        for cell in cells
        for output in cell.get("outputs", ())
        if output["output_type"] == "error"
    ]


def test_these_are_all() -> None:
    assert {path.stem for path in FOLDER.glob("*.ipynb")} == set(SAID)


@pytest.mark.parametrize("name", SAID)
def test_what_is_kept_was_executed_without_an_error(name: str) -> None:
    cells = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in code] == list(range(1, len(code) + 1))
    assert errors(code) == []
    said = texts(code)
    assert [word for word in SAID[name] if word not in said] == []
    assert any("image/png" in o.get("data", {}) for c in code for o in c["outputs"])


@pytest.mark.slow
@pytest.mark.parametrize("name", SAID)
def test_it_runs(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    nbformat = pytest.importorskip("nbformat", reason="the extra `docs` is not installed")
    client = pytest.importorskip("nbclient")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))
    book = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
    for cell in book.cells:
        cell.pop("outputs", None) if cell.cell_type != "code" else cell.update(outputs=[])
    place = {"metadata": {"path": str(FOLDER)}}
    client.NotebookClient(book, timeout=300, kernel_name="python3", resources=place).execute()
    assert errors(book.cells) == []
    said = texts(book.cells)
    assert [word for word in SAID[name] if word not in said] == [], said
