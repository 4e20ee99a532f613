"""The kernel in C for tests, whether or not it was built when the package was installed."""

from __future__ import annotations

import ctypes
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
def built() -> ctypes.CDLL:
    """The library beside its source, or one that is compiled now."""
    found = _compiled.library()
    if found is not None:
        return found
    if shutil.which("cc") is None:
        pytest.skip("no C compiler, and the package was installed without its compiled kernel")
    folder = Path(mkdtemp())
    hook()["build"](_compiled.SOURCE, folder / _compiled.library_name(_compiled.SOURCE.read_bytes()))
    found = _compiled.library(folder)
    shutil.rmtree(folder)  # it stays loaded
    if found is None:
        pytest.skip("this processor has no AVX2")
    return found
