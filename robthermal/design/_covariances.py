"""Noise of a Kalman design: declared in the system file, or given."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..errors import InputError
from ._modules import Array
from ._numbers import numbers
from ._observer_model import ObserverModel

Noise = float | Mapping[str, float] | None
_QUIET = 1e-2  # K per sample and lump, where neither the file nor the caller says how much is unmeasured


def process_covariance(model: ObserverModel, given: Noise) -> Array:
    """Covariance of the unmeasured change over a sample [K²]."""
    lumps = model.system.lumps
    declared = np.array([lump.disturbance for lump in lumps.values()])
    if given is None and declared.any():
        return _sampled_disturbance(model, declared)
    values = _per_name(_QUIET if given is None else given, tuple(lumps), "process_noise")
    return np.diag(values**2)


def _sampled_disturbance(model: ObserverModel, density: Array) -> Array:
    """Integral of exp(As) E⁻¹ D² E⁻¹ exp(Aᵀs) over a sample, by the modes of the symmetric conduction."""
    eq = model.equations
    root = np.sqrt(eq.capacity)
    rates, V = np.linalg.eigh(eq.A.toarray() / root[:, None] / root)
    W = (V.T / root * density**2 / root) @ V
    both = rates[:, None] + rates
    slow = np.abs(both) * model.sample_time < 1e-12
    factor = np.where(slow, model.sample_time, np.expm1(both * model.sample_time) / np.where(slow, 1.0, both))
    Q = (V @ (W * factor) @ V.T) / root[:, None] / root
    return 0.5 * (Q + Q.T)


def reading_covariance(model: ObserverModel, given: Noise) -> Array:
    """Covariance of the readings [K²]."""
    if given is None:
        given = {name: model.system.sensors[name].noise for name in model.sensors}
        silent = [name for name, value in given.items() if value <= 0]
        if silent:
            raise InputError(f"sensor {silent[0]!r} declares no noise", where="argument sensor_noise",
                             remedy="Give sensor_noise [K], or noise in the system file.")
    return np.diag(_per_name(given, model.sensors, "sensor_noise") ** 2)


def _per_name(given: float | Mapping[str, float], names: tuple[str, ...], argument: str) -> Array:
    if isinstance(given, Mapping):
        missing = [name for name in names if name not in given]
        if missing:
            raise InputError(f"{missing[0]!r} is missing", where=f"argument {argument}",
                             expected="a number for every one of " + ", ".join(names))
        given = [given[name] for name in names]  # type: ignore[assignment]  # an array from here on
    values = np.broadcast_to(numbers(given, argument), (len(names),))
    if not values.min() > 0:
        raise InputError(f"{argument} has the value {values.min():g}", where=f"argument {argument}",
                         expected="positive standard deviations [K]")
    return values
