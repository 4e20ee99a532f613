"""Measured plants: frequency responses of python-control or of this package, on one grid in rad/s."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..._arrays import Array
from ..._control import control
from ...errors import InputError
from ...identify import FrequencyResponse

Measured = Any  # control.FrequencyResponseData or identify.FrequencyResponse, 2x2, or a list of them


@dataclass(frozen=True, eq=False)
class MeasuredPlants:
    """Measured plants on one grid, with joint confidence circles.

    Parameters
    ----------
    omega : ndarray, shape (n_f,)
        Frequencies of all plants [rad/s].
    response : ndarray, shape (n_plants, p, m, n_f)
        Measured values; 0 where the data do not determine them, and the circle is infinite.
    radius : ndarray, shape (n_plants, p, m, n_f)
        Radii of circles that hold the true values of all entries, frequencies and plants at once; 0 without covariance.
    covered : ndarray of bool, shape (n_plants,)
        Whether the plant has a covariance.
    """

    omega: Array
    response: Array
    radius: Array
    covered: Array


def read_plants(plants: Measured, dt: float, where: str, size: int | tuple[int, int] = 2, confidence: float = 0.95
                ) -> MeasuredPlants:
    """Check measured plants, and draw the circles around them.

    Parameters
    ----------
    plants : square FRF or list of them
        What the user gave.
    dt : float
        Sample time of the loop [s].
    where : str
        Name of the argument.
    size : int or tuple of int
        Inputs and outputs n that they must have; or outputs and inputs.
    confidence : float
        Probability that all circles hold the true values at once: every finite one of N circles has 1 - (1 - p)/N
        (Bonferroni's inequality, whatever their correlation).
    """
    listed = list(plants) if isinstance(plants, Sequence) else [plants]
    shape = (size, size) if isinstance(size, int) else size
    if not listed:
        raise InputError("no measured plant", where=where,
                         expected=f"at least one {shape[0]}x{shape[1]} frequency response")
    if isinstance(confidence, bool) or not isinstance(confidence, int | float) or not 0.0 < confidence < 1.0:
        raise InputError(f"confidence is {confidence!r}", where="confidence", expected="a number between 0 and 1")
    covered = [isinstance(plant, FrequencyResponse) and plant.has_covariance for plant in listed]
    read = [_one(plant, dt, label(where, k, len(listed)), shape, known)
            for k, (plant, known) in enumerate(zip(listed, covered, strict=True))]
    omega = read[0][0]
    for k, (other, _, _) in enumerate(read):
        if len(other) != len(omega) or not np.allclose(other, omega, rtol=1e-9, atol=0.0):
            raise InputError("its frequencies differ from those of the first plant", where=label(where, k, len(read)),
                             expected="the same frequencies in every plant")
    response, order = np.stack([one for _, one, _ in read]), [one for _, _, one in read]
    radius = np.zeros(response.shape)
    count = max(sum(_circles(plant) for plant, known in zip(listed, covered, strict=True) if known), 1)
    for k, plant in enumerate(listed):
        if covered[k]:
            radius[k] = np.asarray(plant.confidence_radius(1.0 - (1.0 - confidence) / count))[:, :, order[k]]
    known = np.isfinite(response)
    return MeasuredPlants(omega, np.where(known, response, 0.0), np.where(known, radius, np.inf), np.array(covered))


def _circles(plant: FrequencyResponse) -> int:
    """How many entries have a circle: neither infinite nor known to be exact."""
    radius = plant.confidence_radius(0.5)
    return int(np.sum(np.isfinite(radius) & (radius > 0)))


def label(where: str, index: int, count: int) -> str:
    """Name of one of several plants.

    Parameters
    ----------
    where : str
        Name of the argument.
    index, count : int
        Number of the plant, and how many there are.
    """
    return where if count == 1 else f"{where}[{index}]"


def _one(plant: Measured, dt: float, where: str, shape: tuple[int, int], covered: bool) -> tuple[Array, Array, Array]:
    """Frequencies [rad/s] in increasing order, values there, and the order."""
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
    if response.shape[:2] != shape:
        raise InputError(f"{response.shape[0]}x{response.shape[1]} response", where=where,
                         expected=f"{shape[0]}x{shape[1]}")
    order = np.argsort(omega)
    omega, response = omega[order], response[:, :, order]
    _check_grid(omega, np.where(np.isnan(response), 0.0, response) if covered else response, dt, where)
    return omega, response, order


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
