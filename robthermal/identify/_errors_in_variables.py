"""Noisy inputs: local estimates that stay consistent, by instruments or by the known variance of the noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robthermal._arrays import Array
from robthermal.errors import InputError
from robthermal.signals import Record

from .._checks import whole_number
from ._basis import LocalBasis
from ._local import LocalEstimate
from ._lpm import undetermined_inputs
from ._noisy_inputs import checked_noise, with_instruments
from ._records import Spectrum, as_records, check_excitation, mean_inputs, rounding_of, spectrum_of
from ._regions import quantile
from ._response import FrequencyResponse
from ._suspect import suspect_bins
from ._windows import Regression, regression

_CHUNK = 2**19  # numbers in the regressors of windows that are solved together: time against memory
_ZERO = 1e-8  # relative singular value below which a window does not determine G


def errors_in_variables(
    record: Record | Sequence[Record],
    *,
    instruments: Mapping[str, ArrayLike | Sequence[ArrayLike]] | None = None,
    noise: Mapping[str, float] | None = None,
    degree: int = 2,
    half_width: int = 8,
) -> FrequencyResponse:
    """Frequency response where a measured input, as the temperature of the room, carries noise of its own.

    `lpm` takes the inputs as exact. Noise in one of them draws its response towards zero, and gives what is missing to
    every input that is correlated with it, as a heater that warms the room. Give either instruments or noise.

    Parameters
    ----------
    record : Record or sequence of Record
        Measured inputs and outputs. Several records are one estimate with a common G and one transient per record.
    instruments : mapping, optional
        Noisy input: a signal that varies with it but not with its noise, shape (n,), in any unit: a second sensor of
        the same room, the set-point of a climate chamber; of several records a list. Every other input is its own.
    noise : mapping, optional
        Noisy input: standard deviation of its white noise [unit of the input], from a data sheet or a quiet record.
    degree : int
        Degree of the local polynomials [-].
    half_width : int
        Bins on either side of the center that a window uses [-].

    Returns
    -------
    FrequencyResponse
        `covariance` contains the noise of the inputs, and `noise_covariance` is that of y - G u. `suspect` marks bins
        where the instrument is too weak or the noise too large a part of the input; `confidence_radius` grows there.
        A note says how far the estimate that takes the inputs as exact lies from this one.

    Raises
    ------
    InputError
        For both or neither of instruments and noise, unknown inputs, instruments of another length or constant, noise
        that is not positive, and as `lpm`.

    References
    ----------
    Soderstrom (2018), Errors-in-Variables Methods in System Identification, ch. 6 (instruments), 7 (bias compensation).
    Pintelon and Schoukens (2012), Sec. 7.2.

    Examples
    --------
    >>> import numpy as np
    >>> import robthermal as rt
    >>> rng = np.random.default_rng(3)
    >>> room, one, other = rng.normal(size=(3, 4000))
    >>> record = rt.Record(sample_time=1.0, inputs=room + 0.5 * one, outputs=2.0 * room, input_names=["room"],
    ...                    output_names=["T"])
    >>> exact, second = rt.identify.lpm(record), room + 0.5 * other
    >>> G = rt.identify.errors_in_variables(record, instruments={"room": second}, half_width=40)
    >>> H = rt.identify.errors_in_variables(record, noise={"room": 0.5}, half_width=40)
    >>> [round(float(abs(x.response.mean())), 1) for x in (exact, G, H)]
    [1.6, 2.0, 2.0]
    """
    records = as_records(record)
    degree = whole_number(degree, "degree", least=0)
    half_width = whole_number(half_width, "half_width", least=1)
    if bool(instruments) == bool(noise):
        raise InputError("both are given" if noise else "neither is given", where="instruments, noise",
                         expected="one of them, for every noisy input",
                         remedy="Use lpm where all inputs are exact.")
    names = records[0].input_names
    check_excitation([r.inputs for r in records], names)
    seen = [r.inputs for r in records]
    spectra = [spectrum_of(u, r.outputs) for u, r in zip(seen, records, strict=True)]
    variance = checked_noise(noise or {}, names, seen)
    beside = None
    if instruments:
        columns = with_instruments(instruments, records, several=not isinstance(record, Record))
        check_excitation(columns, names, where="instruments")
        beside = [replace(s, U=spectrum_of(z, r.outputs).U) for s, z, r in zip(spectra, columns, records, strict=True)]
    basis = LocalBasis(half_width=half_width, degree=degree, n_samples=max(len(r) for r in records))
    found = _estimate(spectra, beside, basis, variance)
    frequencies = np.arange(1, found.response.shape[2] + 1) / (basis.n_samples * records[0].sample_time)
    how = f"instruments of {', '.join(instruments)}" if instruments else f"known noise of {', '.join(noise or {})}"
    doubtful = np.logical_not(np.sqrt(quantile(0.95, found.degrees_of_freedom)) * found.ratio_uncertainty < 1.0)
    return FrequencyResponse(
        frequencies=frequencies,
        response=found.response,
        gram=found.gram,
        noise_covariance=found.noise,
        degrees_of_freedom=found.degrees_of_freedom,
        transient=found.transient,
        suspect=doubtful | suspect_bins(np.einsum("oof->of", found.noise).real, found.degrees_of_freedom, half_width,
                                        rounding_of([r.outputs for r in records])),
        ratio_uncertainty=np.broadcast_to(found.ratio_uncertainty, found.response.shape),
        input_names=names,
        output_names=records[0].output_names,
        operating_point=mean_inputs(records),
        sample_time=records[0].sample_time,
        n_samples=basis.n_samples,
        method=f"errors_in_variables, {how}, degree {degree}, half_width {half_width}",
        half_width=half_width,
        notes=[*undetermined_inputs(found.response, frequencies, names), *_notes(found, doubtful, frequencies, names)],
    )


@dataclass(frozen=True)
class _Found:
    response: Array  # (n_y, n_u, F)
    gram: Array  # (n_u, n_u, F)
    noise: Array  # (n_y, n_y, F)
    degrees_of_freedom: Array
    transient: Array  # (n_y, F)
    ratio_uncertainty: Array  # (F,)
    direct: Array  # (n_y, n_u, F): least squares with the inputs taken as exact
    direct_square: Array  # (n_y, n_u, F): squared radius of its 95 % circle


def _estimate(spectra: Sequence[Spectrum], beside: Sequence[Spectrum] | None, basis: LocalBasis, variance: Array
              ) -> _Found:
    """All windows, a chunk at a time."""
    n_bins = LocalEstimate(spectra, basis).n_bins  # refuses windows without room or degrees of freedom
    parts = []
    width = len(spectra) * basis.n_points * basis.size * (len(spectra) + spectra[0].U.shape[0])
    count = max(16, _CHUNK // width)
    for first in range(1, n_bins + 1, count):
        bins = np.arange(first, min(first + count, n_bins + 1))
        problem = regression(spectra, basis, bins)
        W = problem.K if beside is None else regression(beside, basis, bins).K
        parts.append(_solve(problem, W, variance if beside is None else None, basis.size))
    whole: dict[str, Any] = {key: np.concatenate([part[key] for part in parts], axis=-1) for key in parts[0]}
    return _Found(**whole)


def _solve(problem: Regression, W: Array, variance: Array | None, size: int) -> dict[str, Array]:
    """theta = A^-1 W^H Y: A = W^H K with instruments W; with known noise W = K and A = K^H K less its expectation."""
    K, Y, n_u = problem.K, problem.Y, problem.n_u
    silent = (np.linalg.norm(K, axis=1) == 0.0) | (np.linalg.norm(W, axis=1) == 0.0)  # inputs without any line here
    K, scale = _scaled(np.where(silent[:, None, :], 0.0, K))
    W, _ = _scaled(np.where(silent[:, None, :], 0.0, W))
    rows, columns = K.shape[1:]
    A = W.conj().transpose(0, 2, 1) @ K + silent[:, :, None] * np.eye(columns)
    if variance is not None:
        A = A - _noise_part(problem.K, variance, size, n_u) / (scale[:, :, None] * scale[:, None, :])
        # Not positive definite: the noise is as large as the input, nothing is left to divide by.
        bad = ~(np.linalg.eigvalsh(A)[:, 0] > _ZERO)
    else:
        bad = ~(np.linalg.svd(A, compute_uv=False)[:, -1] > _ZERO)
    weights = np.linalg.inv(np.where(bad[:, None, None], np.eye(columns), A)) @ W.conj().transpose(0, 2, 1)
    theta = weights @ Y
    theta[bad] = np.nan
    plain = _normal_inverse(K) @ (K.conj().transpose(0, 2, 1) @ Y)
    residual = Y - K @ np.where(bad[:, None, None], plain, theta)
    q = rows - columns + silent.sum(axis=1)
    of_g = (weights / scale[:, :, None])[:, -n_u:]
    gram = of_g @ of_g.conj().transpose(0, 2, 1)
    of_u = _input_noise(problem, W, n_u, q) if variance is None else np.broadcast_to(2.0 * variance, (len(K), n_u))
    kappa = np.sqrt(np.einsum("bii->bi", gram).real * of_u).sum(axis=1)
    kappa[bad] = np.inf
    theta, lost = theta / scale[:, :, None], silent[:, -n_u:] | bad[:, None]
    direct, direct_square = _direct(K, Y, plain, scale, q, n_u)
    response = theta[:, -n_u:]
    response[lost], gram[lost], gram.transpose(0, 2, 1)[lost] = np.nan, np.nan, np.nan
    noise = residual.transpose(0, 2, 1) @ residual.conj() / q[:, None, None]
    return {"response": response.transpose(2, 1, 0), "gram": gram.transpose(1, 2, 0),
            "noise": noise.transpose(1, 2, 0), "degrees_of_freedom": q, "ratio_uncertainty": kappa,
            "transient": theta[:, problem.first_transient].T, "direct": direct, "direct_square": direct_square}


def _scaled(K: Array) -> tuple[Array, Array]:
    """Columns of norm 1, or 0, and what they were divided by."""
    scale = np.linalg.norm(K, axis=1)
    scale[scale == 0.0] = 1.0
    return K / scale[:, None, :], scale


def _noise_part(K: Array, variance: Array, size: int, n_u: int) -> Array:
    """E[N^H N] of the regressors: their functions with the input replaced by white noise of `variance` (n_u,)."""
    n_g = size * n_u
    functions = K[:, :, : K.shape[2] - n_g]
    records = functions.shape[2] // size
    stacked = functions.reshape(len(K), -1, records, size).sum(axis=2)[..., ::-1]  # of U: highest power first
    product = stacked.conj().transpose(0, 2, 1) @ stacked
    found = np.zeros((len(K), K.shape[2], K.shape[2]), dtype=complex)
    found[:, -n_g:, -n_g:] = np.einsum("bst,ij->bsitj", product, np.diag(variance)).reshape(len(K), n_g, n_g)
    return found


def _input_noise(problem: Regression, W: Array, n_u: int, q: Array) -> Array:
    """Variance of what the instruments leave of the inputs, (B, n_u): their noise, or more."""
    U = problem.K[:, :, -n_u:]
    fitted = W @ (_normal_inverse(W) @ (W.conj().transpose(0, 2, 1) @ U))
    return np.asarray(np.sum(np.abs(U - fitted) ** 2, axis=1) / q[:, None])


def _direct(K: Array, Y: Array, theta: Array, scale: Array, q: Array, n_u: int) -> tuple[Array, Array]:
    """G by least squares and the squared radius of its circle, both (n_y, n_u, B)."""
    noise = np.sum(np.abs(Y - K @ theta) ** 2, axis=1) / q[:, None]
    spread = (np.einsum("bii->bi", _normal_inverse(K)).real / scale**2)[:, -n_u:]
    square = quantile(0.95, q)[:, None, None] * spread[:, :, None] * noise[:, None, :]
    return (theta / scale[:, :, None])[:, -n_u:].transpose(2, 1, 0), square.transpose(2, 1, 0)


def _normal_inverse(K: Array) -> Array:
    """(K^H K)^-1 of many small problems, for what is compared and not for the estimate; columns of norm 1 or 0."""
    return np.asarray(np.linalg.pinv(K.conj().transpose(0, 2, 1) @ K, rcond=_ZERO, hermitian=True))


def _notes(found: _Found, doubtful: Array, frequencies: Array, names: Sequence[str]) -> list[str]:
    """How far the estimate that takes the inputs as exact is off, and where this one is weak."""
    notes = []
    clear = ~doubtful & np.isfinite(found.response).all(axis=(0, 1))
    for i, name in enumerate(names):
        away, length = (found.direct - found.response)[:, i, clear], np.abs(found.response[:, i, clear])
        mean = np.abs(np.mean(away * np.exp(-1j * np.angle(found.response[:, i, clear])), axis=1)) if clear.any() else 0
        if np.size(mean) and np.any(length.sum() > 0.0):
            share = float(np.max(mean / np.maximum(length.mean(axis=1), np.finfo(float).tiny)))
            beyond = float(np.mean(np.abs(away) ** 2 > found.direct_square[:, i, clear]))
            notes.append(f"Taken as exact, the inputs would give a response to {name!r} that is {100 * share:.2g} % "
                         f"away on average, beyond its own 95 % circle in {100 * beyond:.0f} % of the bins.")
    if doubtful.any():
        where = frequencies[doubtful]
        notes.append(f"In {where.size} bins between {where[0]:.3g} and {where[-1]:.3g} Hz the inputs are not "
                     "significantly larger than their noise: a bias may be left there. Use a better sensor or "
                     "instrument, a wider window, or a longer record.")
    return notes
