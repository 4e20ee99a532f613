"""Empirical transfer function estimate: output spectra divided by input spectra. Evers (3.6)-(3.9), (4.7)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robthermal._arrays import Array
from robthermal.errors import InputError
from robthermal.signals import Record

from ._records import as_records, check_excitation, mean_inputs, spectrum_of
from ._response import FrequencyResponse


def etfe(record: Record | Sequence[Record]) -> FrequencyResponse:
    """Quotient of the spectra, for steady-state periodic data and as the baseline of the other estimators.

    No transient is modelled: a record that starts away from its steady state gives T/U as an error (4.8). Only bins
    that are excited are reported. Several records of equal length are averaged before division: least squares over
    the records, which for one input is the weighted mean; their scatter gives the noise. From as many records as
    inputs the noise cannot be estimated: the covariance is then NaN and the confidence radius infinite.

    Parameters
    ----------
    record : Record or sequence of Record
        At least as many records as inputs, of equal length; for periodic data a whole number of periods.

    Returns
    -------
    FrequencyResponse
        At the excited bins, degrees of freedom = records - inputs.

    Raises
    ------
    InputError
        For a constant input, records of different lengths, or fewer records than inputs.

    References
    ----------
    Evers (2021), (3.6)-(3.9) and (4.7)-(4.8).

    Examples
    --------
    >>> import numpy as np
    >>> import robthermal as rt
    >>> u = np.random.default_rng(0).normal(size=100)
    >>> record = rt.Record(sample_time=1.0, inputs=u, outputs=3.0 * u, input_names=["u"], output_names=["y"])
    >>> bool(np.allclose(rt.identify.etfe(record).response, 3.0))
    True
    """
    records = as_records(record)
    first, n_u = records[0], len(records[0].input_names)
    check_equal_lengths(records)
    if len(records) < n_u:
        raise InputError(
            f"{len(records)} record(s) for {n_u} inputs",
            where="record",
            expected="at least as many records as inputs, each with its own excitation",
            remedy="Use lpm, which separates several inputs within one record.",
        )
    check_excitation([r.inputs for r in records], first.input_names)
    spectra = [spectrum_of(r.inputs, r.outputs) for r in records]
    U = np.stack([s.U for s in spectra])  # (M, n_u, F)
    Y = np.stack([s.Y for s in spectra])
    excited = np.abs(U).max(axis=0).min(axis=0) > 0.0
    if not excited.any():
        raise InputError("no frequency at which all inputs are excited", where="inputs", remedy="Use lpm.")
    response, gram, noise = least_squares_over(U[..., excited], Y[..., excited])
    bins = np.flatnonzero(excited) + 1
    return FrequencyResponse(
        frequencies=bins / (len(first) * first.sample_time),
        response=response,
        gram=gram,
        noise_covariance=noise,
        degrees_of_freedom=np.full(bins.size, len(records) - n_u),
        input_names=first.input_names,
        output_names=first.output_names,
        operating_point=mean_inputs(records),
        sample_time=first.sample_time,
        n_samples=len(first),
        method=f"etfe, {len(records)} record(s)",
        notes=["No transient is modelled: valid for periodic data in steady state only."],
    )


def check_equal_lengths(records: Sequence[Record]) -> None:
    """Refuse records whose bins are not the same frequencies."""
    lengths = sorted({len(r) for r in records})
    if len(lengths) > 1:
        raise InputError(
            f"the records have {', '.join(map(str, lengths))} samples",
            where="records",
            expected="records of equal length",
            remedy="Cut them to the same number of samples, or use lpm, which takes different lengths.",
        )
    if lengths[0] < 3:
        raise InputError(f"the record has {lengths[0]} samples", where="record", expected="at least 3 samples")


def least_squares_over(U: Array, Y: Array) -> tuple[Array, Array, Array]:
    """G, (K^H K)^-1 and noise of Y_m = G U_m over experiments m, for U (M, n_u, F) and Y (M, n_y, F); NaN if U is 0."""
    K, Z = U.transpose(2, 0, 1), Y.transpose(2, 0, 1)  # rows of K are the experiments
    scale = np.linalg.norm(K, axis=1)
    silent = scale == 0.0
    scale[silent] = 1.0
    pinv = np.linalg.pinv(K / scale[:, None, :], rcond=1e-9) / scale[:, :, None]
    theta = pinv @ Z
    gram = pinv @ pinv.conj().transpose(0, 2, 1)
    residual = Z - K @ theta
    theta[silent] = np.nan
    gram[silent] = np.nan
    gram.transpose(0, 2, 1)[silent] = np.nan
    q = U.shape[0] - U.shape[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        noise = residual.transpose(0, 2, 1) @ residual.conj() / (q if q > 0 else np.nan)
    return theta.transpose(2, 1, 0), gram.transpose(1, 2, 0), noise.transpose(1, 2, 0)
