"""Shared by all tests: drawing without a screen, commands in this process, measured data beside the checkout."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import robthermal as rt

os.environ["MPLBACKEND"] = "Agg"  # read when matplotlib is first imported; most tests never do

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "benchmarks")]  # what several packages or scripts share

from commands import Run, command  # noqa: E402

DRAW = vars(rt.report.Figure)["draw"]
LONGEST = ("test_types.py", "test_notebooks.py", "test_docs.py", "test_cli.py", "test_design_commands.py",
           "test_results.py", "test_bounded_work.py", "test_changes_finer_truth.py", "test_finer_network.py")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files that take longest come first, so that two processes end at the same time."""
    items.sort(key=lambda item: item.path.name not in LONGEST)


@pytest.fixture(autouse=True)
def _close_figures() -> Iterator[None]:
    yield
    pyplot = sys.modules.get("matplotlib.pyplot")
    if pyplot is not None:
        pyplot.close("all")


@pytest.fixture(scope="session")
def run() -> Run:
    """The command line in this process: an exception that would be a traceback fails the test."""
    return command


@pytest.fixture(scope="module")
def sketched() -> Iterator[None]:
    """Figures of reports are made, but a frame stands for each in the page: for tests of a report's other contents.

    Turning a drawing into SVG takes most of the time of a small report. The same figures are turned into it where
    figures are tested: the demo, one run of every command, and tests/report.
    """
    def frame(cls: type[rt.report.Figure], figure: Any, *, alt: str, caption: str) -> rt.report.Figure:
        return cls('<svg viewBox="0 0 1 1"></svg>', alt, caption)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rt.report.Figure, "draw", classmethod(frame))
        yield


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are turned into SVG, in a test of a file whose figures are `sketched`."""
    monkeypatch.setattr(rt.report.Figure, "draw", DRAW)


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder of measured data and reference systems beside the checkout; tests that need it are skipped without it."""
    folder = ROOT.parent / "shared"
    if not folder.is_dir():
        pytest.skip("no folder 'shared' beside the checkout: measured data and reference systems are kept there")
    return folder


@pytest.fixture(scope="session")
def tclab(shared: Path) -> Path:
    """Folder of measured data of Temperature Control Lab boards."""
    folder = shared / "data"
    if not (folder / "tclab_dowling").is_dir() or not (folder / "tclab_saopaulo").is_dir():
        pytest.skip("no measured data of the Temperature Control Lab boards in the folder 'shared'")
    return folder
