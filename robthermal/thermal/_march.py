"""The compiled steps `_march.c` of small systems where they were built, by ctypes; else None, and numpy does the same.

Sizes, types and layout of every array are made here, for the other side trusts them.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._library import functions
from ._collocation import DEGREE, TAIL, Step
from ._effect_terms import CondensationTerm, FollowTerm, HeaterTerm, LeadTerm, StepTerm
from ._module_term import ModuleTerm, RippleTerm
from ._ports import PortHeat
from ._terms import Array, NaturalTerm, PowerTerm, RadiationTerm

SOURCE, HEADERS = Path(__file__).with_name("_march.c"), ("../_lanes.h",)
_MOST, _MOST_PORTS, _MOST_PAIRS, _NUMBERS, _BEYOND = 64, 12, 64, 8, 8  # as in the source
_FINEST = 1e-11  # K: below it a change of a temperature is rounding
_FEW = 20  # segments, whose kinds are sooner compared one by one
_CLOSER = 0.01  # of the change at which numpy stops: one iteration more costs little here

March = Callable[..., int]  # of a pointer to a problem: samples that were computed


@dataclass(frozen=True)
class Steps:
    """Functions of the library.

    Parameters
    ----------
    march : callable
        Of problems, one for each length of a segment, and which of them every segment is: computes segments, and says
        how many.
    derivatives : callable
        Of a pointer to a problem: differentiates samples, and says how many.
    """

    march: March
    derivatives: March


@dataclass(frozen=True)
class Linearized:
    """Steps of one length at their nodes, and their derivatives.

    Parameters
    ----------
    V : ndarray, shape (S, p + 1, n_ports + n_w)
        States at the ports, and drives.
    q : ndarray, shape (S, p + 1, n_q)
        Heats at the nodes by target [W].
    F : ndarray, shape (S, n_free, n_free)
        Derivative of the end by the start.
    through : ndarray, shape (S, n_free, p n_ports)
        Derivative of the end by what is added to the ports at nodes 1 to p.
    """

    V: Array
    q: Array
    F: Array
    through: Array


class _Problem(ctypes.Structure):
    """`problem` of the source."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("n_z", "n_w", "n_ports", "n_q", "n_pairs", "count")),
        *((name, ctypes.c_void_p) for name in ("K", "Ku", "M", "Kt", "Kut", "Mt")),
        ("padded", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("ports", "pairs", "numbers", "scatter")),
        ("padded_q", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("gain", "tail")),
        *((name, ctypes.c_double) for name in ("goal", "roughest", "hottest")),
        *((name, ctypes.c_void_p) for name in ("w", "z")),
        ("n_free", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("V", "q", "F", "through")),
    )


@cache
def library(folder: Path = SOURCE.parent, lanes: int | None = None) -> Steps | None:
    """Functions of the library in `folder`; None where it was not built, or from another source.

    With vectors as wide as this processor has, or of so many `lanes`.
    """
    found = functions(SOURCE, HEADERS, folder, lanes, ("march_size", "march", "derivatives"))
    if found is None:
        return None
    size, march, derivatives = found
    for function in (size, march, derivatives):
        function.restype = ctypes.c_int64
    if size() != ctypes.sizeof(_Problem):
        return None
    march.argtypes = [ctypes.POINTER(_Problem), ctypes.c_void_p, ctypes.POINTER(ctypes.c_double)]
    derivatives.argtypes = [ctypes.POINTER(_Problem)]
    return Steps(march, derivatives)


class Marching:
    """Steps of one length.

    Parameters
    ----------
    built : Steps
        What `library` found.
    heat : PortHeat
        Of the system.
    step : Step
        Matrices of a step.
    gain : ndarray, shape (n_q,)
        Temperature that one watt of each heat is worth over a step [K/W].
    goal, roughest, hottest : float
        Change of a temperature at which a fixed point is found, accepted truncation of the heats, and what no
        temperature may reach [K].
    """

    def __init__(self, built: Steps, heat: PortHeat, step: Step, gain: Array, goal: float, roughest: float,
                 hottest: float):
        pairs, numbers = _described(heat)
        n_z, n_w = step.K.shape[1], step.Ku.shape[1]
        self._built, self._size = built, (n_z, n_w, heat.ports.size, heat.scatter.shape[1], len(pairs))
        matrices = [np.ascontiguousarray(a, float) for a in (step.K, step.Ku, step.M)]
        by_columns = [_filled_up(a.T) for a in matrices]
        places = [np.ascontiguousarray(a, np.int64) for a in (heat.ports, pairs)]
        scattered = [np.ascontiguousarray(numbers, float), _filled_up(_in_pairs(heat))]
        rough = [np.ascontiguousarray(a, float) for a in (gain, TAIL)]
        self._arrays = *matrices, *by_columns, *places, *scattered, *rough
        self._of_step = (*_pointers(matrices), *_pointers(by_columns), by_columns[0].shape[1], *_pointers(places),
                         *_pointers(scattered), scattered[1].shape[1], *_pointers(rough), max(_CLOSER * goal, _FINEST),
                         roughest, hottest)

    def linearized(self, z: Array, w: Array, n_free: int) -> Linearized | None:
        """Steps from states z (S, n_z) with drives w (S, n_w) and their derivatives; None where one does not converge.

        Of the first `n_free` states, which the others feed nothing back to.
        """
        n_z, n_w, n_ports, n_q, _ = self._size
        starts, held, S = np.ascontiguousarray(z, float), np.ascontiguousarray(w, float), len(z)
        if starts.shape != (S, n_z) or held.shape != (S, n_w) or not 0 < n_free <= n_z:
            raise ValueError("states and drives do not fit")
        out = Linearized(np.empty((S, DEGREE + 1, n_ports + n_w)), np.empty((S, DEGREE + 1, n_q)),
                         np.empty((S, n_free, n_free)), np.empty((S, n_free, DEGREE * n_ports)))
        problem = self._problem(held, starts, n_free,
                                *_pointers([out.V, out.q, out.F, out.through]))
        return out if self._built.derivatives(ctypes.byref(problem)) == S else None

    def _problem(self, w: Array, z: Array, *rest: int) -> _Problem:
        return _Problem(*self._size, len(w), *self._of_step, w.ctypes.data, z.ctypes.data, *rest)


class Lengths:
    """Segments of several lengths, all of one system, one after the other.

    Parameters
    ----------
    lengths : sequence of Marching
        Steps of every length that segments have.
    """

    def __init__(self, lengths: Sequence[Marching]):
        self._lengths, self._sizes = tuple(lengths), lengths[0]._size[:2]  # the first keep the arrays alive
        self._problems = (_Problem * len(lengths))(*(_Problem(*one._size, 0, *one._of_step, 0, 0) for one in lengths))

    def __call__(self, kind: NDArray[np.intp], z: Array, w: Array) -> tuple[int, float]:
        """Compute the states after the first, segment by segment.

        How many were computed, and what the last coefficients of the heats are worth at most in these [K].

        Parameters
        ----------
        kind : ndarray of int, shape (count,)
            Which of the lengths every segment has.
        z : ndarray, shape (count + 1, n_z)
            States; filled after the first.
        w : ndarray, shape (count, n_w)
            Drives, constant over every segment.
        """
        count, (n_z, n_w) = len(kind), self._sizes
        if z.shape != (count + 1, n_z) or w.shape != (count, n_w) or z.dtype != float or not z.flags.c_contiguous:
            raise ValueError("states and drives do not fit")
        few = kind.tolist() if count <= _FEW else (kind.min(), kind.max())
        if not count or not 0 <= min(few) <= max(few) < len(self._lengths):
            raise ValueError("no segments, or of another length")
        held, kinds = np.ascontiguousarray(w, float), np.ascontiguousarray(kind, np.int64)
        drives, states, worst = held.ctypes.data, z.ctypes.data, ctypes.c_double()
        for problem in self._problems:
            problem.count, problem.w, problem.z = count, drives, states
        return self._lengths[0]._built.march(self._problems, kinds.ctypes.data, ctypes.byref(worst)), worst.value


def holds(heat: PortHeat, n_z: int) -> bool:
    """Whether the compiled steps know every heat of a system, and the system is small enough.

    Parameters
    ----------
    heat : PortHeat
        Of the system.
    n_z : int
        Number of its states.
    """
    most = max(n_z, heat.ports.size + heat.eq.drives.width, heat.scatter.shape[1])
    pairs = sum(len(term.a) for term in heat.eq.terms)
    return (most <= _MOST and heat.ports.size <= _MOST_PORTS and pairs <= _MOST_PAIRS
            and all(type(term) in _KINDS for term in heat.eq.terms))


def _filled_up(rows: Array) -> Array:
    """Rows with as many zeros behind each as the source may read beyond its end."""
    out = np.zeros((len(rows), rows.shape[1] + _BEYOND))
    out[:, :rows.shape[1]] = rows
    return out


def _pointers(arrays: Sequence[NDArray[Any]]) -> list[int]:
    return [one.ctypes.data for one in arrays]


def _described(heat: PortHeat) -> tuple[Array, Array]:
    """Kind, ends and drive of every pair (n_pairs, 4), and its numbers (n_pairs, 8)."""
    pairs, numbers = [np.zeros((0, 4))], [np.zeros((0, _NUMBERS))]
    for term, (a, b, drive) in zip(heat.eq.terms, heat.places, strict=True):
        kind, numbers_of = _KINDS[type(term)]
        driven = drive if drive.size else np.full(len(a), -1)
        pairs.append(np.column_stack([np.full(len(a), kind), a, b, driven]))
        own = np.zeros((len(a), _NUMBERS))
        for column, values in enumerate(numbers_of(term)):
            own[:, column] = values
        numbers.append(own)
    return np.concatenate(pairs), np.concatenate(numbers)


def _in_pairs(heat: PortHeat) -> Array:
    """Targets of the flows, pair by pair: into end a, then into end b."""
    order, first = [], 0
    for term in heat.eq.terms:
        n = len(term.a)
        order += [first + side * n + pair for pair in range(n) for side in (0, 1)]
        first += 2 * n
    return heat.scatter[order]


def _of_module(term: ModuleTerm) -> tuple[Array, ...]:
    return term.S, term.S_slope, term.R, term.R_slope, term.K_slope, term.T_ref, term.thomson, term.split


_KINDS: dict[type, tuple[int, Callable[[Any], tuple[Array | float, ...]]]] = {  # numbered as in the source
    ModuleTerm: (0, _of_module),
    RippleTerm: (0, _of_module),
    NaturalTerm: (1, lambda t: (t.gain, t.exponent, t.warmer_b - t.warmer_a)),
    RadiationTerm: (2, lambda t: (t.coefficient, t.warmer_a, t.warmer_b)),
    StepTerm: (3, lambda t: (t.conductance * t.relative, t.warmer)),
    FollowTerm: (4, lambda t: (t.conductance * t.relative, t.warmer)),
    HeaterTerm: (5, lambda t: (t.gain * t.slope, t.T_ref, t.share)),
    LeadTerm: (6, lambda t: (t.resistance,)),
    CondensationTerm: (7, lambda t: (t.conductance, t.dew_point)),
    PowerTerm: (8, lambda t: (t.conductance, t.exponent, t.T_ref, t.warmer_a, t.warmer_b)),
}
