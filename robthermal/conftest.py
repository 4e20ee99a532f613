"""Doctests run in an empty folder, so that examples may write files, and draw without a screen."""

import os
from pathlib import Path

import pytest

os.environ["MPLBACKEND"] = "Agg"  # read when matplotlib is first imported


@pytest.fixture(autouse=True)
def _empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
