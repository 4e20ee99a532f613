"""The compiled kernel `_moments.c` where it was built, by ctypes: the one place that decides between it and numpy.

The library is named by a hash of its source, so that one built from an older source is never loaded. Sizes, types and
layout of every array are checked here, for the other side trusts them.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from .._arrays import Array
from .._library import library as compiled_from
from .._library import widest
from ._basis import LocalBasis
from ._kernel import BlockFit
from ._normal import WEAK_BOTH, WEAK_PIVOT, WEAK_RESIDUAL, NormalKernel
from ._records import Spectrum

SOURCE, HEADERS = Path(__file__).with_name("_moments.c"), ("_vectors.h", "../_lanes.h")
_MOST_SIZE, _MOST_COLUMNS = 5, 24  # as in the source
_BINS = 9700  # of a chunk: long enough for what a call costs, short enough for two threads to end together


Solver = Callable[[Any], int]  # of a pointer to a problem; 0 where it is solved


class _Problem(ctypes.Structure):
    """`problem` of the source."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("n_records", "n_u", "n_y", "size", "half", "n_poles", "count", "stride")),
        *((name, ctypes.c_void_p)
          for name in ("U", "Y", "strides", "turn", "poles", "products", "functions", "ones")),
        *((name, ctypes.c_double) for name in ("weak_pivot", "weak_residual", "weak_both", "degrees_of_freedom")),
        *((name, ctypes.c_void_p) for name in ("response", "gram", "noise", "variance", "doubtful")),
    )


@cache
def library(folder: Path = SOURCE.parent, lanes: int | None = None) -> Solver | None:
    """What solves chunks by the library in `folder`, as many windows at a time as this processor can, or `lanes`.

    None where it was not built, or from another source, or for other processors.
    """
    found = compiled_from(SOURCE, HEADERS, folder)
    wide = None if found is None else widest(found, lanes)
    if found is None or wide is None or found[f"robthermal_problem_size_{wide}"]() != ctypes.sizeof(_Problem):
        return None
    solve: Solver = found[f"robthermal_solve_{wide}"]
    solve.argtypes, solve.restype = [ctypes.POINTER(_Problem)], ctypes.c_int  # type: ignore[attr-defined]
    return solve


def interior_kernel(spectra: Sequence[Spectrum], basis: LocalBasis) -> NormalKernel | CompiledKernel:
    """The solver of interior windows: compiled where that was built and holds them, else in numpy."""
    built, n_u, n_y = library(), spectra[0].U.shape[0], spectra[0].Y.shape[0]
    fits = basis.size <= _MOST_SIZE and n_u * basis.size + n_y <= _MOST_COLUMNS
    if built is None or not fits or not _even_and_odd(basis.real_functions()):
        return NormalKernel(spectra, basis)
    return CompiledKernel(spectra, basis, built)


class CompiledKernel:
    """As `NormalKernel`, several times faster.

    Parameters
    ----------
    spectra : sequence of Spectrum
        Records of equal length.
    basis : LocalBasis
        Functions of plant and transient.
    built : callable
        What `library` found.
    """

    chunk = _BINS

    def __init__(self, spectra: Sequence[Spectrum], basis: LocalBasis, built: Solver):
        self._basis, self._built = basis, built
        self._n_u, self._n_y = spectra[0].U.shape[0], spectra[0].Y.shape[0]
        if basis.size > _MOST_SIZE or self._n_u * basis.size + self._n_y > _MOST_COLUMNS:
            raise ValueError("more functions or columns than the compiled kernel holds")
        self._n_bins = spectra[0].n_bins
        self._U = [_in_rows(s.U, (self._n_u, self._n_bins)) for s in spectra]
        self._Y = [_in_rows(s.Y, (self._n_y, self._n_bins)) for s in spectra]
        half, size, points = basis.half_width, basis.size, basis.n_points  # functions are even or odd: r >= 0 is enough
        self._products = _checked(basis.real_products()[:, half:].T, (half + 1, 2 * size - 1), float)
        self._functions = _checked(basis.real_functions()[:, half:].T, (half + 1, size), float)
        self._ones = np.ones((half + 1, 1))
        self._poles = _checked(basis.factors_of_denominator(), (basis.poles.size, 2))
        pairs = zip(self._U, self._Y, strict=True)
        self._strides = np.array([[one.strides[0] // 16 for one in pair] for pair in pairs], dtype=np.int64)
        self.degrees_of_freedom = len(spectra) * (points - size) - self._n_u * size

    def solve(self, start: int, stop: int, *, full_noise: bool, into: BlockFit | None = None) -> BlockFit:
        """Windows centered at bins start ... stop-1, counted from 1; all of them must fit between the edges.

        The results are written `into` arrays of the caller, parts of rows of equal length, or into new ones.
        """
        half, count, n_u, n_y = self._basis.half_width, stop - start, self._n_u, self._n_y
        first = start - 1 - half
        if count < 1 or first < 0 or stop - 1 + half > self._n_bins:
            raise ValueError("windows reach beyond the spectra")
        turn = self._basis.half_turns(start - half, stop + half) if len(self._poles) else np.empty(0, dtype=complex)
        fit = into or BlockFit(
            response=np.empty((n_y, n_u, count), dtype=complex),
            gram=np.empty((n_u, n_u, count), dtype=complex),
            noise=np.empty((n_y, n_y, count) if full_noise else (n_y, count), dtype=complex if full_noise else float),
            doubtful=np.empty(count, dtype=bool),
            variance=np.empty((n_y, count)) if full_noise else None,
        )
        stride = fit.response.strides[0] // (16 * n_u)
        variance = np.asarray(fit.variance) if full_noise else fit.noise
        for one, shape, kind in ((fit.response, (n_y, n_u), complex), (fit.gram, (n_u, n_u), complex),
                                 (fit.noise, (n_y, n_y) if full_noise else (n_y,), complex if full_noise else float),
                                 (variance, (n_y,), float), (fit.doubtful, (), bool)):
            _check_place(one, (*shape, count), kind, stride)
        pointers = [(ctypes.c_void_p * len(channels))(*(one[:, first:].ctypes.data for one in channels))
                    for channels in (self._U, self._Y)]
        problem = _Problem(
            len(self._U), n_u, n_y, self._basis.size, half, len(self._poles), count, stride,
            *(ctypes.addressof(one) for one in pointers), self._strides.ctypes.data,
            turn.ctypes.data, self._poles.ctypes.data,
            self._products.ctypes.data, self._functions.ctypes.data, self._ones.ctypes.data,
            WEAK_PIVOT, WEAK_RESIDUAL, WEAK_BOTH, self.degrees_of_freedom,
            fit.response.ctypes.data, fit.gram.ctypes.data, fit.noise.ctypes.data if full_noise else None,
            variance.ctypes.data, fit.doubtful.ctypes.data,
        )
        if self._built(ctypes.byref(problem)) != 0:
            raise MemoryError("no memory for the windows of a chunk")
        return fit


def _even_and_odd(functions: Array) -> bool:
    """Whether the functions (p, m) are even and odd in turn, which halves the products."""
    signs = (-1.0) ** np.arange(len(functions))[:, None]
    return bool(np.allclose(functions[:, ::-1], signs * functions, rtol=0.0, atol=1e-14))


def _checked(values: Array, shape: tuple[int, ...], kind: type = complex) -> Array:
    """Contiguous, of the type and shape that the other side expects."""
    found: Array = np.ascontiguousarray(values, dtype=kind)
    if found.shape != shape:
        raise ValueError(f"an array of shape {found.shape} where {shape} is needed")
    return found


def _in_rows(values: Array, shape: tuple[int, int]) -> Array:
    """As `_checked`, of complex numbers; rows may lie further apart than they are long."""
    apart = values.dtype == complex and values.shape == shape and values.strides[1] == 16 and not values.strides[0] % 16
    return values if apart else _checked(values, shape)


def _check_place(values: Array, shape: tuple[int, ...], kind: type, stride: int) -> None:
    """Whether results can be written to `values`: rows side by side in order, `stride` numbers from one to the next."""
    size, place = np.dtype(kind).itemsize, [1]
    for length in shape[-2:0:-1]:
        place.insert(0, place[0] * length)
    expected = (*(size * stride * each for each in place), size) if len(shape) > 1 else (size,)
    if values.dtype != kind or values.shape != shape or values.strides != expected or not values.flags.writeable:
        raise ValueError(f"results {values.shape} of {values.dtype} do not lie where they are written")
