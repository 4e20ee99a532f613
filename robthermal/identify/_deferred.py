"""Arrays over the bins that may be computed on first use, and their parts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .._arrays import Array

Deferred = Callable[[slice], Array]  # the values of the bins in a slice, computed when they are asked for


def fixed(values: Any, kind: Any) -> Array:
    """Read-only view: a result is not edited after the fact."""
    array = np.asarray(values, dtype=kind).view()
    array.flags.writeable = False
    return array


def narrow(values: Any, part: slice) -> Any:
    """The bins of `part` of an array, or of a deferred computation."""
    if values is None:
        return None
    if not callable(values):
        return np.asarray(values)[..., part]
    count = part.stop - part.start

    def inner(bins: slice) -> Array:
        start, stop, step = bins.indices(count)
        return np.asarray(values(slice(part.start + start, part.start + max(stop, start), step)))

    return inner


def part_of(values: Any, bins: slice) -> Array:
    """The bins of a slice, computed if they are deferred."""
    return np.asarray(values(bins) if callable(values) else np.asarray(values)[..., bins])


def shifted(joint: Callable[[Array], tuple[Array, Array]], by: int, index: Any) -> tuple[Array, Array]:
    """Weights and rows of the bins `by` further: those of a part, from those of the whole."""
    return joint(np.asarray(index) + by)
