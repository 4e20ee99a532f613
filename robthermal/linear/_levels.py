"""The H-infinity norm in floats, by level sets of the largest singular value: not on a grid.

Bruinsma and Steinbuch, A fast algorithm to compute the H∞-norm of a transfer function matrix, Systems & Control
Letters 14 (1990); Boyd, Balakrishnan and Kabamba (1989).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .._arrays import Array
from ..errors import InputError
from ._response import modes, responder
from ._systems import Plant, read_plant

_STEP = 1e-6  # relative: levels this close to the largest value are not searched
_ROUNDS = 60


def hinf_norm(system: Any) -> tuple[float, float]:
    """Estimate the H-infinity norm of a stable system and the frequency where it is attained.

    Parameters
    ----------
    system : control.StateSpace or control.TransferFunction
        A stable system.

    Returns
    -------
    norm : float
        Largest singular value over all frequencies, to about 1e-6, in floats.
    frequency : float
        [rad/s]; infinity where the direct gain is largest.

    Raises
    ------
    InputError
        If an eigenvalue of A is not stable.

    Examples
    --------
    >>> import control
    >>> norm, frequency = hinf_norm(control.ss(control.tf([1], [1, 0.2, 1])))
    >>> round(norm, 4), round(frequency, 4)
    (5.0252, 0.9899)
    """
    plant = read_plant(system)
    if not plant.stable:
        raise InputError("an eigenvalue of A is not stable", where="argument system", expected="a stable system",
                         remedy="Close the loop first, or remove cancelled modes.")
    return plant_norm(plant)


def plant_norm(plant: Plant) -> tuple[float, float]:
    """The same for arrays that are known to be stable."""
    response = responder(plant)

    def size(omega: Array) -> Array:
        values = response(omega)
        fine = np.isfinite(values).all(axis=(1, 2))  # a pole on the axis to rounding leaves no number there
        found = np.full(len(values), np.inf)
        found[fine] = np.linalg.norm(values[fine], 2, axis=(1, 2))
        return found

    at, width = modes(plant)
    start = np.concatenate([[0.0, plant.end], at, np.hypot(at, width)])
    start = np.unique(start[start <= plant.end])
    values = size(start)
    top, place = float(values.max()), float(start[values.argmax()])
    for _ in range(_ROUNDS if np.isfinite(top) else 0):
        crossings = _crossings(plant, (1 + _STEP) * top)
        if len(crossings) == 0:
            break
        # every interval above the level lies between two neighbors
        points = np.unique(np.concatenate([crossings, (crossings[1:] + crossings[:-1]) / 2]))
        values = size(points)
        if values.max() <= (1 + _STEP / 10) * top:
            break
        top, place = float(values.max()), float(points[values.argmax()])
    return top, place


def _crossings(plant: Plant, level: float) -> Array:
    """Frequencies where a singular value may equal the level: eigenvalues of the Hamiltonian near the axis."""
    A, B, C, D = _continuous(plant)
    m = B.shape[1]
    R = level**2 * np.eye(m) - D.T @ D
    if len(A) == 0 or np.linalg.eigvalsh(R).min() <= 0:
        return np.zeros(0)
    gain = np.linalg.solve(R, np.hstack([D.T @ C, B.T]))
    own = A + B @ gain[:, :len(A)]
    H = np.block([[own, B @ gain[:, len(A):]], [-C.T @ C - C.T @ D @ gain[:, :len(A)], -own.T]])
    values = np.linalg.eigvals(H)
    near = abs(values.real) <= 1e-5 * abs(values)
    t = np.unique(abs(values.imag[near]))
    return 2 * np.arctan(t) / plant.dt if plant.dt else t


def _continuous(plant: Plant) -> tuple[Array, Array, Array, Array]:
    """System with the same values at t = tan(ωT/2) of the axis; the system itself when it is continuous."""
    A, B, C, D = plant.A, plant.B, plant.C, plant.D
    if not plant.dt:
        return A, B, C, D
    eye = np.eye(len(A))
    root = np.sqrt(2.0)
    both = np.linalg.solve(A + eye, np.hstack([A - eye, B]))
    return both[:, :len(A)], root * both[:, len(A):], root * C @ np.linalg.inv(A + eye), D - C @ both[:, len(A):]
