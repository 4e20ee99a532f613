"""Checks of plain arguments, one message each."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ._modules import Array


def numbers(value: Any, argument: str) -> NDArray[np.float64]:
    """An array of finite numbers."""
    try:
        array = np.asarray(value, float)
    except (TypeError, ValueError):
        array = np.array(np.nan)
    if not np.isfinite(array).all():
        raise InputError(f"{argument} = {value!r}", where=f"argument {argument}", expected="finite numbers")
    return array


def per_module(value: Any, count: int, argument: str, unit: str) -> NDArray[np.float64]:
    """One finite number per module, or one for all."""
    array = numbers(value, argument)
    if array.shape not in ((), (count,)):
        raise InputError(f"{argument} has shape {array.shape}", where=f"argument {argument}",
                         expected=f"one number [{unit}], or {count}, one per module")
    return np.broadcast_to(array, (count,)).copy()


def non_negative(values: Array, argument: str) -> None:
    """Finite numbers, zero or above."""
    if not (np.isfinite(values).all() and values.min(initial=0.0) >= 0):
        raise InputError(f"{argument} has the value {values.min():g}", where=f"argument {argument}",
                         expected="finite numbers, 0 or more",
                         remedy="Gains are positive: more heat v makes the cold lump warmer.")


def expect(value: Any, kind: type, argument: str, maker: str) -> None:
    """Refuse an argument of another type, naming the function that makes the right one."""
    if not isinstance(value, kind):
        raise InputError(f"{argument} is a {type(value).__name__}", where=f"argument {argument}",
                         expected=f"a {kind.__name__}", remedy=f"Make one with {maker}.")
