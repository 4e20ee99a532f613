"""Frequency response of a system linearized at an operating point, inputs held, delays exact."""

from __future__ import annotations

import numpy as np

from .._arrays import Complex, Floats
from ..thermal import System, linearize
from ._operating_point import OperatingPoint

_CHUNK = 1000  # bins at once
_ROUNDING = 1e-9  # of a sample: less of a delay is none


def sampled_response(system: System, frequencies: Floats, sample_time: float, operating_point: OperatingPoint,
                     outputs: tuple[str, ...], inputs: tuple[str, ...]) -> Complex:
    """Response (n_f, n_y, n_u) of the linearization, inputs held over each sample, delays included.

    With x(k+1) = Φ x(k) + Γ u(k), a delay of d samples and f seconds reads y(k) = C x(t_(k-d) - f): the state between
    samples, Φ(h-f) x(k-d-1) + Γ(h-f) u(k-d-1). A voltage follows the current of its
    own sample: D u(k-d), or D u(k-d-1) with a fraction. A factor e^(-iωf) would be that of an input that is not held.
    """
    whole, parts = np.divmod(_delays(system, outputs, inputs) + _ROUNDING * sample_time, sample_time)
    parts = np.where(parts > 2 * _ROUNDING * sample_time, parts, 0.0)
    temperatures = operating_point.temperatures(system)
    plants = {part: linearize(system, temperatures, operating_point.inputs, sample_time=sample_time - part)
              for part in {0.0, *map(float, parts.ravel())}}
    plant = plants[0.0]
    C = np.asarray(plant.C)[[plant.output_labels.index(name) for name in outputs]]
    columns = [plant.input_labels.index(name) for name in inputs]
    D = np.asarray(plant.D)[[plant.output_labels.index(name) for name in outputs]][:, columns]
    held = {part: (np.asarray(one.A), np.asarray(one.B)[:, columns]) for part, one in plants.items()}
    step, push = held[0.0]
    out = np.empty((frequencies.size, len(outputs), len(inputs)), np.complex128)
    for first in range(0, frequencies.size, _CHUNK):
        z = np.exp(2j * np.pi * frequencies[first:first + _CHUNK] * sample_time)[:, None, None]
        x = np.linalg.solve(z * np.eye(len(step)) - step, push.astype(complex))
        for part, (phi, gamma) in held.items():
            own = parts == part
            y = C @ x + D if part == 0.0 else (C @ (phi @ x + gamma) + D) / z
            out[first:first + _CHUNK][:, own] = (y * z**-whole)[:, own]
    return out


def _delays(system: System, outputs: tuple[str, ...], inputs: tuple[str, ...]) -> Floats:
    """Delay from every input to every output [s], (n_y, n_u)."""
    read = np.array([system.sensors[name].delay if name in system.sensors else 0.0 for name in outputs])
    drives = {name: part.drive for table in (system.inputs, system.modules) for name, part in table.items()}
    driven = np.array([drives[name].delay if name in drives else 0.0 for name in inputs])
    return np.asarray(read[:, None] + driven)
