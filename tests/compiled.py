"""The kernels in C for tests, whether or not they were built when the package was installed."""

from __future__ import annotations

import atexit
import runpy
import shutil
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from types import ModuleType
from typing import Any
from unittest.mock import patch

import pytest

from robthermal import _recursion
from robthermal._library import library_name
from robthermal.diagnosis.path import _filter
from robthermal.identify import _compiled
from robthermal.thermal import _march

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
    return _with_library(_compiled)


@cache
def steps(lanes: int | None = None) -> _march.Steps:
    """The compiled steps of a simulation, from beside their source or compiled now, with vectors of so many numbers."""
    found = _march.library(_with_library(_march), lanes)
    if found is None:
        pytest.skip("no library of compiled steps for this compiler and processor")
    return found


@cache
def recursion(lanes: int | None = None) -> Callable[..., None]:
    """The compiled recursion, in the same way."""
    found = _recursion.compiled(_with_library(_recursion), lanes)
    if found is None:
        pytest.skip("no library of the recursion for this compiler and processor")
    return found


@cache
def filters(lanes: int | None = None) -> _filter.Compiled:
    """The compiled filter, in the same way."""
    found = _filter.compiled(_with_library(_filter), lanes)
    if found is None:
        pytest.skip("no library of the filter for this compiler and processor")
    return found


def name_of(kernel: ModuleType) -> str:
    """Name of the library of a kernel's source and headers."""
    return library_name(kernel.SOURCE, kernel.HEADERS)


def copied(kernel: ModuleType, tree: Path, old: str = "", new: str = "") -> Path:
    """The source of a kernel, its headers beside it, in another tree; with another text in it."""
    text = kernel.SOURCE.read_text(encoding="utf-8")
    assert not old or text.count(old) == 1
    source = tree / kernel.SOURCE.relative_to(ROOT)
    source.parent.mkdir(parents=True)
    source.write_text(text.replace(old, new) if old else text + new, encoding="utf-8")
    for header in kernel.HEADERS:
        shutil.copy(kernel.SOURCE.parent / header, source.parent / header)
    return source


def _with_library(kernel: ModuleType) -> Path:
    """The folder of a source where its library is, or a new one."""
    source, name = kernel.SOURCE, name_of(kernel)
    if source.with_name(name).exists():
        return Path(source.parent)
    if shutil.which("cc") is None:
        pytest.skip("no C compiler, and the package was installed without its compiled kernel")
    made = Path(mkdtemp())
    atexit.register(shutil.rmtree, made)
    hook()["build"](source, made / name)
    return made


def built_by_hook(root: Path, version: str, target: str = "wheel") -> dict[str, Any]:
    """What the hook asks hatchling for, in a copy of the source tree."""
    one = hook()["KernelHook"]()
    one.root, one.target_name = str(root), target
    data: dict[str, Any] = {"force_include": {}}
    one.initialize(version, data)
    one.finalize(version, data, "")
    return data
