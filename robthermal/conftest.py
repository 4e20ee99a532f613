"""Doctests run in an empty folder, so that examples may write files, and draw without a screen."""

import os
from pathlib import Path

import pytest

# Loaded as Python loads them: pytest, which imports file by file, would set the submodules `effects`, `diagnose`,
# `explain` and `app` in the place of what is called so.
import robthermal.cli
import robthermal.diagnosis
import robthermal.jobs
import robthermal.thermal  # noqa: F401

os.environ["MPLBACKEND"] = "Agg"  # read when matplotlib is first imported


@pytest.fixture(autouse=True)
def _empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
