"""Local polynomial method: plant and transient are polynomials of frequency within a window. Evers (3.15)-(3.23)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robthermal._arrays import Array
from robthermal.errors import InputError
from robthermal.signals import Record

from .._checks import whole_number
from ._basis import LocalBasis
from ._local import LocalArrays, LocalEstimate
from ._records import as_records, check_excitation, mean_inputs, spectrum_of
from ._response import FrequencyResponse
from ._suspect import suspect_bins


def lpm(record: Record | Sequence[Record], degree: int = 2, half_width: int = 8) -> FrequencyResponse:
    """Frequency response by the local polynomial method, from records that need not be periodic nor in steady state.

    Parameters
    ----------
    record : Record or sequence of Record
        Measured inputs and outputs. Several records are one estimate with a common G and one transient per record.
    degree : int
        Degree of the polynomials of plant and transient [-].
    half_width : int
        Bins on either side of the center that a window uses [-].

    Returns
    -------
    FrequencyResponse
        At the bins k/(N T_s), k = 1 ... (N-1)//2, of the longest record.

    Raises
    ------
    InputError
        For records that do not belong together or do not excite, and for windows without degrees of freedom.

    References
    ----------
    Evers (2021), Sec. 3.3.3, with (4.15) corrected to q = 2l+1 - rank(K).
    Pintelon and Schoukens (2012), System Identification, Sec. 7.2.2.

    Examples
    --------
    >>> import numpy as np
    >>> import robthermal as rt
    >>> u = np.random.default_rng(1).normal(size=600)
    >>> y = np.zeros(600)
    >>> for n in range(599):
    ...     y[n + 1] = 0.5 * y[n] + 0.5 * u[n]
    >>> record = rt.Record(sample_time=0.1, inputs=u, outputs=y + 300.0, input_names=["q"], output_names=["T"])
    >>> G = rt.identify.lpm(record)
    >>> z = np.exp(2j * np.pi * G.frequencies * 0.1)
    >>> bool(abs(G.response[0, 0] - 0.5 / (z - 0.5)).max() < 1e-3)
    True
    """
    records = as_records(record)
    degree = whole_number(degree, "degree", least=0)
    half_width = whole_number(half_width, "half_width", least=1)
    check_excitation([r.inputs for r in records], records[0].input_names)
    basis = LocalBasis(half_width=half_width, degree=degree, n_samples=max(len(r) for r in records))
    return estimate_locally(records, basis, f"lpm, degree {degree}, half_width {half_width}")


def estimate_locally(records: Sequence[Record], basis: LocalBasis, method: str) -> FrequencyResponse:
    """The estimate of checked records with a given local basis, polynomial or with prescribed poles."""
    estimate = LocalEstimate([spectrum_of(r.inputs, r.outputs) for r in records], basis)
    found = estimate.run()
    first = records[0]
    frequencies = np.arange(1.0, estimate.n_bins + 1.0) / (basis.n_samples * first.sample_time)
    notes = undetermined_inputs(found.response, frequencies, first.input_names)
    return FrequencyResponse(
        frequencies=frequencies,
        response=found.response,
        gram=found.gram,
        noise_covariance=estimate.noise if found.noise is None else found.noise,
        noise_variance=found.variance,
        degrees_of_freedom=found.degrees_of_freedom,
        transient=estimate.transient,
        coherence=lambda bins: _coherence(estimate, found, bins),
        suspect=suspect_bins(found.variance, found.degrees_of_freedom, basis.half_width, estimate.rounding),
        input_names=first.input_names,
        output_names=first.output_names,
        operating_point=mean_inputs(records),
        sample_time=first.sample_time,
        n_samples=basis.n_samples,
        method=method,
        half_width=basis.half_width,
        joint=estimate.weights,
        notes=notes,
    )


def _coherence(estimate: LocalEstimate, found: LocalArrays, bins: slice) -> Array:
    explained = estimate.explained(found.response[..., bins], bins)
    total = explained + found.variance[:, bins]
    return np.divide(explained, total, out=np.zeros_like(total), where=total > 0.0)


def undetermined_inputs(response: Array, frequencies: Array, names: Sequence[str]) -> list[str]:
    """What to say about inputs without power (or not distinguishable) in some bins; refuses those without any."""
    notes: list[str] = []
    lost: list[str] = []
    if not np.isnan(np.vdot(response[0], response[0])):  # an input that is lost is so for all outputs
        return notes  # the sum is a number, so all are: half the passes
    for i, name in enumerate(names):
        missing = np.isnan(response[:, i]).any(axis=0)
        if missing.all():
            lost.append(name)
        elif missing.any():
            where = frequencies[missing]
            notes.append(
                f"Input {name!r} cannot be told from the transient and the other inputs in {where.size} bins between "
                f"{where[0]:.3g} and {where[-1]:.3g} Hz: G is NaN there, the other inputs are estimated without it."
            )
    if lost:
        raise InputError(
            f"{', '.join(map(repr, lost))} cannot be told from the transient and the other inputs at any of the "
            f"frequencies {frequencies[0]:.3g} to {frequencies[-1]:.3g} Hz",
            where="inputs",
            remedy="Excite more lines per window, independently of the other inputs, or increase half_width.",
        )
    return notes
