"""Every tutorial notebook runs from top to bottom, and is stored without outputs."""

from __future__ import annotations

import os
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

ROOT = Path(__file__).resolve().parents[1]
NOTEBOOKS = sorted((ROOT / "docs" / "tutorials").glob("*.ipynb"))
PATIENCE = 300  # a cell may take this long before it counts as hanging [s]


def read(path: Path) -> nbformat.NotebookNode:
    return nbformat.read(path, as_version=nbformat.NO_CONVERT)


def by_name(path: Path) -> str:
    return path.stem


def test_the_tutorials_are_found_and_listed() -> None:
    index = (ROOT / "docs" / "tutorials" / "index.md").read_text(encoding="utf-8")
    known = {"bar", "closed_loop", "current_limit", "observer", "quick_start", "transients", "two_hours"}
    assert {path.stem for path in NOTEBOOKS} >= known
    assert [path.stem for path in NOTEBOOKS if f"\n{path.stem}\n" not in index] == []


@pytest.mark.parametrize("path", NOTEBOOKS, ids=by_name)
def test_stored_without_outputs_for_any_python(path: Path) -> None:
    notebook = read(path)
    nbformat.validate(notebook)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(cell.outputs == [] and cell.execution_count is None for cell in code)
    assert notebook.metadata.kernelspec.name == "python3"
    assert notebook.cells[0].cell_type == "markdown" and notebook.cells[0].source.startswith("# ")
    assert any(line.startswith("assert ") for cell in code for line in cell.source.splitlines())


@pytest.mark.parametrize("path", NOTEBOOKS, ids=by_name)
def test_runs_and_its_assertions_hold(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # The kernel is a process of its own: it must find this checkout, and draw into the notebook.
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")])))
    monkeypatch.setenv("MPLBACKEND", "module://matplotlib_inline.backend_inline")
    # python3 is the kernel of the running interpreter, whatever the notebook was last edited with.
    here = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(read(path), kernel_name="python3", timeout=PATIENCE, resources=here).execute()
    assert not list(tmp_path.iterdir()), "a tutorial leaves no files behind"
