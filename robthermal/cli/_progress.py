"""What is being done, on standard error: a bar on a terminal, elsewhere a plain line now and then."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.progress import TimeRemainingColumn as Remaining

EVERY = 10.0  # s between plain lines; work that is done before that says nothing


class Told(Protocol):
    """Called with a sentence before every piece of work, and with how much is done where that is known."""

    def __call__(self, what: str, done: int | None = None, total: int | None = None) -> None: ...


@contextmanager
def progress() -> Iterator[Told]:
    """Percentage and remaining time on a terminal; elsewhere a plain line every 10 s. Standard output is untouched.

    Yields
    ------
    Told
        ``told("simulating")``, or ``told("certify", 3, 6)`` where three of six stages are done; a later sentence alone
        leaves the count as it is.
    """
    # isatty: FORCE_COLOR makes rich take a pipe for a terminal.
    with _interrupts() as interrupted, _bar() if sys.stderr.isatty() else _lines(EVERY) as told:

        def say(what: str, done: int | None = None, total: int | None = None) -> None:
            if interrupted.is_set():
                raise KeyboardInterrupt
            told(what, done, total)

        yield say


@contextmanager
def _interrupts() -> Iterator[threading.Event]:
    """Remember Ctrl-C: Python loses the exception where it strikes inside a callback, of an import or a finalizer."""
    seen = threading.Event()

    def remember(*args: object) -> None:
        seen.set()
        raise KeyboardInterrupt

    ours = threading.current_thread() is threading.main_thread()
    if not ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield seen
        return
    signal.signal(signal.SIGINT, remember)
    try:
        yield seen
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """The same for work that is counted: called with how many pieces are done, and of how many."""
    with progress() as told:
        told(what)
        yield lambda done, total: told(what, done, total)


@contextmanager
def _bar() -> Iterator[Told]:
    columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), BarColumn(),
               TaskProgressColumn(show_speed=False), TimeElapsedColumn(), Remaining())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("starting", total=None)

        def told(what: str, done: int | None = None, total: int | None = None) -> None:
            bar.update(task, description=what, completed=done, total=total)

        yield told


@contextmanager
def _lines(every: float) -> Iterator[Told]:
    state = _State("starting")
    finished = threading.Event()

    def watch() -> None:
        while not finished.wait(every):
            typer.echo(f"robthermal: {state}", err=True)

    # Work in compiled code says nothing for minutes: another thread looks at the clock.
    watcher = threading.Thread(target=watch, name="progress", daemon=True)
    watcher.start()
    try:
        yield state.told
    finally:
        finished.set()
        watcher.join(timeout=1.0)


class _State:
    """What is being done since when, in one line."""

    def __init__(self, what: str):
        self._what, self._done, self._total = what, 0, 0
        self._start = time.monotonic()

    def told(self, what: str, done: int | None = None, total: int | None = None) -> None:
        self._what = what
        if done is not None and total is not None:  # else what was counted before still stands
            self._done, self._total = done, total

    def __str__(self) -> str:
        elapsed = time.monotonic() - self._start
        if not self._total:
            return f"{self._what}, {duration(elapsed)} so far"
        line = f"{self._what}: {self._done} of {self._total} ({100 * self._done // self._total} %), "
        line += f"{duration(elapsed)} so far"
        left = elapsed * (self._total - self._done) / self._done if self._done else None
        return line if left is None else f"{line}, about {duration(left)} left"


def duration(seconds: float) -> str:
    """A time span in words: ``42 s``, ``3 min 20 s``, ``2 h 5 min``."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
