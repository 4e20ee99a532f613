"""Local method with prescribed poles or functions: linear in its parameters, exact for known slow poles. Evers 4.4."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robthermal._arrays import Array
from robthermal.errors import InputError
from robthermal.signals import Record

from .._checks import whole_number
from ._basis import LocalBasis
from ._function_basis import function_basis
from ._local_functions import LocalFunctions, local_functions
from ._lpm import estimate_locally
from ._poles import POLES_EXPECTED, given_poles, most_poles, poles_from_data
from ._records import as_records, check_excitation, spectrum_of
from ._resonant_poles import resonant_poles_from_data
from ._response import FrequencyResponse


def lrmp(record: Record | Sequence[Record], poles: Any = None, half_width: int = 8, *, basis: Any = None
         ) -> FrequencyResponse:
    """Frequency response by the local rational method with prescribed poles.

    Plant and transient are, within a window, a constant plus one function per pole, in the variable exp(j omega T_s),
    so that data under zero-order hold are described exactly when the poles are exact. Slow poles that are 30 % wrong
    still remove most of the bias that a polynomial has at the lowest bins.

    Parameters
    ----------
    record : Record or sequence of Record
        Measured inputs and outputs. Several records are one estimate with a common G and one transient per record.
    poles : sequence of complex, "auto", "resonant", System, or python-control model
        Continuous-time poles [rad/s], real part negative. ``"auto"`` chooses up to three real poles by held-out error,
        ``"resonant"`` real poles and complex pairs, up to four poles, and moves them until the error stays.
        Of a model the slowest poles are taken, as many as leave a quarter of the points for the noise.
    half_width : int
        Bins on either side of the center that a window uses [-].
    basis : str, FractionalPole, Diffusion, callable, or sequence of them, optional
        Instead of poles, functions of frequency that the plant is locally a combination of, with a constant: as text
        ("diffusion", "diffusion:held:500" with tau [s], "fractional:0.01:0.5" with corner [rad/s] and order), as
        objects, or callables that turn n frequencies [Hz] into an array (n,) or (n_basis, n).

    Returns
    -------
    FrequencyResponse
        At the bins k/(N T_s), k = 1 ... (N-1)//2, of the longest record.

    Raises
    ------
    InputError
        For poles that are unstable, on the imaginary axis or not numbers; for functions that are not finite, of another
        shape, or combinations of the others at these frequencies; for poles and functions together; and as `lpm`.

    References
    ----------
    Evers (2021), Sec. 4.4-4.5, with the constant added to (4.23) and the exact map p = log(gamma)/T_s.

    Examples
    --------
    >>> import numpy as np
    >>> import robthermal as rt
    >>> u = np.random.default_rng(2).normal(size=400) + 20.0
    >>> y = np.full(400, 300.0)
    >>> a = np.exp(-0.01)                      # one pole at -0.01 rad/s: the record is four time constants long
    >>> for n in range(399):
    ...     y[n + 1] = 298.0 + a * (y[n] - 298.0) + (1.0 - a) * u[n]
    >>> record = rt.Record(sample_time=1.0, inputs=u, outputs=y, input_names=["q"], output_names=["T"])
    >>> G = rt.identify.lrmp(record, poles=[-0.01])
    >>> z = np.exp(2j * np.pi * G.frequencies)
    >>> bool(abs(G.response[0, 0] / ((1.0 - a) / (z - a)) - 1.0).max() < 1e-8)
    True
    """
    if basis is not None:
        if poles is not None:
            raise InputError("poles and basis are given together", where="basis", expected="one of them",
                             remedy="A pole -w is the function FractionalPole(w, 1).")
        return _with_functions(record, local_functions(basis), half_width)
    if poles is None:
        raise InputError("neither poles nor basis is given", where="poles", expected=POLES_EXPECTED)
    records, local, chosen = prepared(record, poles, half_width)
    shown = ", ".join(f"{p.real:.4g}" if p.imag == 0.0 else f"{p:.4g}" for p in chosen)
    return estimate_locally(records, local, f"lrmp, poles {shown} rad/s, half_width {local.half_width}")


def _with_functions(record: Record | Sequence[Record], functions: LocalFunctions, half_width: int
                    ) -> FrequencyResponse:
    records = as_records(record)
    half_width = whole_number(half_width, "half_width", least=1)
    check_excitation([r.inputs for r in records], records[0].input_names)
    spectra = [spectrum_of(r.inputs, r.outputs) for r in records]
    basis = function_basis(functions, spectra, half_width, records[0].sample_time)
    return estimate_locally(records, basis, f"lrmp, {functions.text}, half_width {half_width}")


def prepared(record: Record | Sequence[Record], poles: Any, half_width: int
             ) -> tuple[tuple[Record, ...], LocalBasis, Array]:
    """Checked records, the local basis, and the poles it is made of [rad/s]."""
    records = as_records(record)
    half_width = whole_number(half_width, "half_width", least=1)
    first, n_samples = records[0], max(len(r) for r in records)
    n_u, n_y = len(first.input_names), len(first.output_names)
    most = most_poles((2 * half_width + 1) * len(records), n_u, n_y, len(records))
    automatic = isinstance(poles, str) and poles in ("auto", "resonant")
    if not automatic:
        chosen, may_drop = given_poles(poles, first.sample_time)
        chosen = chosen[: max(1, most)] if may_drop else chosen
    check_excitation([r.inputs for r in records], first.input_names)
    if automatic:
        basis = LocalBasis(half_width=half_width, degree=1, n_samples=n_samples)
        spectra = [spectrum_of(r.inputs, r.outputs) for r in records]
        find = resonant_poles_from_data if poles == "resonant" else poles_from_data
        chosen = find(spectra, basis, first.sample_time, most)
    poles_of_basis = scaled_poles(chosen, first.sample_time)
    return records, LocalBasis(half_width, chosen.size, n_samples, poles=poles_of_basis), chosen


def scaled_poles(poles: Array, sample_time: float) -> Array:
    """p T_s, faster than any sampled signal cut at exp(-50): beyond that exp(p T_s) is zero to rounding."""
    scaled = poles * sample_time
    return np.maximum(scaled.real, -50.0) + 1j * scaled.imag
