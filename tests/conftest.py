"""Shared by all tests: drawing without a screen, commands in this process, measured data beside the checkout."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

os.environ["MPLBACKEND"] = "Agg"  # read when matplotlib is first imported; most tests never do

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "benchmarks")]  # what several packages or scripts share

from commands import Run, command  # noqa: E402


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
