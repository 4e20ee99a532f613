"""Every tutorial notebook runs from top to bottom, draws figures that can be read, and is stored without outputs."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

ROOT = Path(__file__).resolve().parents[1]
NOTEBOOKS = sorted((ROOT / "docs" / "tutorials").glob("*.ipynb"))
LONG = {"bar", "case_studies", "certify_in_ci", "convection", "current_limit", "missing_plate", "observer",
        "scanner", "scheduled_current", "thermomechanical", "two_hours"}  # tests do the same
PATIENCE = 300  # a cell may take this long before it counts as hanging [s]

LOOK = "__import__('figures').look_at_open_figures(described={!r})"  # leaves no name behind


def read(path: Path) -> nbformat.NotebookNode:
    return nbformat.read(path, as_version=nbformat.NO_CONVERT)


def described(cell: nbformat.NotebookNode) -> bool:
    """Whether the figures of a cell have an alternative text for those who do not see them."""
    return len(cell.metadata.get("mystnb", {}).get("image", {}).get("alt", "")) > 40


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


@pytest.fixture(scope="module")
def kernel() -> Iterator[NotebookClient]:
    """One process for all notebooks, so that what they import is loaded once."""
    with pytest.MonkeyPatch.context() as patch:
        # The kernel is a process of its own: it must find this checkout, and keep what it draws until it was looked at.
        places = [str(ROOT), str(ROOT / "tests"), os.environ.get("PYTHONPATH")]
        patch.setenv("PYTHONPATH", os.pathsep.join(filter(None, places)))
        patch.setenv("MPLBACKEND", "agg")
        # python3 is the kernel of the running interpreter, whatever the notebook was last edited with.
        client = NotebookClient(nbformat.v4.new_notebook(), kernel_name="python3", timeout=PATIENCE)
        with client.setup_kernel():
            yield client


@pytest.mark.parametrize("path", [pytest.param(path, marks=[pytest.mark.exhaustive] * (path.stem in LONG))
                                  for path in NOTEBOOKS], ids=by_name)
def test_runs_and_its_assertions_hold(path: Path, kernel: NotebookClient, tmp_path: Path) -> None:
    afresh = f"%reset -f\nimport os\nos.chdir({str(tmp_path)!r})\ndel os"  # no name of an earlier notebook is left
    kernel.nb = read(path)
    kernel.nb.cells.insert(0, nbformat.v4.new_code_cell(afresh))
    kernel.reset_execution_trackers()
    for index, cell in enumerate(kernel.nb.cells):
        kernel.execute_cell(cell, index)  # raises what the cell raises
        if index and cell.cell_type == "code":
            kernel.execute_cell(nbformat.v4.new_code_cell(LOOK.format(described(cell))), index)
    assert not list(tmp_path.iterdir()), "a tutorial leaves no files behind"
    printed = [one.text for cell in kernel.nb.cells for one in cell.get("outputs", ()) if one.get("name") == "stderr"]
    assert printed == [], "a warning stands on the page"
