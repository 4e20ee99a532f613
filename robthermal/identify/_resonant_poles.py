"""Prescribed poles from the data: real ones and complex pairs, added one by one and then moved together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import scipy

from robthermal._arrays import Array

from ._basis import LocalBasis
from ._poles import GAIN, held_out_error
from ._records import Spectrum

_BINS = 120  # bins on which candidates are compared, spaced logarithmically and around the candidates
_GRID = 30  # sizes of candidates
_DAMPING = (0.02, 0.1, 0.4)  # damping ratios of candidate pairs
_MOST = 4  # poles the search adds at most; a pair is two
_STEPS = 40  # evaluations of one refinement, per pole


def resonant_poles_from_data(spectra: Sequence[Spectrum], basis: LocalBasis, sample_time: float, most: int) -> Array:
    """Real poles and complex pairs that reduce the held-out error of the windows.

    One is added at a time from a grid, and after each all are moved by a simplex search on their sizes and dampings,
    while the error falls by 2 %. Coordinates: log size, and for a pair also the logit of its damping ratio.
    """
    n_bins = next(s.n_bins for s in spectra if s.n_samples == basis.n_samples)
    lowest = 2.0 * np.pi / (basis.n_samples * sample_time)  # angular frequency of bin 1 [rad/s]
    grid = np.geomspace(0.05 * lowest, 0.5 * np.pi / sample_time, _GRID)
    spread = np.unique(np.rint(np.r_[np.geomspace(1, n_bins, _BINS // 2),
                                     np.linspace(1, n_bins, _BINS // 2)]).astype(int))

    def error(groups: Sequence[Array]) -> float:
        poles = np.concatenate([_poles(group) for group in groups]) * sample_time
        return held_out_error(spectra, replace(basis, degree=poles.size, poles=poles), spread)

    limit = max(1, min(_MOST, most))
    chosen: list[Array] = []
    best = np.inf
    while (used := sum(_size(group) for group in chosen)) < limit:
        candidates = [np.array([np.log(size)]) for size in grid]
        if used + 2 <= limit:
            candidates += [np.array([np.log(size), _logit(zeta)]) for size in grid[grid > lowest] for zeta in _DAMPING]
        errors = [error([*chosen, one]) for one in candidates]
        start = [*chosen, candidates[int(np.argmin(errors))]]
        moved, found = _refined(start, error, min(errors))
        if found > best + np.log1p(-GAIN):
            break
        chosen, best = moved, found
    poles = np.concatenate([_poles(group) for group in chosen])
    return np.asarray(poles[np.argsort(np.abs(poles), kind="stable")])


def _size(group: Array) -> int:
    return int(group.size)  # a real pole has one coordinate, a pair two


def _poles(group: Array) -> Array:
    size = np.exp(group[0])
    if group.size == 1:
        return np.array([-size], dtype=complex)
    zeta = 1.0 / (1.0 + np.exp(-group[1]))
    pole = size * (-zeta + 1j * np.sqrt(1.0 - zeta**2))
    return np.array([pole, np.conj(pole)])


def _logit(zeta: float) -> float:
    return float(np.log(zeta / (1.0 - zeta)))


def _refined(groups: Sequence[Array], error: Callable[[Sequence[Array]], float], start: float
             ) -> tuple[list[Array], float]:
    """All coordinates moved together by a simplex search; bounded in effort, never worse than its start."""
    cuts = np.cumsum([group.size for group in groups])[:-1]
    x0 = np.concatenate(groups)
    simplex = np.vstack([x0, x0 + 0.1 * np.eye(x0.size)])
    found = scipy.optimize.minimize(lambda x: error(np.split(np.clip(x, -40.0, 40.0), cuts)), x0, method="Nelder-Mead",
                                    options={"initial_simplex": simplex, "maxfev": _STEPS * x0.size, "xatol": 1e-4,
                                             "fatol": 1e-4})
    if found.fun >= start:
        return list(groups), start
    return np.split(np.clip(found.x, -40.0, 40.0), cuts), float(found.fun)
