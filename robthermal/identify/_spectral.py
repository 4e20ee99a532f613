"""Spectral analysis: averaged cross and auto spectra of windowed segments. Evers (3.10)-(3.14), (3.13) corrected."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import scipy

from robthermal._arrays import Array
from robthermal.errors import InputError
from robthermal.signals import Record

from .._checks import whole_number
from ._etfe import least_squares_over
from ._lpm import undetermined_inputs
from ._records import as_records, check_excitation, mean_inputs, rounding_level
from ._response import FrequencyResponse

WINDOWS = ("hann", "rectangular")


def spectral(
    record: Record | Sequence[Record], segments: int = 8, window: str = "hann", overlap: float = 0.5
) -> FrequencyResponse:
    """Frequency response by averaged spectra (Welch's method), Phi_yu Phi_uu^-1.

    The window suppresses a transient, it does not remove it: near DC and for slow systems prefer `lpm` or `lrmp`.
    For periodic data take window="rectangular", overlap=0 and segments of whole periods.

    Parameters
    ----------
    record : Record or sequence of Record
        Measured inputs and outputs; the segments of all records are averaged together.
    segments : int
        Segments per record [-]; together they must outnumber the inputs.
    window : {"hann", "rectangular"}
        Window of the segments.
    overlap : float
        Part of a segment shared with the next [-], from 0 to below 1.

    Returns
    -------
    FrequencyResponse
        At the bins of a segment. Degrees of freedom = effective independent segments (Welch) - inputs.

    Raises
    ------
    InputError
        For settings out of range, too few segments, or inputs that do not excite.

    References
    ----------
    Evers (2021), (3.10)-(3.14). The noise is M/(M-n_u) (Phi_yy - Phi_yu Phi_uu^-1 Phi_yu^H). Welch (1967), IEEE Trans.
    Audio Electroacoust. 15, for the number of independent segments under overlap.

    Examples
    --------
    >>> import numpy as np
    >>> import robthermal as rt
    >>> u = np.random.default_rng(0).normal(size=4000)
    >>> record = rt.Record(sample_time=1.0, inputs=u, outputs=3.0 * u, input_names=["u"], output_names=["y"])
    >>> bool(np.allclose(rt.identify.spectral(record).response, 3.0))
    True
    """
    records = as_records(record)
    first, n_u = records[0], len(records[0].input_names)
    segments = whole_number(segments, "segments", least=1)
    if window not in WINDOWS:
        raise InputError(f"window is {window!r}", where="window", expected=f"one of {', '.join(map(repr, WINDOWS))}")
    real = isinstance(overlap, (int, float, np.number)) and not isinstance(overlap, (bool, complex))
    if not real or not 0.0 <= overlap < 1.0:
        raise InputError(f"overlap is {overlap!r}", where="overlap", expected="a number from 0 to below 1")
    check_excitation([r.inputs for r in records], first.input_names)
    length = int(min(len(r) for r in records) / (1.0 + (segments - 1) * (1.0 - overlap)))
    if length < 4:
        raise InputError(f"segments of {length} samples", where="segments", remedy="Take fewer segments.")
    hop = max(1, round(length * (1.0 - overlap)))
    shape = scipy.signal.windows.get_window("hann" if window == "hann" else "boxcar", length)
    shape = shape / np.sqrt(np.sum(shape**2))  # white noise of standard deviation sigma keeps the variance sigma^2
    pieces = [piece for r in records for piece in _pieces(r, length, hop)]
    independent = sum(_independent(shape, hop, len(list(_pieces(r, length, hop)))) for r in records)
    if independent <= n_u:
        raise InputError(
            f"{len(pieces)} segments count as {independent:.1f} independent ones for {n_u} inputs",
            where="segments",
            expected="more independent segments than inputs",
            remedy="Increase segments, or give more records.",
        )
    U = np.stack([_spectrum(u, shape) for u, _ in pieces])
    Y = np.stack([_spectrum(y, shape) for _, y in pieces])
    response, gram, noise = least_squares_over(U, Y)
    count = len(pieces)
    frequencies = np.arange(1, U.shape[2] + 1) / (length * first.sample_time)
    return FrequencyResponse(
        frequencies=frequencies,
        response=response,
        # The sums run over `count` segments, but only `independent` of them carry information of their own.
        gram=gram * (count / independent),
        noise_covariance=noise * ((count - n_u) / count * independent / (independent - n_u)),
        degrees_of_freedom=np.full(frequencies.size, independent - n_u),
        coherence=_coherence(response, U, noise * (count - n_u) / count),
        input_names=first.input_names,
        output_names=first.output_names,
        operating_point=mean_inputs(records),
        sample_time=first.sample_time,
        n_samples=max(len(r) for r in records),
        method=f"spectral, {count} segments of {length} samples, {window} window, overlap {overlap:g}",
        notes=[
            "The transient is suppressed by the window, not estimated.",
            *undetermined_inputs(response, frequencies, first.input_names),
        ],
    )


def _pieces(record: Record, length: int, hop: int) -> Iterator[tuple[Array, Array]]:
    for start in range(0, len(record) - length + 1, hop):
        yield record.inputs[start : start + length], record.outputs[start : start + length]


def _spectrum(part: Array, shape: Array) -> Array:
    """Spectrum of the windowed deviations from the segment's mean, bins 1 ... (length-1)//2, (channels, F)."""
    windowed = (part - part.mean(axis=0)) * shape[:, None]
    half = np.asarray(scipy.fft.rfft(windowed, axis=0)[1 : (shape.size - 1) // 2 + 1].T)
    half[np.abs(half) <= rounding_level(part)[:, None]] = 0.0
    return half


def _independent(shape: Array, hop: int, count: int) -> float:
    """Segments that would carry the same information without overlap: M / (1 + 2 sum (1 - j/M) rho_j^2), Welch."""
    total = 1.0
    for j in range(1, count):
        shift = j * hop
        if shift >= shape.size:
            break
        total += 2.0 * (1.0 - j / count) * float(shape[shift:] @ shape[:-shift]) ** 2
    return count / total


def _coherence(response: Array, U: Array, residual: Array) -> Array:
    explained = (np.abs(np.einsum("oif,mif->mof", response, U)) ** 2).mean(axis=0)
    total = explained + np.einsum("oof->of", residual).real
    return np.divide(explained, total, out=np.zeros_like(total), where=total > 0.0)
