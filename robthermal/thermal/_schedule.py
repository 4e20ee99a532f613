"""When the held drives change: at the samples, and between them where an input is delayed or a link changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from ._equations import Equations
from ._parts import Drive
from ._terms import Array, Indices

_SAME = 1e-9  # of a sample
NONE: Mapping[str, Array] = MappingProxyType({})


@dataclass(frozen=True)
class Schedule:
    """Segments of constant drives.

    Parameters
    ----------
    lengths : tuple of float
        The different lengths of segments; the first is the sample time [s].
    at : ndarray, shape (n_segments,)
        Start of every segment [samples].
    kind : ndarray of int, shape (n_segments,)
        Length of every segment.
    u : ndarray, shape (n_segments, n_u)
        Exogenous values, delayed.
    w : ndarray, shape (n_segments, n_w)
        Drives, constant over every segment.
    samples : ndarray of int, shape (n_samples,)
        Segment that starts at every sample; the last one is never left.
    """

    lengths: tuple[float, ...]
    at: Array
    kind: NDArray[np.intp]
    u: Array
    w: Array
    samples: Indices

    def before(self, delay: float) -> NDArray[np.bool_]:
        """Segments in which a drive is still what it was before the record, by its delay [s]."""
        return np.floor(self.at - delay / self.lengths[0] + _SAME) < 0


def schedule(eq: Equations, u: Array, h: float, start: float = 0.0, ripple: Mapping[str, Array] = NONE) -> Schedule:
    """Segments of a record.

    Parameters
    ----------
    eq : Equations
        Equations whose drives follow from the record.
    u : ndarray, shape (n_samples, n_u)
        Columns of the record.
    h, start : float
        Sample time and time of the first sample [s].
    ripple : mapping of str to ndarray, shape (n_samples,)
        Of the modules `Equations.ripple` [A].
    """
    n = len(u)
    if not (eq.drives.steps or eq.drives.ripples or any(drive.delay for drive in eq.drives.of.values())):
        every = np.arange(n)  # nothing happens between the samples
        return Schedule((h,), every.astype(float), np.zeros(n, np.intp), u, eq.drives(u), every)
    delays = {column: drive.delay / h for column, drive in eq.drives.of.items() if drive.delay}
    steps = {column: (link.step.time - start) / h for link in eq.system.links if link.step
             for column in [eq.drives.steps[link.name]]}
    jumps = {column: _jumps(u[:, column], eq.drives.of[column].before) for column in delays}  # else nothing happens
    cuts = [jumps[column] + delay for column, delay in delays.items()] + [np.array(list(steps.values()))]
    at = _distinct(np.concatenate([np.arange(n, dtype=float), *cuts]), n)
    lengths, kind = _kinds(np.append(np.diff(at), 1.0))
    held = u[np.floor(at + _SAME).astype(np.intp)]
    for column, delay in delays.items():
        source = np.floor(at - delay + _SAME).astype(np.intp)
        before = eq.drives.of[column].before
        held[:, column] = np.where(source < 0, u[0, column] if before is None else before,
                                   u[np.maximum(source, 0), column])
    w = eq.drives(held)
    for column, time in steps.items():
        w[:, column] = at >= time - _SAME
    for name, column in eq.drives.ripples.items():
        w[:, column] = _late(ripple[name], at, eq.drives.of[eq.drives.column[name]], h)
    return Schedule(tuple(length * h for length in lengths), at, kind, held, w,
                    np.searchsorted(at, np.arange(n) - _SAME).astype(np.intp))


def _jumps(values: Array, before: float | None) -> Indices:
    """Samples at which a column changes, and the first where it had another value before the record."""
    return np.flatnonzero(np.diff(values, prepend=values[0] if before is None else before))


def _late(ripple: Array, at: Array, drive: Drive, h: float) -> Array:
    """Ripple of a current behind its drive: as late as the current, and little of it left by a lag.

    A lag T much longer than a sample h leaves h² / (12 T²) of the square of a step in its middle.
    """
    source = np.floor(at - drive.delay / h + _SAME).astype(np.intp)
    through = 1.0 / np.sqrt(1.0 + 12.0 * (drive.time_constant / h) ** 2)
    return np.where(source < 0, 0.0, through * ripple[np.maximum(source, 0)])


def one_sample(eq: Equations, u: Array, h: float) -> Schedule:
    """The schedule of a single sample, of a system without delayed inputs and steps of conductance.

    Parameters
    ----------
    eq : Equations
        Equations whose drives follow from the values.
    u : ndarray, shape (n_u,)
        Exogenous values, held over the sample.
    h : float
        Length of the sample [s].
    """
    held = np.array([u, u])
    return Schedule((h,), np.array([0.0, 1.0]), np.zeros(2, np.intp), held, eq.drives(held), np.arange(2))


def _distinct(at: Array, n: int) -> Array:
    """Sorted times [samples] within the record, without those that coincide; whole samples stay exact."""
    nearest = np.round(at)
    at = np.unique(np.where(np.abs(at - nearest) < _SAME, nearest, at))
    at = at[(at >= 0) & (at <= n - 1)]
    return at[np.concatenate([[True], np.diff(at) > _SAME])]


def _kinds(lengths: Array) -> tuple[list[float], NDArray[np.intp]]:
    """Distinct lengths [samples], a whole sample first, and which one each segment has."""
    values, number = np.unique(np.round(lengths, 9), return_inverse=True)
    different = [1.0, *(float(value) for value in values if value != 1.0)]
    return different, np.array([different.index(float(value)) for value in values], np.intp)[number]
