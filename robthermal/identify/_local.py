"""One local estimate over all bins: chunks for the interior, the exact solver for edges and doubtful windows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from robthermal._arrays import Array
from robthermal.errors import InputError

from ._basis import LocalBasis
from ._compiled import CompiledKernel, interior_kernel
from ._kernel import BlockFit, Kernel
from ._records import Spectrum
from ._threads import run_all
from ._windows import points_per_record, regression, rows_of, solve_windows

_CHUNK_BYTES = 2**22  # columns of a chunk of interior bins: small enough for the cache
_CHUNK_MOST = 4096  # and not so many bins that threads would wait for each other
_FEW_WEAK = 1 / 32  # part of the bins that are rather solved exactly one by one than all of them orthogonalized
_EXACT_BYTES = 2**25  # regressors of the exact solver held at a time
_FULL_NOISE_BYTES = 2**29  # above this the full noise covariance is computed only for the bins asked for


@dataclass
class LocalArrays:
    """What a pass over all bins leaves: `noise` is (n_y, n_y, F), or None where it would not fit."""

    response: Array
    gram: Array
    variance: Array  # (n_y, F): the diagonal of the noise covariance
    noise: Array | None
    degrees_of_freedom: Array


class LocalEstimate:
    """Spectra and basis, and everything that can be computed from them bin by bin."""

    def __init__(self, spectra: Sequence[Spectrum], basis: LocalBasis):
        self.spectra, self.basis = tuple(spectra), basis
        self.n_u, self.n_y = spectra[0].U.shape[0], spectra[0].Y.shape[0]
        self.n_bins = next(s.n_bins for s in spectra if s.n_samples == basis.n_samples)
        self._check_room()

    def _check_room(self) -> None:
        points = self.basis.n_points
        for spectrum in self.spectra:
            if points_per_record([spectrum], self.basis)[0] > spectrum.n_bins or self.n_bins < points:
                raise InputError(
                    f"half_width {self.basis.half_width} needs a window of {points} bins, wider than the record: "
                    f"its {spectrum.n_samples} samples give {spectrum.n_bins} bins",
                    where="half_width",
                    remedy="Use a longer record or a smaller half_width.",
                )
        if self.nominal_degrees_of_freedom < 1:
            raise InputError(
                f"no degrees of freedom left: {sum(points_per_record(self.spectra, self.basis))} points per window for "
                f"{self.unknowns} unknowns per output",
                where="half_width",
                expected=f"half_width large enough for more than {self.unknowns} points",
                remedy="Increase half_width, or take a lower degree, fewer poles, functions or inputs.",
            )

    @property
    def unknowns(self) -> int:
        """Unknowns of a window per output, plant and transients."""
        return self.basis.size * self.n_u + self.basis.transient_size * len(self.spectra)

    @property
    def rounding(self) -> Array:
        """Size of a line of each output that may be nothing but rounding, (n_y,)."""
        return np.asarray(np.max([spectrum.rounding for spectrum in self.spectra], axis=0))

    @property
    def nominal_degrees_of_freedom(self) -> int:
        """q of a window with full rank."""
        return sum(points_per_record(self.spectra, self.basis)) - self.unknowns

    @property
    def _sliding(self) -> bool:
        """Whether windows of the interior slide over the bins of all records alike."""
        return self.basis.sliding and all(s.n_samples == self.basis.n_samples for s in self.spectra)

    @cached_property
    def _kernel(self) -> Kernel:
        """For bins in which products of columns would cost digits: not always asked for."""
        return Kernel(self.spectra, self.basis)

    def run(self) -> LocalArrays:
        """Response, gram block, noise and degrees of freedom of bins 1 ... F."""
        full = self.n_y**2 * self.n_bins * 16 <= _FULL_NOISE_BYTES
        return self._solve(1, self.n_bins + 1, full_noise=full)

    def noise(self, bins: slice) -> Array:
        """Noise covariance (n_y, n_y, ...) of the bins in the slice (0 is bin 1)."""
        start, stop, step = bins.indices(self.n_bins)
        found = self._solve(start + 1, max(stop, start) + 1, full_noise=True)
        return np.asarray(found.noise)[..., ::step]

    def transient(self, bins: slice) -> Array:
        """Transient of the first record at the bins in the slice, (n_y, ...)."""
        chosen = np.arange(1, self.n_bins + 1)[bins]
        parts = [solve_windows(regression(self.spectra, self.basis, part)).transient for part in self._parts(chosen)]
        return np.concatenate([np.empty((self.n_y, 0), dtype=complex), *parts], axis=1)

    def weights(self, index: Array) -> tuple[Array, Array]:
        """Weights of the outputs in G and numbers of their rows, (n_u, m, B) and (B, m), at `index` (0 is bin 1)."""
        problem = regression(self.spectra, self.basis, index + 1)
        return solve_windows(problem).weights, self._rows(index + 1)

    def explained(self, response: Array, bins: slice) -> Array:
        """Mean power of G U in each window, (n_y, ...), for the coherence."""
        chosen = np.arange(1, self.n_bins + 1)[bins]
        power, done = np.empty((self.n_y, chosen.size)), 0
        for part in self._parts(chosen):
            problem = regression(self.spectra, self.basis, part)
            U = problem.K[..., -self.n_u :]
            G = np.nan_to_num(response[:, :, done : done + part.size])
            power[:, done : done + part.size] = (np.abs(np.einsum("bri,oib->obr", U, G)) ** 2).mean(axis=-1)
            done += part.size
        return power

    def _rows(self, bins: Array) -> Array:
        """A number for every row of a window that is the same for the same bin of the same record."""
        first, labels = 0, []
        for spectrum in self.spectra:
            labels.append(first + rows_of(spectrum, self.basis, bins)[0])
            first += spectrum.n_bins + 1
        return np.concatenate(labels, axis=1)

    def offsets(self, bins: Array) -> Array:
        """Offset of every row from the center of its window [bins], (B, m), records one after the other."""
        return np.concatenate([rows_of(spectrum, self.basis, bins)[1] for spectrum in self.spectra], axis=1)

    def _parts(self, bins: Array) -> Iterator[Array]:
        rows = sum(points_per_record(self.spectra, self.basis))
        width = rows * (self.unknowns + self.n_y) * 16
        count = max(1, _EXACT_BYTES // width)
        return (bins[first : first + count] for first in range(0, bins.size, count))

    def _solve(self, start: int, stop: int, *, full_noise: bool) -> LocalArrays:
        count = stop - start
        found = LocalArrays(
            response=np.empty((self.n_y, self.n_u, count), dtype=complex),
            gram=np.empty((self.n_u, self.n_u, count), dtype=complex),
            variance=np.empty((self.n_y, count)),
            noise=np.empty((self.n_y, self.n_y, count), dtype=complex) if full_noise else None,
            degrees_of_freedom=np.full(count, self.nominal_degrees_of_freedom, dtype=np.int32),
        )
        exact = np.ones(count, dtype=bool)  # bins that are left to the exact solver
        if self._sliding:
            self._solve_interior(found, exact, start)
        for part in self._parts(start + np.flatnonzero(exact)):
            self._solve_exactly(found, part, part - start)
        return found

    def _solve_interior(self, found: LocalArrays, exact: Array, start: int) -> None:
        first, last = self.basis.half_width + 1, self.n_bins - self.basis.half_width + 1
        points = len(self.spectra) * self.basis.n_points
        columns = self.n_u * self.basis.size + self.n_y
        chunk = max(64, min(_CHUNK_MOST, _CHUNK_BYTES // (16 * columns * points)))
        normal = interior_kernel(self.spectra, self.basis)
        block = normal.chunk
        full = found.noise is not None

        def solve(a: int) -> None:  # always whole blocks of the record: a bin has the same digits in every request
            b = min(a + block, last)
            low, high = max(a, start), min(b, start + exact.size)
            part, mine = slice(low - start, high - start), slice(low - a, high - a)
            if isinstance(normal, CompiledKernel) and high - low == b - a:
                there = _place(found, exact, part)
                fit = normal.solve(a, b, full_noise=full, into=there)
            else:
                there, fit = None, normal.solve(a, b, full_noise=full)
            if fit.doubtful.mean() > _FEW_WEAK:
                there, fit = None, self._kernel.solve(a, b, chunk=chunk, full_noise=full)
            if there is None:
                found.response[..., part], found.gram[..., part] = fit.response[..., mine], fit.gram[..., mine]
                _store_noise(found, part, fit.noise[..., mine])
                exact[part] = fit.doubtful[mine]

        stop = start + exact.size
        edges = np.concatenate([np.arange(start, min(first, stop)), np.arange(max(last, start), stop)])

        def solve_edges() -> None:  # beside the interior: they take as long as a block
            for part in self._parts(edges):
                self._solve_exactly(found, part, part - start)
            exact[edges - start] = False

        before = max(0, start - first) // block * block
        starts = range(first + before, min(last, stop), block)
        run_all(lambda a: solve(a) if a else solve_edges(), [0, *starts], worth=len(starts) >= 4)

    def _solve_exactly(self, found: LocalArrays, bins: Array, place: Array) -> None:
        fit = solve_windows(regression(self.spectra, self.basis, bins))
        found.response[..., place], found.gram[..., place] = fit.response, fit.gram
        _store_noise(found, place, fit.noise)
        found.degrees_of_freedom[place] = fit.degrees_of_freedom


def _place(found: LocalArrays, exact: Array, part: slice) -> BlockFit:
    """Where the results of some bins belong."""
    variance = found.variance[:, part]
    noise = variance if found.noise is None else found.noise[..., part]
    return BlockFit(found.response[..., part], found.gram[..., part], noise, exact[part], variance)


def _store_noise(found: LocalArrays, part: Any, noise: Array) -> None:
    if noise.ndim == 2:
        found.variance[:, part] = noise
        return
    found.variance[:, part] = np.einsum("oob->ob", noise).real
    if found.noise is not None:
        found.noise[..., part] = noise
