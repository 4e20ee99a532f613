"""Shared by all tests: drawing without a screen, commands in this process, measured data beside the checkout."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path

import pytest

from robthermal import cli

os.environ["MPLBACKEND"] = "Agg"  # read when matplotlib is first imported; most tests never do

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "benchmarks")]  # what several packages or scripts share

from commands import Run, Said  # noqa: E402


@pytest.fixture(autouse=True)
def _close_figures() -> Iterator[None]:
    yield
    pyplot = sys.modules.get("matplotlib.pyplot")
    if pyplot is not None:
        pyplot.close("all")


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """The command line in this process: an exception that would be a traceback fails the test."""
    monkeypatch.setattr("robthermal.cli._progress.EVERY", 3600.0)  # s: on a slow machine too, nothing but what was said

    def call(*words: object) -> Said:
        monkeypatch.setattr(sys, "argv", ["robthermal", *map(str, words)])
        capsys.readouterr()
        with warnings.catch_warnings(), pytest.raises(SystemExit) as stop:  # main() shows warnings its own way
            cli.main()
        said = capsys.readouterr()
        code = stop.value.code
        return Said(code if isinstance(code, int) else int(code is not None), said.out, said.err)

    return call


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
