"""Tasks on the processors of this process: numpy and the FFT release the interpreter while they compute."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache


def run_all(task: Callable[[int], None], items: Iterable[int], *, worth: bool) -> None:
    """`task` over `items`, beside this thread on others too if that is `worth` it and there are more processors.

    Whoever is free takes the next item. This thread works as well and waits for no other one to begin: a pool that is
    busy, or that did not survive a fork, costs speed and nothing else.
    """
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not worth or processors == 1:
        for item in items:
            task(item)
        return
    waiting = deque(items)

    def work() -> None:
        while waiting:
            try:
                item = waiting.popleft()
            except IndexError:  # another one was faster
                return
            task(item)

    others = [_pool(os.getpid(), processors).submit(work) for _ in range(min(processors, len(waiting)) - 1)]
    try:
        work()
    finally:
        waiting.clear()  # nothing more begins after an error
        begun = [other for other in others if not other.cancel()]
        errors = [other.exception() for other in begun]
    for error in errors:
        if error is not None:
            raise error


@cache
def _pool(process: int, processors: int) -> ThreadPoolExecutor:
    """Threads beside the one that asks, kept between calls; `process` tells a fork from its parent."""
    return ThreadPoolExecutor(max_workers=processors - 1, thread_name_prefix="robthermal")
