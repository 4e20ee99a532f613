"""Shared by the benchmarks: run a few times, keep the best, print one table row."""

from __future__ import annotations

import gc
import os
import platform
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

Result = TypeVar("Result")


def best_of(run: Callable[[], Result], *, repeats: int = 3) -> tuple[float, Result]:
    """Shortest wall time [s] of `repeats` runs, and the last result: the minimum is the code, the rest the machine."""
    times = []
    for _ in range(repeats):
        gc.collect()
        start = time.perf_counter()
        result = run()
        times.append(time.perf_counter() - start)
    return min(times), result


def processor() -> str:
    """Name of the processor, its family and model, how many of its cores this machine has, and its kind."""
    try:
        lines = (line.partition(":") for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines())
        found = {key.strip(): value.strip() for key, _, value in lines}
        name = f"{found['model name']} (family {found['cpu family']}, model {found['model']})"
    except (OSError, KeyError):
        name = platform.processor() or "unnamed processor"
    return f"{name}, {os.cpu_count()} cores, {platform.machine()}"


def header(title: str) -> None:
    """Print a title and the machine the rows below belong to."""
    threads = os.environ.get("OMP_NUM_THREADS", "not set")
    print(f"\n{title}\n{'-' * len(title)}")
    print(f"Python {platform.python_version()}, {processor()}, OMP_NUM_THREADS {threads}")


def row(what: str, seconds: float, note: str = "") -> None:
    """Print one measured time [s] and what it is compared with."""
    print(f"{what:<52} {seconds:>10.3f} s   {note}".rstrip(), flush=True)
