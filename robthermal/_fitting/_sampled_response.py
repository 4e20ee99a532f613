"""Frequency response of a system linearised at an operating point, inputs held, delays exact."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from ..thermal import System, linearize
from ._operating_point import OperatingPoint

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
_CHUNK = 1000  # bins at once
_ROUNDING = 1e-9  # of a sample: less of a delay is none


def sampled_response(system: System, frequencies: Array, sample_time: float, operating_point: OperatingPoint,
                     outputs: tuple[str, ...], inputs: tuple[str, ...]) -> Complex:
    """Response (n_f, n_y, n_u) of the linearisation, inputs held over each sample, delays included.

    With x(k+1) = Φ x(k) + Γ u(k), a delay of d samples and f seconds reads y(k) = C x(t_(k-d) - f): the state between
    samples, Φ(h-f) x(k-d-1) + Γ(h-f) u(k-d-1). A factor e^(-iωf) would be that of an input that is not held.
    """
    plant = linearize(system, operating_point.temperatures(system), operating_point.inputs)
    rows = [plant.output_labels.index(name) for name in outputs]
    columns = [plant.input_labels.index(name) for name in inputs]
    A, B, C = np.asarray(plant.A), np.asarray(plant.B)[:, columns], np.asarray(plant.C)[rows]
    delay = _delays(system, outputs, inputs)
    whole, parts = np.divmod(delay + _ROUNDING * sample_time, sample_time)
    parts = np.where(parts > 2 * _ROUNDING * sample_time, parts, 0.0)
    held = {part: held_over(A, B, sample_time - part) for part in {0.0, *map(float, parts.ravel())}}
    step, push = held[0.0]
    out = np.empty((frequencies.size, len(rows), len(columns)), np.complex128)
    for first in range(0, frequencies.size, _CHUNK):
        z = np.exp(2j * np.pi * frequencies[first:first + _CHUNK] * sample_time)[:, None, None]
        x = np.linalg.solve(z * np.eye(len(A)) - step, push.astype(complex))
        for part, (phi, gamma) in held.items():
            own = parts == part
            y = C @ x if part == 0.0 else C @ (phi @ x + gamma) / z
            out[first:first + _CHUNK][:, own] = (y * z**-whole)[:, own]
    return out


def held_over(A: Array, B: Array, time: float) -> tuple[Array, Array]:
    """What a state and an input held over some time leave in the state at its end."""
    both = np.zeros((A.shape[0] + B.shape[1],) * 2)
    both[:len(A)] = np.hstack([A, B]) * time
    exact = expm(both)[:len(A)]
    return exact[:, :len(A)], exact[:, len(A):]


def _delays(system: System, outputs: tuple[str, ...], inputs: tuple[str, ...]) -> Array:
    """Delay from every input to every output [s], (n_y, n_u)."""
    read = np.array([system.sensors[name].delay if name in system.sensors else 0.0 for name in outputs])
    drives = {name: part.drive for table in (system.inputs, system.modules) for name, part in table.items()}
    driven = np.array([drives[name].delay if name in drives else 0.0 for name in inputs])
    return np.asarray(read[:, None] + driven)
