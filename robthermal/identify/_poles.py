"""Prescribed poles: from numbers, from a model, or from the data by held-out error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from robthermal._arrays import Array
from robthermal.errors import InputError

from ._basis import LocalBasis
from ._records import Spectrum
from ._windows import regression

POLES_EXPECTED = ("continuous-time poles [rad/s] with negative real part, 'auto', 'resonant', an rt.System or a "
                  "python-control model")
_GRID = 18  # candidate poles per search
_BINS = 48  # bins on which candidates are compared, spaced logarithmically
_MOST = 3  # poles the search adds at most
GAIN = 0.02  # relative reduction of the held-out error that pays for one more pole


def given_poles(poles: Any, sample_time: float) -> tuple[Array, bool]:
    """Poles [rad/s], slowest first, and whether surplus ones may be dropped (true for models)."""
    if isinstance(poles, str):
        raise InputError(f"poles is {poles!r}", where="poles", expected=POLES_EXPECTED)
    if callable(getattr(poles, "poles", None)):
        return _checked(_model_poles(poles, sample_time)), True
    try:
        numbers = np.atleast_1d(np.asarray(poles))
    except ValueError as error:
        raise InputError("poles is a ragged nest of lists", where="poles", expected=POLES_EXPECTED) from error
    if numbers.dtype.kind not in "iufc" or numbers.ndim != 1:
        raise InputError(f"poles is {poles!r}", where="poles", expected=POLES_EXPECTED)
    return _checked(numbers.astype(complex)), False


def _model_poles(model: Any, sample_time: float) -> Array:
    """Continuous-time poles of a model; those of a sampled one by the exact map p = log(gamma)/T_s."""
    found = np.atleast_1d(np.asarray(model.poles(), dtype=complex))
    dt = getattr(model, "dt", None)
    if dt is None or dt == 0:
        return found
    found = found[np.abs(found) > 1e-12]  # poles at z = 0 are pure delays: infinitely fast
    return np.log(found) / (sample_time if dt is True else float(dt))


def _checked(poles: Array) -> Array:
    if not poles.size:
        raise InputError("no pole is given", where="poles", expected=POLES_EXPECTED)
    for pole in poles:
        shown = f"{pole.real:g}" if pole.imag == 0 else f"{pole:g}"
        if not np.isfinite(pole):
            raise InputError(f"the pole {shown} is not finite", where="poles", expected=POLES_EXPECTED)
        if pole.real >= 0.0:
            kind = "on the imaginary axis" if pole.real == 0.0 else "unstable"
            raise InputError(
                f"the pole {shown} rad/s is {kind}",
                where="poles",
                expected=POLES_EXPECTED,
                remedy="Time constants tau enter as -1/tau.",
            )
    return poles[np.argsort(np.abs(poles), kind="stable")]


def most_poles(n_points: int, n_u: int, n_y: int, n_records: int) -> int:
    """Poles that leave at least a quarter of the points, and n_y, as degrees of freedom."""
    left = max(n_y, -(-n_points // 4))
    return (n_points - left) // (n_u + n_records) - 1


def poles_from_data(spectra: Sequence[Spectrum], basis: LocalBasis, sample_time: float, most: int) -> Array:
    """Real poles added one by one from a logarithmic grid while they reduce the held-out error of the windows.

    Each row of a window is predicted from the other rows of that window (leave one out, exact for least squares).
    """
    bins = compared_bins(spectra, basis)
    lowest = 2.0 * np.pi / (basis.n_samples * sample_time)  # angular frequency of bin 1 [rad/s]
    grid = -np.geomspace(0.05 * lowest, 0.5 * np.pi / sample_time, _GRID)
    chosen: list[float] = []
    best = np.inf
    for _ in range(max(1, min(_MOST, most))):
        errors = []
        for candidate in grid:
            poles = np.array([*chosen, candidate], dtype=complex) * sample_time
            errors.append(held_out_error(spectra, replace(basis, degree=poles.size, poles=poles), bins))
        if min(errors) > best + np.log1p(-GAIN):
            break
        best = min(errors)
        chosen.append(float(grid[int(np.argmin(errors))]))
    return np.sort(np.array(chosen, dtype=complex))[::-1]


def compared_bins(spectra: Sequence[Spectrum], basis: LocalBasis) -> Array:
    """Bins on which candidates are compared."""
    n_bins = next(s.n_bins for s in spectra if s.n_samples == basis.n_samples)
    return np.unique(np.rint(np.geomspace(1, n_bins, _BINS)).astype(int))


def held_out_error(spectra: Sequence[Spectrum], basis: LocalBasis, bins: Array) -> float:
    """Mean logarithm of the leave-one-out error: the bins count alike, whatever their noise level."""
    problem = regression(spectra, basis, bins)
    scale = np.linalg.norm(problem.K, axis=1, keepdims=True)
    left, sizes, _ = np.linalg.svd(problem.K / np.where(scale == 0.0, 1.0, scale), full_matrices=False)
    left = left * (sizes > 1e-8 * sizes[:, :1])[:, None, :]
    residual = problem.Y - left @ (left.conj().transpose(0, 2, 1) @ problem.Y)
    leverage = np.minimum(np.sum(np.abs(left) ** 2, axis=2), 1.0 - 1e-9)
    held_out = np.mean(np.abs(residual / (1.0 - leverage[..., None])) ** 2, axis=1)
    return float(np.mean(np.log(held_out + np.finfo(float).tiny)))
