"""Before the experiment: which frequencies stay unresolved, what heat it costs, how large the variance of G will be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ._checks import Array, channel_matrix, positive_number
from ._design_model import Modes, Truth, machine_of, slow_poles
from ._design_result import DesignCheck
from ._design_windows import Estimator, Spectra, estimator, noise_free_errors, noise_gain, spectra_of
from ._excitation_set import Excitation
from ._excitation_settings import one_of, per_input

_CHUNK = 512  # lines solved at a time


def design_check(
    u: ArrayLike | Excitation | list[Any],
    *,
    sample_time: float,
    model: Any = None,
    poles: Any = None,
    noise: float | ArrayLike | None = None,
    gain: float | ArrayLike = 1.0,
    method: Literal["lpm", "etfe"] = "lpm",
    degree: int = 2,
    half_width: int = 8,
    tolerance: float = 0.05,
) -> DesignCheck:
    """Judge an excitation before the experiment, which starts at rest with the inputs off.

    Parameters
    ----------
    u : array_like, shape (n,) or (n, n_u), or list of such, or Excitation
        Inputs in their units; a list (or an `Excitation`) is several experiments of equal length, one estimate.
    sample_time : float
        Time between two samples [s].
    model : optional
        Nominal machine: a python-control model or any object with `poles()` [rad/s], such as an rt.System. With a
        state space (its inputs the columns of `u`) the response and the mean temperature rise are told too.
    poles : sequence of complex, optional
        Continuous-time poles [rad/s], -1 / time constant. Give this or `model`.
    noise : float or array_like, shape (n_y,), optional
        Standard deviation of the white noise of each output, in its unit; the expected variance of G needs it.
    gain : float or array_like, shape (n_u,), optional
        Heat per unit of each input [W per unit], for the heat balance and the transient that the inputs share.
    method : {"lpm", "etfe"}, optional
        How G will be estimated: `rt.identify.lpm` or `rt.identify.etfe`.
    degree : int, optional
        As in `rt.identify.lpm` [-].
    half_width : int, optional
        As in `rt.identify.lpm` [bins].
    tolerance : float, optional
        Relative error without noise above which a frequency counts as unresolved [-].

    Returns
    -------
    DesignCheck

    Raises
    ------
    InputError
        Bad signals or settings; unstable poles; a sample time slower than every time constant; an input that is
        constant; windows that do not fit the record.

    Examples
    --------
    A plate with a time constant of ten minutes, one hour of heating:

    >>> import robthermal as rt
    >>> u = rt.signals.multisine(3600, sample_time=1.0, band=(0.0, 0.05), amplitude=5.0, offset=5.0, seed=1)
    >>> check = rt.signals.design_check(u, sample_time=1.0, poles=[-1 / 600], noise=0.01)
    >>> check.mean_heat.tolist(), check.outcome.code
    ([5.0], 'unresolved')
    >>> 0.001 < check.resolved_from < 0.01
    True
    """
    h = positive_number(sample_time, "sample_time", "s")
    signals = _experiments(u, h)
    n_u = signals.shape[2]
    word = one_of(method, "method", ("lpm", "etfe"))
    limit = positive_number(tolerance, "tolerance")
    if limit >= 1.0:
        raise InputError(f"tolerance is {limit:g}", where="argument tolerance", expected="a number between 0 and 1")
    watts = np.array([positive_number(one, "gain", "W per unit") for one in per_input(gain, "gain", n_u)])
    found = slow_poles(model, poles, h)
    machine = None if model is None else machine_of(model, h, n_u)
    spectra = spectra_of(signals)
    estimate = estimator(word, degree, half_width, spectra)
    bins, truths = spectra.excited, [Modes(found * h, watts)] + ([machine] if machine else [])
    gains, errors = _expected(estimate, spectra, signals, truths)
    mean = signals.mean(axis=(0, 1)).round(12)  # a mean of zero up to rounding is zero
    return DesignCheck(
        frequencies=bins / (spectra.n_samples * h),
        poles=found,
        pole_errors=errors[0],
        model_errors=errors[1] if machine else None,
        tolerance=limit,
        noise_gain=gains,
        noise=_noise(noise, len(machine.C) if machine else None),
        response=machine.response(spectra.points(bins)) if machine else None,
        mean_heat=watts * mean + 0.0,
        heat_range=watts[:, None] * np.stack([signals.min(axis=(0, 1)), signals.max(axis=(0, 1))], axis=1),
        energy=float(watts @ mean) * h * spectra.n_samples * len(signals),
        mean_rise=machine.response(np.ones(1, dtype=complex))[..., 0].real @ mean if machine else None,
        sample_time=h,
        n_samples=spectra.n_samples,
        n_experiments=len(signals),
        method=word if word == "etfe" else f"lpm, degree {degree}, half_width {half_width}",
    )


def _expected(
    method: Estimator, spectra: Spectra, signals: Array, truths: Sequence[Truth]
) -> tuple[Array, list[Array]]:
    """Noise gain (n_u, n_f), and for the modes and the machine the noise-free errors (n_y, n_f)."""
    z, bins = spectra.points(np.arange(1, spectra.n_bins + 1)), spectra.excited
    Y = [truth.outputs(z, spectra.U, signals) for truth in truths]
    gains: list[Array] = []
    errors: list[list[Array]] = [[] for _ in truths]
    for part in np.array_split(bins, -(-bins.size // _CHUNK)):
        weights, rows = method.weights(spectra, part), method.windows(part, spectra.n_bins)
        gains.append(noise_gain(weights))
        for place, truth in enumerate(truths):
            G = truth.response(z[part - 1])
            # Modes stand alone; of a machine, what counts is the output that responds most to an input.
            scale = np.abs(G) if isinstance(truth, Modes) else np.abs(G).max(axis=0, keepdims=True)
            errors[place].append(noise_free_errors(weights, rows, Y[place], G, scale))
    return np.concatenate(gains, axis=1), [np.concatenate(one, axis=1) for one in errors]


def _experiments(u: Any, h: float) -> Array:
    """All experiments, (experiments, n, n_u)."""
    if isinstance(u, Excitation):
        if abs(u.sample_time - h) > 1e-9 * h:
            raise InputError(
                f"sample_time is {h:g} s, the excitation was designed for {u.sample_time:g} s",
                where="argument sample_time",
                expected="the same sample time",
            )
        given = list(u.experiments)
    else:
        # A list of numbers is one signal, a list of arrays several experiments.
        given = list(u) if isinstance(u, (list, tuple)) and len(u) and np.ndim(u[0]) else [u]
    checked = []
    for e, one in enumerate(given):
        width = np.shape(one)[1] if np.ndim(one) == 2 else 1
        checked.append(channel_matrix(one, [f"input {i}" for i in range(width)], "u", h, 0.0))
        if checked[e].shape != checked[0].shape or len(checked[e]) < 4:
            raise InputError(
                f"experiment {e} has shape {checked[e].shape}, experiment 0 {checked[0].shape}",
                where="argument u",
                expected="experiments of at least 4 samples, all with the same samples and inputs",
            )
    signals = np.stack(checked)
    for i in range(signals.shape[2]):
        column = signals[..., i]
        if np.all(column.std(axis=1) <= 1e-12 * np.abs(column).max()):
            raise InputError(
                f"input {i} is constant ({column[0, 0]:g}): it does not excite the machine",
                where="argument u",
                expected="inputs that vary in at least one experiment",
            )
    return signals


def _noise(noise: Any, n_y: int | None) -> Array | None:
    """Standard deviation per output; one number serves all outputs of the model."""
    if noise is None:
        return None
    values = np.atleast_1d(np.asarray(noise, dtype=object))
    numbers = [positive_number(value, f"noise[{o}]") for o, value in enumerate(values.ravel())]
    if values.ndim != 1 or not numbers or (n_y is not None and len(numbers) not in (1, n_y)):
        raise InputError(
            f"noise has shape {values.shape}",
            where="argument noise",
            expected="one number, or one per output" + (f" ({n_y})" if n_y else ""),
        )
    return np.array(numbers * (n_y or 1) if len(numbers) == 1 else numbers)
