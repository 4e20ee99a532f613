"""What was computed last: a descent asks for the same values several times, and goes on from the last ones."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

Value = TypeVar("Value")
_KEPT = 2


class Recent(Generic[Value]):
    """Values of a function of an array, for the last few arguments."""

    def __init__(self) -> None:
        self._values: dict[bytes, Value] = {}

    def __len__(self) -> int:
        return len(self._values)

    def of(self, at: NDArray[np.float64], compute: Callable[[], Value]) -> Value:
        """The value at an argument, computed if it is not kept.

        Parameters
        ----------
        at : ndarray
            Argument of the function.
        compute : callable
            Makes the value there.
        """
        key = at.tobytes()
        if key not in self._values:
            while len(self._values) >= _KEPT:
                del self._values[next(iter(self._values))]
            self._values[key] = compute()
        return self._values[key]

    def __iter__(self) -> Iterator[Value]:
        return iter(self._values.values())

    def keep_only(self, at: NDArray[np.float64]) -> None:
        """Forget the values at other arguments than this one.

        Parameters
        ----------
        at : ndarray
            Argument of the function.
        """
        key = at.tobytes()
        self._values = {key: self._values[key]} if key in self._values else {}
