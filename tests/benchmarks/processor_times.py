"""Plugin of pytest: processor seconds of every test, on a shared machine too.

PYTHONPATH=tests/benchmarks python -m pytest -p processor_times
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Generator
from typing import Any

import pytest

SHOWN = 20  # tests and files
_last = [0.0]  # processor time at the end of the phase before [s]
_tests: Counter[str] = Counter()


def spent() -> float:
    """Processor time of this process and of those that it waited for [s]."""
    return sum(os.times()[:4])


def pytest_runtest_logstart() -> None:
    _last[0] = spent()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, Any, Any]:
    """Set-up, call and tear-down have a report each; the attribute travels from the workers of xdist too."""
    report = yield
    now = spent()
    report.processor, _last[0] = now - _last[0], now
    return report


def pytest_runtest_logreport(report: Any) -> None:
    _tests[report.nodeid] += report.processor


def pytest_terminal_summary(terminalreporter: Any) -> None:
    files: Counter[str] = Counter()
    for name, seconds in _tests.items():
        files[name.partition("::")[0]] += seconds
    for title, times in (("tests", _tests), ("files", files)):
        terminalreporter.section(f"processor time [s], {times.total():.0f} in all: the slowest {title}")
        for name, seconds in times.most_common(SHOWN):
            terminalreporter.write_line(f"{seconds:8.2f}  {name}")
