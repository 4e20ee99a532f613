"""Tasks beside the calling thread: each item once, errors come back, nobody waits for a pool that is busy."""

from __future__ import annotations

import os
import threading
from collections import Counter
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from robthermal.identify import _threads
from robthermal.identify._threads import run_all


@pytest.fixture(params=[1, 2, 3], autouse=True)
def processors(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: set(range(request.param)), raising=False)
    return int(request.param)


@pytest.mark.parametrize("count", [0, 1, 2, 50])
def test_every_item_is_done_once_and_before_the_end(count: int) -> None:
    done = np.zeros(count, dtype=int)

    def task(item: int) -> None:
        done[item] += 1

    run_all(task, range(count), worth=True)
    np.testing.assert_array_equal(done, np.ones(count))


def test_the_calling_thread_works_too(processors: int) -> None:
    """It takes an item while all others are held until it has."""
    mine, seen = threading.get_ident(), Counter[int]()
    begun = threading.Event()

    def task(item: int) -> None:
        seen[threading.get_ident()] += 1
        if threading.get_ident() == mine:
            begun.set()
        assert begun.wait(10.0)

    run_all(task, range(20), worth=True)
    assert seen[mine] >= 1 and seen.total() == 20 and len(seen) <= processors


def test_a_task_may_have_tasks_of_its_own() -> None:
    """Also where more of them ask than there are threads."""
    done: list[tuple[int, int]] = []
    run_all(lambda a: run_all(lambda b: done.append((a, b)), range(5), worth=True), range(5), worth=True)
    assert sorted(done) == [(a, b) for a in range(5) for b in range(5)]


def test_a_pool_that_never_answers_costs_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a child after a fork, whose threads did not come along."""
    held, stop = ThreadPoolExecutor(1), threading.Event()
    held.submit(stop.wait, 30.0)
    monkeypatch.setattr(_threads, "_pool", lambda process, processors: held)
    done: list[int] = []
    run_all(done.append, range(7), worth=True)
    stop.set()
    held.shutdown()
    assert done == list(range(7))


def test_an_error_comes_back_and_ends_the_rest(processors: int) -> None:
    begun: list[int] = []

    def task(item: int) -> None:
        begun.append(item)
        raise KeyError("of the task")

    with pytest.raises(KeyError, match="of the task"):
        run_all(task, range(1000), worth=True)
    assert 1 <= len(begun) <= processors


def test_an_error_of_another_thread_comes_back(processors: int) -> None:
    """Of any but the calling one, which waits until it happened; alone it fails itself."""
    mine, failed = threading.get_ident(), threading.Event()

    def task(item: int) -> None:
        if threading.get_ident() == mine and processors > 1:
            assert failed.wait(10.0)
            return
        failed.set()
        raise KeyError("elsewhere")

    with pytest.raises(KeyError, match="elsewhere"):
        run_all(task, range(40), worth=True)
