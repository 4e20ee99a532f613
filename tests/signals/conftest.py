"""Shared by the tests of signals: a system to read for, and a writer of small files."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest


@dataclass
class Plant:
    """What the reader asks of a system, without the system."""

    temperature_unit: str = "degC"
    input_names: tuple[str, ...] = ("heater",)
    module_names: tuple[str, ...] = ("m1",)
    ambient_names: tuple[str, ...] = ("room", "water")
    sensor_names: tuple[str, ...] = ("T6", "T1")
    current_limits: dict[str, tuple[float, float] | None] = field(default_factory=lambda: {"m1": (-3.3, 3.3)})
    input_limits: dict[str, tuple[float, float] | None] = field(default_factory=lambda: {"heater": (0.0, 10.0)})


@pytest.fixture
def plant() -> Plant:
    return Plant()


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    def writer(content: str | bytes, name: str = "run.csv") -> Path:
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return writer


@pytest.fixture
def quiet() -> Iterator[None]:
    """No warning is expected: one that comes is a failure."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield
