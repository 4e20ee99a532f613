"""Where descents ended: a search asks for some of them again, and none is repeated."""

from __future__ import annotations

import hashlib
import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..path import White
from ._descent import Descent, Point
from ._structure import Structure
from ._whitened import Whitened

Array = NDArray[np.float64]
_DIGITS = 10  # of a start: of the same one that was computed in another order, roundings differ


@dataclass(frozen=True, eq=False)
class _End:
    """Where a descent ended, with the objects that it depends on: large ones are kept by nothing but their users."""

    shared: tuple[Any, ...]
    others: tuple[weakref.ref[Any], ...]
    v: Array
    converged: bool
    iterations: int


def ended(structure: Structure, v: Array, whiteners: Sequence[White], limit: int, made: Callable[[], Descent]
          ) -> Descent:
    """Where a descent ends, made unless the same one has been made; of it no more than that is kept.

    Parameters
    ----------
    structure : Structure
        Unknowns, their bounds and their priors.
    v : ndarray
        Start of the descent.
    whiteners : sequence of White
        Filters of the data; filters that combine no readings are the same if their numbers are.
    limit : int
        Evaluations at most.
    made : callable
        Makes the descent.
    """
    numbers = [getattr(white, "numbers", b"") for white in whiteners]
    shared = structure.base, structure.ranges, structure.sessions
    others = [*structure.data, *structure.coarse, *(white for white, own in zip(whiteners, numbers, strict=True)
                                                    if not own)]
    key = (_digest(*(np.round(one, _DIGITS) for one in (v, *structure.prior(v))), *structure.bounds,
                   *(start.mean for start in structure.starts), *(start.sigma for start in structure.starts)),
           limit, structure.tolerance, structure.only_heated, tuple(start.names for start in structure.starts),
           tuple((one.key, tuple(one.shape.items())) for one in structure.effects), *numbers,
           *map(id, shared), *map(id, others))
    kept = structure.ended.of.get(key)
    if kept is not None and all(one() is other for one, other in zip(kept.others, others, strict=True)):
        return Descent(Point(Whitened(structure, whiteners), kept.v), kept.converged, kept.iterations)
    found = made()
    structure.ended.of[key] = _End(shared, tuple(map(weakref.ref, others)), found.at.v, found.converged,
                                   found.iterations)
    return found


def _digest(*arrays: Array) -> bytes:
    """A few bytes that tell arrays apart."""
    return hashlib.sha256(b"".join(part for one in arrays for part in (repr(one.shape).encode(), one.tobytes()))
                          ).digest()
