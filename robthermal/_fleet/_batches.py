"""Cases in batches: a batch takes about half a second, whatever a case takes.

To hand out a task costs a cluster some 10 ms of processor time, so that many small cases travel together. How many is
measured on the way. A worker that has spent its time gives back what it did not reach: one slow case among quick ones
holds up nothing, and a crash costs half a second of each worker, or one case.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import count
from typing import Any

from ..errors import InputError
from ._store import Answer, Key

SPAN = 0.5  # time of a batch [s]
_MOST = 500  # cases in a batch


@dataclass(frozen=True)
class Batch:
    """What came back from a worker.

    Parameters
    ----------
    number : int
        Which batch it was.
    answers : list of Answer
        Of the cases that were done, the first ones of the batch.
    seconds : float
        Wall time per case [s].
    """

    number: int
    answers: list[Answer]
    seconds: float


class Batches:
    """Keys that wait, cut into numbered batches as they are asked for; joblib asks from a thread of its own.

    Only cases travel: Dask's scheduler remembers the last thousand messages to every worker.

    Parameters
    ----------
    keys : iterable
        Keys of the cases to do.
    workers : int
        How many batches are worked on at once.
    """

    def __init__(self, keys: Iterable[Key], workers: int):
        self._waiting, self._workers, self._size = deque(keys), workers, 1
        self._out: dict[int, list[Key]] = {}
        self._numbers = count()

    def __bool__(self) -> bool:
        return bool(self._waiting)

    def __iter__(self) -> Iterator[tuple[int, list[Key]]]:
        while self._waiting:
            fair = -(-len(self._waiting) // (2 * self._workers))  # towards the end all workers still have work
            keys = [self._waiting.popleft() for _ in range(min(self._size, fair))]
            number = next(self._numbers)
            self._out[number] = keys
            yield number, keys

    def back(self, batch: Batch) -> list[tuple[Key, Answer]]:
        """Keys with their answers. What was not reached waits again; the next size aims at the time of a batch.

        Parameters
        ----------
        batch : Batch
            The last one that came back.
        """
        keys, done = self._out.pop(batch.number), len(batch.answers)
        self._waiting.extend(keys[done:])
        wanted = int(SPAN / max(batch.seconds, SPAN / _MOST))
        self._size = max(1, min(wanted, 2 * self._size))
        return list(zip(keys[:done], batch.answers, strict=True))


def answer_batch(function: Callable[[Any], Any], number: int, cases: list[Any]) -> Batch:
    """Runs where the work is done, until the time of a batch is over; the first case is always done.

    Parameters
    ----------
    function : callable
        Of one case.
    number : int
        Number of the batch.
    cases : list
        What to call it with.
    """
    answers: list[Answer] = []
    start, spent = time.perf_counter(), 0.0
    for case in cases:
        if spent > SPAN:
            break
        answers.append(_answer(function, case))
        spent = time.perf_counter() - start
    return Batch(number, answers, spent / len(answers))


def _answer(function: Callable[[Any], Any], case: Any) -> Answer:
    """An exception travels home as text."""
    try:
        return Answer(function(case))
    except InputError as error:
        return Answer(None, {"what": error.what, "where": error.where, "expected": error.expected,
                             "remedy": error.remedy})
    except Exception as error:  # of whatever kind: the other cases go on
        return Answer(None, {"what": f"{type(error).__name__}: {error}"}, again=True)
