"""Local basis of functions of frequency, which no sum of a few poles is: kept as a table at the bins of the records.

The plant is c_0 + sum c_i h phi_i within a window, h the factor of the hold. The transient of a linear plant is
T = G E_1 + E_2 with entire E_1, E_2, which vary over a window as slowly as the plant's memory is short against the
record; both are taken linear there, hence the transient has the functions (1, r) times (1, h phi_i).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from .._arrays import Array
from ._basis import LocalBasis
from ._local_functions import LocalFunctions, check_independent
from ._records import Spectrum


@dataclass(frozen=True)
class FunctionBasis(LocalBasis):
    """Functions h phi_i at the bins of all records; `degree` is their number, beside the constant."""

    positions: Array = field(default_factory=lambda: np.empty(0))  # bins on the grid of the basis, increasing
    values: Array = field(default_factory=lambda: np.empty((0, 0), dtype=complex))  # (positions, degree)

    @property
    def sliding(self) -> bool:
        return False

    @property
    def transient_size(self) -> int:
        return 2 * self.size

    def functions(self, bins: Array, offsets: Array) -> tuple[Array, Array]:
        """As `LocalBasis.functions`: 1 and h phi_i less its value at the center, for the transient also times r."""
        centers = np.asarray(bins, dtype=float)
        away = self._at(centers[:, None] + offsets) - self._at(centers)[:, None, :]
        plant = np.concatenate([np.ones((*offsets.shape, 1)), away], axis=-1)
        slope = offsets[..., None] / self.half_width
        return plant, np.concatenate([plant, slope * plant], axis=-1)

    def _at(self, bins: Array) -> Array:
        last = len(self.positions) - 1
        right = np.clip(np.searchsorted(self.positions, bins), 1, last)
        nearer = bins - self.positions[right - 1] < self.positions[right] - bins
        return np.asarray(self.values[right - nearer])


def function_basis(functions: LocalFunctions, spectra: Sequence[Spectrum], half_width: int, sample_time: float
                   ) -> FunctionBasis:
    """The basis of checked functions at the bins of some records.

    Raises InputError where a function is not finite, of another shape, or a combination of the others.
    """
    n_samples = max(spectrum.n_samples for spectrum in spectra)
    positions = np.unique(np.concatenate([np.arange(1, s.n_bins + 1) * (n_samples / s.n_samples) for s in spectra]))
    frequencies = positions / (n_samples * sample_time)
    values, names = functions(frequencies)
    check_independent(values, names, frequencies)
    angle = 2.0 * np.pi * frequencies * sample_time
    hold = -np.expm1(-1j * angle) / (1j * angle)
    return FunctionBasis(half_width, len(names), n_samples, positions=positions, values=hold[:, None] * values)
