"""Measured plants: frequency responses of python-control or of this package, on one grid in rad/s."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import control
import numpy as np

from ..._arrays import Array
from ...errors import InputError
from ...identify import FrequencyResponse

Measured = Any  # control.FrequencyResponseData or identify.FrequencyResponse, 2x2, or a list of them


def read_plants(plants: Measured, dt: float, where: str, size: int = 2) -> tuple[Array, Array, Array | None]:
    """Frequencies [rad/s], responses (n_plants, n, n, n_f), and 95 % confidence radii of the same shape or None.

    Parameters
    ----------
    plants : square FRF or list of them
        What the user gave.
    dt : float
        Sample time of the loop [s].
    where : str
        Name of the argument.
    size : int
        Inputs and outputs n that they must have.
    """
    listed = list(plants) if isinstance(plants, Sequence) else [plants]
    if not listed:
        raise InputError("no measured plant", where=where, expected=f"at least one {size}x{size} frequency response")
    read = [_one(plant, dt, _label(where, k, len(listed)), size) for k, plant in enumerate(listed)]
    omega = read[0][0]
    for k, (other, _, _) in enumerate(read):
        if len(other) != len(omega) or not np.allclose(other, omega, rtol=1e-9, atol=0.0):
            raise InputError("its frequencies differ from those of the first plant", where=_label(where, k, len(read)),
                             expected="the same frequencies in every plant")
    radii = [radius for _, _, radius in read]
    if all(radius is None for radius in radii):
        return omega, np.stack([response for _, response, _ in read]), None
    filled = [np.zeros((size, size, len(omega))) if radius is None else radius for radius in radii]
    return omega, np.stack([response for _, response, _ in read]), np.stack(filled)


def _label(where: str, index: int, count: int) -> str:
    return where if count == 1 else f"{where}[{index}]"


def _one(plant: Measured, dt: float, where: str, size: int) -> tuple[Array, Array, Array | None]:
    if isinstance(plant, FrequencyResponse):
        omega, response = 2 * np.pi * plant.frequencies, plant.response
        if dt and np.isfinite(plant.sample_time) and not np.isclose(plant.sample_time, dt, rtol=1e-6):
            raise InputError(f"sample time {plant.sample_time:g} s, the loop has {dt:g} s", where=where,
                             expected=f"{dt:g} s", remedy="Measure at the rate of the controllers.")
    elif isinstance(plant, control.FrequencyResponseData):
        omega, response = np.asarray(plant.omega, dtype=float), np.asarray(plant.frdata)
    else:
        raise InputError(f"{type(plant).__name__} is not a frequency response", where=where,
                         expected="a control.FrequencyResponseData or an rt.identify frequency response")
    if response.shape[:2] != (size, size):
        raise InputError(f"{response.shape[0]}x{response.shape[1]} response", where=where, expected=f"{size}x{size}")
    order = np.argsort(omega)
    omega, response = omega[order], response[:, :, order]
    _check_grid(omega, response, dt, where)
    return omega, response, _radius(plant, order)


def _check_grid(omega: Array, response: Array, dt: float, where: str) -> None:
    if len(omega) < 2:
        raise InputError(f"{len(omega)} frequencies", where=where, expected="at least two")
    bad = ~np.isfinite(omega) | ~np.all(np.isfinite(response), axis=(0, 1))
    if np.any(bad):
        first = int(np.argmax(bad))
        raise InputError(f"NaN or infinite value at index {first} ({omega[first]:.6g} rad/s)", where=where,
                         expected="finite numbers", remedy="Leave those frequencies out.")
    if omega[0] < 0 or np.any(np.diff(omega) <= 0):
        raise InputError("negative or repeated frequencies", where=where, expected="increasing frequencies [rad/s]")
    if dt and omega[-1] > np.pi / dt * (1 + 1e-9):
        raise InputError(f"frequency {omega[-1]:.6g} rad/s above the Nyquist frequency {np.pi / dt:.6g} rad/s",
                         where=where, expected="frequencies up to pi/dt",
                         remedy="python-control frequencies are rad/s; CSV files have Hz.")


def _radius(plant: Measured, order: Array) -> Array | None:
    if not isinstance(plant, FrequencyResponse) or not plant.has_covariance:
        return None
    radius = np.asarray(plant.confidence_radius(0.95))[:, :, order]
    return radius if np.any(radius > 0) else None
