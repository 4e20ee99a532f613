"""Tasks on the processors of this process: numpy and the FFT release the interpreter while they compute."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor


def run_all(task: Callable[[int], None], items: Iterable[int], *, worth: bool) -> None:
    """`task` over `items`, on threads if that is `worth` the start of a pool and there is more than one processor."""
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not worth or processors == 1:
        for item in items:
            task(item)
        return
    with ThreadPoolExecutor(max_workers=processors) as pool:
        list(pool.map(task, items))
