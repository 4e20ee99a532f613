"""Local rational method: rational functions with unknown poles, by Levy's linearization. Evers (4.18)-(4.21)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robthermal._arrays import Array
from robthermal.errors import InputError
from robthermal.signals import Record

from .._checks import whole_number
from ._basis import LocalBasis
from ._local import LocalEstimate
from ._lpm import undetermined_inputs
from ._records import as_records, check_excitation, mean_inputs, spectrum_of
from ._response import FrequencyResponse
from ._suspect import suspect_bins
from ._threads import run_all
from ._windows import RANK_TOLERANCE, regression

_CHUNK = 256


def lrm(
    record: Record | Sequence[Record],
    degree: int = 2,
    half_width: int = 8,
    denominator: int = 1,
    iterations: int = 0,
) -> FrequencyResponse:
    """Frequency response by the local rational method with unknown poles.

    Plant and transient share one local denominator D of degree `denominator`, for all outputs. Multiplying by D makes
    the problem linear (Levy); `iterations` repeat it with the rows divided by the last D (Sanathanan and Koerner).
    The output stands among the regressors, so that noise biases the estimate; the covariance is of first order and
    holds at a high signal-to-noise ratio only. When the slow poles are known, `lrmp` has neither fault.

    Parameters
    ----------
    record : Record or sequence of Record
        Measured inputs and outputs. Several records are one estimate with a common G and one transient per record.
    degree : int
        Degree of the numerators of plant and transient [-].
    half_width : int
        Bins on either side of the center that a window uses [-].
    denominator : int
        Degree of the common denominator [-].
    iterations : int
        Sanathanan-Koerner iterations after the first solution [-].

    Returns
    -------
    FrequencyResponse
        Degrees of freedom as an lpm, less the denominator's share per output (rounded down).

    Raises
    ------
    InputError
        As `lpm`.

    References
    ----------
    Evers (2021), Sec. 4.3.3. McKelvey and Guerin (2012), Proc. IFAC SYSID. Levy (1959). Sanathanan and Koerner (1963).

    Examples
    --------
    >>> import numpy as np
    >>> import robthermal as rt
    >>> u = np.random.default_rng(4).normal(size=400)
    >>> y = np.zeros(400)
    >>> for n in range(399):
    ...     y[n + 1] = 0.99 * y[n] + u[n]
    >>> record = rt.Record(sample_time=1.0, inputs=u, outputs=y, input_names=["u"], output_names=["y"])
    >>> G = rt.identify.lrm(record)
    >>> bool(abs(G.response[0, 0] * (np.exp(2j * np.pi * G.frequencies) - 0.99) - 1.0).max() < 1e-3)
    True
    """
    records = as_records(record)
    degree = whole_number(degree, "degree", least=0)
    half_width = whole_number(half_width, "half_width", least=1)
    denominator = whole_number(denominator, "denominator", least=1)
    iterations = whole_number(iterations, "iterations", least=0)
    check_excitation([r.inputs for r in records], records[0].input_names)
    basis = LocalBasis(half_width=half_width, degree=degree, n_samples=max(len(r) for r in records))
    estimate = LocalEstimate([spectrum_of(r.inputs, r.outputs) for r in records], basis)
    share = -(-denominator // estimate.n_y)  # every output pays for its part of the common denominator
    if estimate.nominal_degrees_of_freedom - share < 1:
        raise InputError(
            f"no degrees of freedom left with a denominator of degree {denominator}",
            where="half_width",
            remedy="Increase half_width, or take a lower degree.",
        )
    found = _Arrays.empty(estimate)

    def solve(first: int) -> None:
        bins = np.arange(first, min(first + _CHUNK, estimate.n_bins + 1))
        _solve_chunk(estimate, bins, found, denominator, iterations)

    run_all(solve, range(1, estimate.n_bins + 1, _CHUNK), worth=estimate.n_bins > 4 * _CHUNK)
    frequencies = np.arange(1, estimate.n_bins + 1) / (basis.n_samples * records[0].sample_time)
    notes = undetermined_inputs(found.response, frequencies, records[0].input_names)
    variance = np.einsum("oof->of", found.noise).real
    return FrequencyResponse(
        frequencies=frequencies,
        response=found.response,
        covariance=found.covariance,
        noise_covariance=found.noise,
        degrees_of_freedom=found.degrees_of_freedom,
        transient=found.transient,
        suspect=suspect_bins(variance, found.degrees_of_freedom, half_width, estimate.rounding),
        input_names=records[0].input_names,
        output_names=records[0].output_names,
        operating_point=mean_inputs(records),
        sample_time=records[0].sample_time,
        n_samples=basis.n_samples,
        method=f"lrm, degree {degree}/{denominator}, half_width {half_width}, {iterations} iterations",
        half_width=half_width,
        notes=["Covariance of first order: valid at a high signal-to-noise ratio.", *notes],
    )


@dataclass(frozen=True)
class _Arrays:
    response: Array
    covariance: Array
    noise: Array
    degrees_of_freedom: Array
    transient: Array

    @classmethod
    def empty(cls, estimate: LocalEstimate) -> _Arrays:
        n_y, n_u, n_f = estimate.n_y, estimate.n_u, estimate.n_bins
        return cls(
            response=np.empty((n_y, n_u, n_f), dtype=complex),
            covariance=np.empty((n_y * n_u, n_y * n_u, n_f), dtype=complex),
            noise=np.empty((n_y, n_y, n_f), dtype=complex),
            degrees_of_freedom=np.empty(n_f, dtype=int),
            transient=np.empty((n_y, n_f), dtype=complex),
        )


def _solve_chunk(estimate: LocalEstimate, bins: Array, found: _Arrays, degree: int, iterations: int) -> None:
    """Y_o = K theta_o - sum_s d_s r^s Y_o for all outputs together: the unknowns are theta_1 ... theta_ny, d."""
    problem = regression(estimate.spectra, estimate.basis, bins)
    K, Y, n_u, n_y = problem.K, problem.Y, estimate.n_u, estimate.n_y
    (count, m, n), place = K.shape, bins - 1
    shifts = estimate.offsets(bins) / estimate.basis.half_width
    powers = np.stack([shifts ** (s + 1) for s in range(degree)], axis=-1)  # (B, m, degree)
    A = np.zeros((count, n_y * m, n_y * n + degree), dtype=complex)
    for o in range(n_y):
        A[:, o * m : (o + 1) * m, o * n : (o + 1) * n] = K
        A[:, o * m : (o + 1) * m, n_y * n :] = -powers * Y[:, :, o, None]
    target = Y.transpose(0, 2, 1).reshape(count, n_y * m)
    D = np.ones((count, m), dtype=complex)
    for _ in range(iterations + 1):
        rows = np.tile(1.0 / D, (1, n_y))
        pinv, inside = _scaled_pinv(A * rows[..., None])
        pinv = pinv * rows[:, None, :]  # acts on the unweighted rows
        theta = np.einsum("bnr,br->bn", pinv, target)
        D = 1.0 + np.einsum("bms,bs->bm", powers, theta[:, n_y * n :])
    residual = (target - np.einsum("brn,bn->br", A, theta)).reshape(count, n_y, m) / D[:, None, :]
    rank = np.rint(inside.sum(axis=1)).astype(int)
    q = (n_y * m - rank) // n_y
    with np.errstate(divide="ignore", invalid="ignore"):
        noise = np.einsum("bom,bpm->opb", residual, residual.conj()) / q
    # V = D^-1 times the equation error: the error of theta is pinv (D V).
    constants = np.array([[o * n + n - n_u + i for o in range(n_y)] for i in range(n_u)]).ravel()  # columns stacked
    W = pinv[:, constants].reshape(count, n_u * n_y, n_y, m) * D[:, None, None, :]
    # The sum over outputs and rows in two steps: one einsum over all of it would be many times slower.
    left = np.einsum("baom,opb->bapm", W, noise)
    covariance = left.reshape(count, n_u * n_y, -1) @ W.conj().reshape(count, n_u * n_y, -1).transpose(0, 2, 1)
    G = theta[:, constants]
    undetermined = inside[:, constants] < 1.0 - 1e-6
    G[undetermined] = np.nan
    covariance[undetermined] = np.nan
    covariance.transpose(0, 2, 1)[undetermined] = np.nan
    found.response[..., place] = G.reshape(count, n_u, n_y).transpose(2, 1, 0)
    found.covariance[..., place] = covariance.transpose(1, 2, 0)
    found.noise[..., place], found.degrees_of_freedom[place] = noise, q
    found.transient[:, place] = theta[:, [o * n + problem.first_transient for o in range(n_y)]].T


def _scaled_pinv(A: Array) -> tuple[Array, Array]:
    """Pseudo-inverse with scaled columns, and how far each unknown is determined (1: fully)."""
    scale = np.linalg.norm(A, axis=1)
    scale[scale == 0.0] = 1.0
    left, sizes, right = np.linalg.svd(A / scale[:, None, :], full_matrices=False)
    keep = sizes > RANK_TOLERANCE * sizes[:, :1]
    inverse = np.where(keep, 1.0 / np.where(keep, sizes, 1.0), 0.0)
    pinv = (right.conj().transpose(0, 2, 1) * inverse[:, None, :]) @ left.conj().transpose(0, 2, 1)
    return pinv / scale[:, :, None], np.sum(np.abs(right) ** 2 * keep[..., None], axis=1)
