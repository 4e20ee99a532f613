"""Which bins of a frequency response are fitted, and what their joint covariance makes of the estimates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._arrays import Complex, Floats
from ..errors import InputError
from ..identify import FrequencyResponse
from ..thermal import System
from ._response_model import Bins

_CHUNK = 100  # bins whose correlation with their neighbors is computed at once


def bins_of(system: System, G: FrequencyResponse) -> Bins:
    """Bins that are determined and not suspect, and the channels that the system has."""
    known = system.sensor_names or system.lump_names
    outputs = tuple(name for name in G.output_names if name in known)
    inputs = tuple(name for name in G.input_names if name in system.exogenous_names)
    for what, found, own in (("output", outputs, known), ("input", inputs, system.exogenous_names)):
        if not found:
            raise InputError(f"the frequency response has no {what} of the system", where="argument data",
                             expected="one of " + ", ".join(own), remedy="Name the channels like the system's.")
    n_y = len(G.output_names)
    channels = np.array([G.input_names.index(i) * n_y + G.output_names.index(o) for i in inputs for o in outputs])
    spare = G.degrees_of_freedom - n_y - 1
    good = ~np.isnan(G.response).any(axis=(0, 1)) & ~G.suspect & (spare > 0)
    if not good.any():
        raise InputError("no bin of the frequency response can be used: all are undetermined, suspect or short of "
                         "degrees of freedom", where="argument data",
                         remedy="Estimate it with a larger half_width, better poles, or a longer record.")
    index = _independent(G, np.flatnonzero(good))
    measured = G.response.transpose(2, 1, 0).reshape(len(G), -1)[index][:, channels]
    covariance = np.moveaxis(G.covariance[np.ix_(channels, channels, index)], -1, 0)
    return Bins(index, channels, outputs, inputs, measured, _inverse_roots(covariance, G.frequencies[index]))


def _independent(G: FrequencyResponse, index: NDArray[np.intp]) -> NDArray[np.intp]:
    """All bins if the response knows their correlation (one from a file does not); else one per window."""
    if not G.half_width or index.size < 2:
        return index
    pair = G.joint_covariance(index[:2])
    half = len(pair) // 2
    return index if np.any(pair[:half, half:]) else index[::2 * G.half_width + 1]


def independent_freedom(G: FrequencyResponse, bins: Bins) -> float:
    """Degrees of freedom of the noise, all bins together: neighboring bins of a local method share their windows."""
    q = float(G.degrees_of_freedom[bins.index].sum())
    stride = float(np.median(np.diff(bins.index))) if bins.index.size > 1 else 1.0
    return max(q / max((2 * G.half_width + 1) / stride, 1.0), 1.0)


def _inverse_roots(covariance: Complex, frequencies: Floats) -> Complex:
    try:
        return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)), np.complex128)
    except np.linalg.LinAlgError:
        values = np.linalg.eigvalsh(covariance)
        worst = int((values[:, 0] / values[:, -1]).argmin())
        remedy = "Leave that part out with response.between, or a sensor that repeats another."
        raise InputError(f"the covariance of the response at {frequencies[worst]:.4g} Hz is singular",
                         where="argument data", expected="noise in every channel", remedy=remedy) from None


def spread_of_score(G: FrequencyResponse, bins: Bins, J: Complex) -> Floats:
    """M = 2 Re Jᴴ L⁻¹ Σ L⁻ᴴ J, (p, p), with Σ the covariance between neighboring bins too.

    Each side is widened by √(q/(q - n_y - 1)): the weights are estimates themselves, with q degrees of freedom, and a
    bin whose noise happens to look small gets too much weight.
    """
    q = G.degrees_of_freedom[bins.index].astype(float)
    wide = np.sqrt(q / (q - len(G.output_names) - 1.0))
    A = np.einsum("kab,kap->kbp", bins.root.conj(), J * wide[:, None, None])  # L⁻ᴴ J
    n, m, p = A.shape
    if not G.half_width:
        return 2.0 * np.einsum("kap,kaq->pq", (J * wide[:, None, None]).conj(), J * wide[:, None, None]).real
    M = np.zeros((p, p))
    block = len(G.output_names) * len(G.input_names)
    for first in range(0, n, _CHUNK):
        own = slice(first, min(first + _CHUNK, n))
        reach = 4 * G.half_width  # windows are shifted at the ends
        near = np.flatnonzero((bins.index >= bins.index[own][0] - reach) & (bins.index <= bins.index[own][-1] + reach))
        joint = G.joint_covariance(bins.index[near]).reshape(near.size, block, near.size, block)
        at = np.searchsorted(near, np.arange(own.start, own.stop))
        joint = joint[at][:, bins.channels][:, :, :, bins.channels]
        M += 2.0 * np.einsum("kap,kalb,lbq->pq", A[own].conj(), joint, A[near], optimize=True).real
    return (M + M.T) / 2
