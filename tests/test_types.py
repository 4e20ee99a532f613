"""Types of the package and of the second checker, by mypy: the longest step that needs one core only."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize("arguments", [[], ["--config-file", "recheck/pyproject.toml", "recheck/recheck"]],
                         ids=["robthermal", "recheck"])
def test_mypy_finds_nothing(arguments: list[str]) -> None:
    found = subprocess.run([sys.executable, "-m", "mypy", *arguments], cwd=ROOT, capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr
