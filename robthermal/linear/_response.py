"""Frequency response and its largest values, in floats: estimates that the certificates then prove."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg import schur

from .._arrays import Array
from ..errors import InputError
from ._systems import Plant

_GRID = 12  # points per interval beside those at the modes
_AROUND = np.array([-3.0, -1.5, -0.8, -0.3, 0.0, 0.3, 0.8, 1.5, 3.0])  # half-widths around a mode
_REFINEMENTS = 30


def responder(plant: Plant) -> Callable[[Array], Array]:
    """Function from frequencies (n_f,) [rad/s], infinity allowed, to responses (n_f, p, m).

    A is brought to triangular form once: no inverse, no eigenvectors.
    """
    n = len(plant.A)
    T, U = schur(plant.A, output="complex") if n else (np.zeros((0, 0)), np.zeros((0, 0)))
    B, C = U.conj().T @ plant.B, plant.C @ U

    def response(omega: Array) -> Array:
        omega = np.atleast_1d(np.asarray(omega, float))
        known = np.isfinite(omega)
        z = np.exp(1j * omega[known] * plant.dt) if plant.dt else 1j * omega[known]
        X = np.zeros((n, len(z), B.shape[1]), complex)
        for i in range(n - 1, -1, -1):
            right = B[i] + np.tensordot(T[i, i + 1:], X[i + 1:], axes=(0, 0))
            X[i] = right / (z - T[i, i])[:, None]
        found = np.broadcast_to(plant.D.astype(complex), (len(omega), *plant.D.shape)).copy()
        found[known] += np.tensordot(C, X, axes=(1, 0)).transpose(1, 0, 2)
        return found

    return response


def modes(plant: Plant) -> tuple[Array, Array]:
    """Frequencies and half-widths of the modes [rad/s]: where a response can be sharp."""
    poles = plant.poles
    if plant.dt:
        poles = np.log(np.where(poles == 0, 1e-300, poles).astype(complex)) / plant.dt
    return abs(poles.imag), np.maximum(abs(poles.real), 1e-12 * abs(poles))


def largest(plant: Plant, edges: Array, size: Callable[[Array, Array], Array]) -> tuple[Array, Array]:
    """Largest value of a function of the response on every interval, and where: modes, a grid, then refined."""
    response = responder(plant)
    low, high = edges[:-1], edges[1:]
    places = [_inside(a, b) for a, b in zip(low, high, strict=True)]
    at, width = modes(plant)
    for point in np.concatenate([np.ravel(at[:, None] + width[:, None] * _AROUND), np.hypot(at, width)]):
        k = int(np.searchsorted(edges, point, side="right")) - 1
        if 0 <= k < len(low):
            places[k] = np.append(places[k], point)
    omega, which = np.concatenate(places), np.repeat(np.arange(len(low)), [len(item) for item in places])
    value = size(response(omega), which)
    best = np.array([np.flatnonzero(which == k)[value[which == k].argmax()] for k in range(len(low))])
    top, where = value[best], omega[best]
    # bracket of each best point: its neighbors in the interval
    a, b = low.copy(), np.where(np.isfinite(high), high, np.maximum(2 * where, 1.0))
    for k in range(len(low)):
        own = omega[which == k]
        below, above = own[own < where[k]], own[own > where[k]]
        a[k] = below.max() if len(below) else where[k]
        b[k] = min(above.min(), b[k]) if len(above) and np.isfinite(above.min()) else where[k]
    return _refine(response, size, a, b, top, where)


def _refine(response: Callable[[Array], Array], size: Callable[[Array, Array], Array], a: Array, b: Array, top: Array,
            where: Array) -> tuple[Array, Array]:
    """Shrink every bracket around its largest point, all intervals at once."""
    which = np.arange(len(top))
    for _ in range(_REFINEMENTS):
        ends = np.isfinite(where)
        left, right = np.where(ends, (a + where) / 2, where), np.where(ends, (b + where) / 2, where)
        for point, is_left in ((left, True), (right, False)):
            value = size(response(point), which)
            better = value > top
            if is_left:
                b, a = np.where(better, where, b), np.where(better, a, point)
            else:
                old = where
                a, b = np.where(better, old, a), np.where(better, b, point)
            top, where = np.where(better, value, top), np.where(better, point, where)
    return top, where


def _inside(a: float, b: float) -> Array:
    if np.isinf(b):
        return np.append(max(a, 1e-3) * np.geomspace(1, 1e6, _GRID), [a, np.inf])
    start = a if a > 0 else b * 1e-6
    return np.concatenate([np.linspace(a, b, _GRID), np.geomspace(start, b, _GRID)])


def read_edges(plant: Plant, edges: Array, where: str = "argument edges") -> Array:
    """Edges of the intervals from 0 to the end, which infinity stands for."""
    found = np.array(edges, float, ndmin=1)
    if found.ndim != 1 or len(found) < 2 or np.isnan(found).any() or np.any(np.diff(found) <= 0):
        raise InputError("edges do not increase", where=where, expected="frequencies [rad/s], shape (n_intervals + 1,)")
    if plant.dt and (np.isinf(found[-1]) or abs(found[-1] - plant.end) <= 1e-9 * plant.end):
        found[-1] = plant.end
    if found[0] != 0 or found[-1] != plant.end or np.any(found[:-1] >= plant.end):
        raise InputError(f"edges from {found[0]:g} to {found[-1]:g} rad/s", where=where,
                         expected=f"from 0 to {plant.end:g} rad/s, so that no frequency is left out")
    return found
