"""A controller as three matrices: start, heat and advance are linear in the memory and the inputs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ..errors import InputError
from ._controller_input import ControllerInput
from ._modules import Array

_LINEAR = 1e-9  # relative: a controller whose matrices miss it by more is not linear


class Steps(Protocol):
    """What a controller does at a sample, see `Controller`."""

    sample_time: float

    def start(self, given: ControllerInput, heat: Array) -> Array:
        """State at the start."""

    def heat(self, state: Array, given: ControllerInput) -> Array:
        """Wanted heats [W]."""

    def advance(self, state: Array, given: ControllerInput, wanted: Array, achieved: Array) -> Array:
        """State at the next sample."""


@dataclass(frozen=True)
class Matrices:
    """start = M_s [inputs; heat], heat = M_h [memory; inputs], memory⁺ = M_a [memory; inputs; wanted; achieved].

    inputs = [reference; cold; temperatures of `lumps`; around]. Entries are zero where nothing acts.

    Parameters
    ----------
    sample_time : float
        Time between two samples [s].
    modules : int
        Number of modules.
    lumps : tuple of str
        Lumps whose temperatures are used.
    indices : tuple of int
        Their positions among all lumps of the system.
    n_lumps : int
        Number of lumps of the system; 0 where none is used.
    around : tuple of str
        Measured surroundings that are used.
    start, heat, advance : ndarray
        (n, n_inputs + modules), (modules, n + n_inputs) and (n, n + n_inputs + 2 modules).
    """

    sample_time: float
    modules: int
    lumps: tuple[str, ...]
    indices: tuple[int, ...]
    n_lumps: int
    around: tuple[str, ...]
    start: Array
    heat: Array
    advance: Array

    @property
    def sizes(self) -> dict[str, int]:
        """Length of every part of the inputs."""
        return {"reference": self.modules, "cold": self.modules, "temperatures": len(self.lumps),
                "around": len(self.around)}

    def vector(self, given: ControllerInput) -> list[float]:
        """The inputs in one list.

        Parameters
        ----------
        given : ControllerInput
            At a sample.
        """
        parts = [given.reference, given.cold, given.temperatures[list(self.indices)]]
        return [float(value) for part in [*parts, *([given.around] if self.around else [])] for value in part]


def dot(row: Array, values: list[float]) -> float:
    """Sum of products over the entries that are not zero, from the left: as the C source computes it."""
    terms = [float(a) * value for a, value in zip(row, values, strict=True) if a != 0]
    total = terms[0] if terms else 0.0
    for term in terms[1:]:
        total = total + term
    return total


def matrices(controller: Steps) -> Matrices:
    """Matrices of a controller, from its answers to unit vectors, without memory that nothing reads.

    Parameters
    ----------
    controller : Steps
        Linear in its memory and in what it sees.
    """
    own = getattr(controller, "matrices", None)
    if isinstance(own, Matrices):
        return own
    plant: Any = getattr(controller, "plant", None)
    m = len(plant.law.names) if plant else getattr(controller, "count", None)
    if m is None:
        raise InputError(f"a {type(controller).__name__} does not tell its number of modules",
                         where="argument controller", expected="what rt.design.pid, state_feedback, linear_controller, "
                         "feed_forward or disturbance_observer returned")
    names = plant.law.system.lump_names if plant else ()
    around = plant.around if plant else ()
    sizes = np.cumsum([m, m, len(names), len(around)])

    def inputs(z: Array) -> ControllerInput:
        return ControllerInput(*np.split(z, sizes[:-1]))

    def start(z: Array) -> Array:
        return controller.start(inputs(z[:k]), z[k:])

    def heat(z: Array) -> Array:
        return controller.heat(z[:n], inputs(z[n:]))

    def advance(z: Array) -> Array:
        return controller.advance(z[:n], inputs(z[n:n + k]), z[n + k:n + k + m], z[n + k + m:])

    k = int(sizes[-1])
    n = len(start(np.zeros(k + m)))
    s, h, a = (_matrix(f, size, type(controller).__name__)
               for f, size in ((start, k + m), (heat, n + k), (advance, n + k + 2 * m)))
    kept = _read(h[:, :n], a[:, :n])
    s, h, a = s[kept], h[:, [*kept, *range(n, n + k)]], a[np.ix_(kept, [*kept, *range(n, n + k + 2 * m)])]
    used = np.abs(np.concatenate([s[:, :k], h[:, len(kept):], a[:, len(kept):len(kept) + k]])).sum(axis=0)
    lumps = [i for i in range(len(names)) if used[2 * m + i]]
    beside = [*range(len(around))] if used[2 * m + len(names):].any() else []
    columns = [*range(2 * m), *(2 * m + i for i in lumps), *(2 * m + len(names) + i for i in beside)]
    memory = [*range(len(kept))]
    return Matrices(controller.sample_time, m, tuple(names[i] for i in lumps), tuple(lumps), len(names) if lumps else 0,
                    tuple(around) if beside else (), s[:, [*columns, *range(k, k + m)]],
                    h[:, [*memory, *(len(kept) + c for c in columns)]],
                    a[:, [*memory, *(len(kept) + c for c in [*columns, *range(k, k + 2 * m)])]])


def _matrix(function: Callable[[Array], Array], size: int, kind: str) -> Array:
    """Matrix of a linear function; refuses one that is not."""
    probe = np.random.default_rng(0).standard_normal(size)
    M = np.column_stack([function(unit) for unit in np.eye(size)])
    off = np.abs(function(probe) - M @ probe).max(initial=0.0)
    if not off <= _LINEAR * max(1.0, np.abs(M).max(initial=0.0)):
        raise InputError(f"a {kind} is not linear in its memory and in what it sees", where="argument controller",
                         expected="a linear controller", remedy="Write its step in C by hand.")
    return M


def _read(heat: Array, advance: Array) -> list[int]:
    """Memory that reaches a heat, directly or through other memory."""
    found: set[int] = set()
    more = set(np.flatnonzero(heat.any(axis=0)).tolist())
    while more - found:
        found |= more
        more = set(np.flatnonzero(advance[sorted(found)].any(axis=0)).tolist())
    return sorted(found)
