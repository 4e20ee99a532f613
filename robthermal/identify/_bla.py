"""Best linear approximation of a weakly nonlinear system, with noise and nonlinear distortion told apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robthermal._arrays import Array
from robthermal.errors import InputError
from robthermal.signals import Record

from .._checks import whole_number
from ._etfe import check_equal_lengths, least_squares_over
from ._records import as_records, check_excitation, mean_inputs, rounding_of, spectrum_of
from ._response import FrequencyResponse
from ._suspect import suspect_bins

_FAINT = 1e-8  # power of a line relative to the strongest line, below which it is not excited
_ABOVE_FLOOR = 20.0  # power of an excited line relative to the bins between the lines


def bla(records: Record | Sequence[Record], period: int, degree: int = 2, half_width: int = 8) -> FrequencyResponse:
    """Best linear approximation from several realizations of a random-phase multisine, several periods of each.

    The noise is seen between the lines, where a periodic input and a time-invariant system leave nothing but noise and
    transient; the transient is a local polynomial there and is removed from the lines. What then varies from one
    realization to the next beyond the noise is nonlinear distortion: more realizations average it, more periods do not.

    Parameters
    ----------
    records : sequence of Record
        One record per realization of the phases, of equal length; at least one more than inputs.
    period : int
        Samples in a period [-]. Samples before the last whole number of periods are left out.
    degree : int
        Degree of the local polynomial of the transient [-].
    half_width : int
        Bins on either side of a line, on the grid of the whole record, that its transient and noise are taken from [-].

    Returns
    -------
    FrequencyResponse
        At the excited lines. `noise_covariance` is that of the noise, per sample; `nonlinear_covariance` is
        E[Y_S Y_S^H] of one period, DFT normalized by 1/sqrt(period); `covariance` contains both.
        Degrees of freedom = realizations - inputs.

    Raises
    ------
    InputError
        For a period that is not positive or does not fit twice into the records, too few realizations, or no line.

    References
    ----------
    Pintelon and Schoukens (2012), System Identification, Sec. 4.3 and 7.3 (robust method with transient removal).

    Examples
    --------
    >>> import numpy as np
    >>> import robthermal as rt
    >>> rng, records = np.random.default_rng(5), []
    >>> for _ in range(4):
    ...     lines = np.zeros(101, dtype=complex)
    ...     lines[1:100] = np.exp(2j * np.pi * rng.random(99))
    ...     u = np.tile(np.fft.irfft(lines, norm="forward"), 3)
    ...     records.append(rt.Record(sample_time=1.0, inputs=u, outputs=2.0 * u, input_names=["u"], output_names=["y"]))
    >>> G = rt.identify.bla(records, period=200)
    >>> len(G), bool(np.allclose(G.response, 2.0))
    (99, True)
    """
    records = as_records(records)
    degree = whole_number(degree, "degree", least=0)
    half_width = whole_number(half_width, "half_width", least=1)
    period = whole_number(period, "period", least=3)
    check_equal_lengths(records)
    first, n_u, n_periods = records[0], len(records[0].input_names), len(records[0]) // period
    _check_counts(len(records), n_u, n_periods, period, len(first))
    check_excitation([r.inputs for r in records], first.input_names)
    n = n_periods * period
    spectra = [spectrum_of(r.inputs[-n:], r.outputs[-n:]) for r in records]
    U, Y = np.stack([s.U for s in spectra]), np.stack([s.Y for s in spectra])  # (M, n_u, F), (M, n_y, F)
    lines = _excited_lines(U, n_periods)
    between = _between_lines(Y, lines, n_periods, degree, half_width)
    response, gram, total = least_squares_over(U[..., lines - 1], Y[..., lines - 1] - between.transient)
    # On the lines the estimated transient adds its own variance to that of the noise.
    distortion = (total - between.noise * (1.0 + between.leverage)) / n_periods
    nonlinear = _positive_part(distortion)
    n_g = response.shape[0] * n_u
    covariance = np.einsum("ijf,opf->iojpf", gram, total).reshape(n_g, n_g, -1)
    return FrequencyResponse(
        frequencies=lines / (n * first.sample_time),
        response=response,
        covariance=covariance,
        noise_covariance=between.noise,
        nonlinear_covariance=nonlinear,
        degrees_of_freedom=np.full(lines.size, len(records) - n_u),
        transient=between.transient[0],
        suspect=suspect_bins(
            np.einsum("oof->of", between.noise).real,
            np.full(lines.size, between.degrees_of_freedom),
            -(-half_width // n_periods),
            rounding_of([r.outputs for r in records]),
        ),
        input_names=first.input_names,
        output_names=first.output_names,
        operating_point=mean_inputs(records),
        sample_time=first.sample_time,
        n_samples=n,
        method=f"bla, {len(records)} realizations, {n_periods} periods of {period} samples",
        notes=[_advice(distortion * n_periods, between.noise)],
    )


def _check_counts(n_records: int, n_u: int, n_periods: int, period: int, n_samples: int) -> None:
    if n_periods < 2:
        raise InputError(
            f"a period of {period} samples fits {n_periods} times into records of {n_samples} samples",
            where="period",
            expected="records of at least two periods, so that the noise shows between the lines",
        )
    if n_records < n_u + 1:
        raise InputError(
            f"{n_records} realization(s) for {n_u} input(s)",
            where="records",
            expected=f"at least {n_u + 1} records with different random phases",
            remedy="Record more realizations, or use lpm, which does not tell noise from nonlinear distortion.",
        )


def _excited_lines(U: Array, n_periods: int) -> Array:
    """Bins (from 1) that are multiples of the number of periods and carry power in every input."""
    bins = np.arange(1, U.shape[2] + 1)
    on_line = bins % n_periods == 0
    power = (np.abs(U) ** 2).mean(axis=0)  # (n_u, F)
    floor = np.median(power[:, ~on_line], axis=1)
    level = np.maximum(_FAINT * power[:, on_line].max(axis=1), _ABOVE_FLOOR * floor)
    lines = bins[on_line & (power > level[:, None]).all(axis=0)]
    if not lines.size:
        raise InputError(
            f"no line at multiples of 1/period stands out of the input spectrum ({n_periods} periods)",
            where="period",
            expected="the period of the excitation, in samples",
            remedy="Check the period and that all inputs share their lines.",
        )
    return lines


@dataclass(frozen=True)
class _Between:
    """What the bins between the lines say about the lines."""

    transient: Array  # (M, n_y, L)
    noise: Array  # (n_y, n_y, L)
    leverage: Array  # (L,) variance of the transient relative to the noise
    degrees_of_freedom: int


def _between_lines(Y: Array, lines: Array, n_periods: int, degree: int, half_width: int) -> _Between:
    """Local polynomial of the transient through the bins that are no multiples of the number of periods."""
    bins = np.arange(1, Y.shape[2] + 1)
    free = bins[bins % n_periods != 0]
    count = 2 * (half_width - half_width // n_periods)
    q = count - degree - 1
    if q < 1 or count > free.size:
        raise InputError(
            f"half_width {half_width} leaves {count} bins between the lines for {degree + 1} unknowns",
            where="half_width",
            expected=f"more than {degree + 1} bins and not more than the {free.size} of the record",
            remedy="Increase half_width or lower the degree.",
        )
    start = np.clip(np.searchsorted(free, lines) - count // 2, 0, free.size - count)
    rows = free[start[:, None] + np.arange(count)]  # (L, count)
    powers = ((rows - lines[:, None]) / half_width)[..., None] ** np.arange(degree + 1)
    pinv = np.linalg.pinv(powers)  # (L, degree+1, count)
    seen = Y[:, :, rows - 1]  # (M, n_y, L, count)
    theta = np.einsum("lsc,molc->mols", pinv, seen)
    residual = seen - np.einsum("lcs,mols->molc", powers, theta)
    return _Between(
        transient=theta[..., 0],
        noise=np.einsum("molc,mplc->opl", residual, residual.conj()) / (q * Y.shape[0]),
        leverage=np.sum(pinv[:, 0] ** 2, axis=1),
        degrees_of_freedom=q * Y.shape[0],
    )


def _positive_part(matrices: Array) -> Array:
    """Nearest positive semidefinite matrices: a difference of two estimates may be negative, a covariance may not."""
    values, vectors = np.linalg.eigh(matrices.transpose(2, 0, 1))
    kept = (vectors * np.maximum(values, 0.0)[:, None, :]) @ vectors.conj().transpose(0, 2, 1)
    return np.asarray(kept.transpose(1, 2, 0))


def _advice(distortion: Array, noise: Array) -> str:
    """Which of the two dominates the variance of one realization, over all lines and outputs."""
    part, rest = (np.einsum("oof->o", matrix).real for matrix in (distortion, noise))
    if np.any(part > rest):
        return "Nonlinear distortion dominates: take more realizations (more periods do not help), or excite less."
    return "Noise dominates: take more periods or more realizations, or excite more."
