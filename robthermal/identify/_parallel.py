"""Work on all processors: threads where numpy computes for long without the interpreter, else processes."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from joblib import Parallel, delayed

Result = TypeVar("Result")


def processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_all(task: Callable[[int], None], items: Iterable[int], *, worth: bool) -> None:
    """`task` over `items`, on threads if that is `worth` the start of a pool and there is more than one processor."""
    count = processors()
    if not worth or count == 1:
        for item in items:
            task(item)
        return
    with ThreadPoolExecutor(max_workers=count) as pool:
        list(pool.map(task, items))


def in_processes(task: Callable[..., Result], calls: Sequence[Callable[[], tuple[Any, ...]]]) -> Iterator[Result]:
    """Results of `task` in the order of the calls, whose arguments are made only when a process is about to take them.

    Starting the processes takes a second or two, once; a parallel backend that the user has chosen with
    `joblib.parallel_config` (threads, a cluster) is respected.
    """
    pool = Parallel(n_jobs=processors(), return_as="generator", pre_dispatch="2*n_jobs", batch_size=1, max_nbytes=None)
    return iter(pool(delayed(task)(*arguments()) for arguments in calls))
