"""The kernel in C for tests, whether or not it was built when the package was installed."""

from __future__ import annotations

import atexit
import runpy
import shutil
import sys
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from types import ModuleType
from typing import Any
from unittest.mock import patch

import pytest

from robthermal.identify import _compiled

ROOT = Path(__file__).resolve().parents[1]


def hook() -> dict[str, Any]:
    """What hatch_build.py defines; its base class is in an environment of the build only."""
    interface = ModuleType("interface")
    interface.BuildHookInterface = object  # type: ignore[attr-defined]
    with patch.dict(sys.modules, {"hatchling.builders.hooks.plugin.interface": interface}):
        return runpy.run_path(str(ROOT / "hatch_build.py"))


@cache
def built(lanes: int | None = None) -> _compiled.Solver:
    """What the library beside its source solves with, or one that is compiled now; so many windows at a time."""
    found = _compiled.library(folder(), lanes)
    if found is None:
        pytest.skip(f"no library of {lanes or 'any'} windows at a time for this compiler and processor")
    return found


@cache
def folder() -> Path:
    """Where the library is."""
    name = _compiled.library_name(_compiled.source_text())
    if _compiled.SOURCE.with_name(name).exists():
        return _compiled.SOURCE.parent
    if shutil.which("cc") is None:
        pytest.skip("no C compiler, and the package was installed without its compiled kernel")
    made = Path(mkdtemp())
    atexit.register(shutil.rmtree, made)
    hook()["build"](_compiled.SOURCE, made / name)
    return made
