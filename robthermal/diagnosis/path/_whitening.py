"""Innovations of the time-varying Kalman filter as a linear map: z = L⁻¹ r, for residuals and sensitivities alike."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, expm

from ..._recursion import recursion
from ...thermal import Equations
from ._filter import compiled_for
from ._random_ambients import RandomAmbients
from ._riccati import filtered, settled, spread

Array = NDArray[np.float64]
Places = NDArray[np.intp]
Kept = TypeVar("Kept")
_IGNORED = 1e6  # K: standard deviation of a missing reading
_BLOCK = 8  # samples whitened in one product
_COLUMNS = 32  # whitened at once: they stay in the cache


class LinearSteps(Protocol):
    """What a filter asks of a linearized record: its steps, their kinds and its sensors."""

    @property
    def one(self) -> Any:
        """The record, with the readings that are missing."""

    @property
    def equations(self) -> Equations:
        """Equations of the system."""

    @property
    def h(self) -> float:
        """Sample time [s]."""

    @property
    def steps(self) -> tuple[Array, Array, Array]:
        """Transition of every sample, and how heat at its start and its end enters."""

    @property
    def C(self) -> Array:
        """Readings by deviations (n_sensors, n_z)."""

    @property
    def M(self) -> Array:
        """Rates of the deviations (n, n_z, n_z) [1/s]."""

    @property
    def kinds(self) -> tuple[Array, Places]:
        """Rates that differ, and which of them every sample has."""

    @property
    def mean(self) -> tuple[Array, Array, Array]:
        """Transition, readings by deviations, and rates of the deviations, each the mean over the samples."""


@dataclass(frozen=True, eq=False)
class SlowNoise:
    """Slow part of the sensors' noise: s(k+1) = pole s(k) + n, independent between sensors, stationary from the start.

    Parameters
    ----------
    std : ndarray, shape (n_sensors,)
        Standard deviation of every sensor's slow noise [K].
    pole : float
        Per sample, between 0 and 1.
    """

    std: Array
    pole: float

    @property
    def covariance(self) -> Array:
        """Of s, (n_sensors, n_sensors) [K²]."""
        return np.diag(self.std**2)

    def beside(self, A: Array, C: Array, Q: Array) -> tuple[Array, Array, Array]:
        """Transition, sensors and noise of [δ; s], from those of the deviations δ; Q and A with or without samples."""
        n, nz, ns = A.shape[:-2], A.shape[-1], self.std.size
        wide_A, wide_Q = np.zeros((*n, nz + ns, nz + ns)), np.zeros((*n, nz + ns, nz + ns))
        wide_A[..., :nz, :nz], wide_A[..., nz:, nz:] = A, self.pole * np.eye(ns)
        wide_Q[..., :nz, :nz], wide_Q[..., nz:, nz:] = Q, (1.0 - self.pole**2) * self.covariance
        return wide_A, np.concatenate([C, np.broadcast_to(np.eye(ns), (*C.shape[:-1], ns))], axis=-1), wide_Q


@dataclass(frozen=True, eq=False)
class Whitener:
    """Maps free-run residuals (n, n_sensors, ...) [K] to white innovations of unit covariance.

    With δ(k+1) = A(k) δ(k) + w, r = C δ + v and the filter started at δ̂ = 0, P = 0 (the start is a parameter of the
    fit), e = r - C δ̂ are the innovations and z = S^(-1/2) e. If the linearized model holds, cov z = 1. The states of a
    slow part of the noise stand behind δ.

    Parameters
    ----------
    A : ndarray, shape (n, n_z, n_z)
        Transition of every sample.
    C : ndarray, shape (n, n_sensors, n_z)
        Readings of the states, sample by sample.
    gains : ndarray, shape (n, n_z, n_sensors)
        Gains of the Kalman filter.
    roots : ndarray, shape (n, n_sensors, n_sensors)
        Inverse Cholesky factors of the innovations' covariance.
    """

    A: Array
    C: Array
    gains: Array
    roots: Array
    _last: dict[tuple[int, ...], tuple[Any, Any]] = field(default_factory=dict, init=False, repr=False)

    def kept(self, of: Sequence[object], made: Callable[[], Kept]) -> Kept:
        """What follows from this filter and some objects, made when it is first asked for; of the last objects alone.

        Parameters
        ----------
        of : sequence
            Objects, compared by identity.
        made : callable
            Makes what follows from them.
        """
        key = tuple(map(id, of))
        if key not in self._last:
            self._last.clear()
            self._last[key] = tuple(of), made()  # kept with it, for another object might get their place
        found: Kept = self._last[key][1]
        return found

    def __call__(self, r: Array, out: Array | None = None) -> Array:
        """Whiten along time, into `out` of the same shape if it is given: columns of a long record are copied once."""
        flat = r.reshape(*r.shape[:2], -1)
        z = np.empty(flat.shape) if out is None else out.reshape(flat.shape)
        compiled = compiled_for(self.C)
        if self._scale is not None:
            np.multiply(self._scale, flat, out=z)
        elif compiled is not None:
            compiled.whitened((self.A, self.C, self.gains, self.roots), flat, z)
        else:
            for first in range(0, flat.shape[2], _COLUMNS):
                z[..., first:first + _COLUMNS] = self._filtered(flat[..., first:first + _COLUMNS])
        return z.reshape(r.shape)

    @cached_property
    def _scale(self) -> Array | None:
        """What every reading is multiplied by, (n, n_sensors, 1); None where readings are combined."""
        diagonal = np.einsum("kii->ki", self.roots)
        if self.gains.any() or np.count_nonzero(self.roots) > np.count_nonzero(diagonal):
            return None
        return np.ascontiguousarray(diagonal[:, :, None])

    @cached_property
    def numbers(self) -> bytes:
        """All that matters of a filter that combines no readings, in few bytes; empty where some are combined."""
        return b"" if self._scale is None else hashlib.sha256(self._scale.tobytes()).digest()

    def _filtered(self, r: Array) -> Array:
        (n, n_sensors, columns), n_z = r.shape, self.A.shape[1]
        carry, out = self._blocks
        readings = np.zeros((len(carry) * _BLOCK, n_sensors, columns))
        readings[:n] = r
        given = np.zeros((len(carry), carry.shape[2], columns))  # state, then readings, of every block
        given[:, n_z:] = readings.reshape(len(carry), -1, columns)
        given[:, :n_z] = recursion(carry[:, :, :n_z], carry[:, :, n_z:] @ given[:, n_z:])[:-1]
        return (out @ given).reshape(readings.shape)[:n]

    @cached_property
    def _blocks(self) -> tuple[Array, Array]:
        """Of `_BLOCK` samples at once: (δ̂, readings) to the δ̂ after them, and to their z; the last is filled up."""
        (n, n_z), n_sensors = self.A.shape[:2], self.C.shape[1]
        inject, weighed = self.A @ self.gains, self.roots @ self.C
        sample = np.zeros((-(-n // _BLOCK), _BLOCK, n_z + n_sensors, n_z + n_sensors))
        sample.reshape(-1, *sample.shape[2:])[:n] = np.block([[self.A - inject @ self.C, inject],
                                                              [-weighed, self.roots]])
        carry = np.zeros((len(sample), n_z, n_z + _BLOCK * n_sensors))
        carry[:, :, :n_z] = np.eye(n_z)
        out = np.empty((len(sample), _BLOCK, n_sensors, carry.shape[2]))
        for j in range(_BLOCK):
            after = sample[:, j, :, :n_z] @ carry
            own = n_z + j * n_sensors
            after[:, :, own:own + n_sensors] += sample[:, j, :, n_z:]
            carry, out[:, j] = after[:, :n_z], after[:, n_z:]
        return np.ascontiguousarray(carry), out.reshape(len(sample), _BLOCK * n_sensors, -1)


def whitener(path: LinearSteps, noise: Array, disturbance: Array, slow: SlowNoise | None = None,
             wandering: RandomAmbients | None = None) -> Whitener:
    """Filter along one record.

    Parameters
    ----------
    path : LinearSteps
        Linearization along the simulated record.
    noise : ndarray, shape (n_sensors,)
        Standard deviation of the record's sensors [K].
    disturbance : ndarray, shape (n_lumps,)
        Random heat of every lump [W/√Hz].
    slow : SlowNoise, optional
        On top of the white noise.
    wandering : RandomAmbients, optional
        Ambients that the record does not hold.
    """
    A, C = path.steps[0], path.C
    n, each = len(A), np.eye(noise.size)
    squares = np.broadcast_to(noise**2, (n, noise.size))
    if path.one.missing is not None:
        squares = squares + _IGNORED**2 * path.one.missing
    if slow is None and wandering is None and not disturbance.any():
        return Whitener(A, C, np.zeros((n, A.shape[1], C.shape[1])), (1.0 / np.sqrt(squares))[:, :, None] * each)
    R = squares[:, :, None] * each
    Q, P = gathered(path, disturbance), np.zeros(A.shape[1:])
    if wandering is not None:
        A, C, Q = wandering.beside(A, C, Q, path.steps[1] + path.steps[2])
        P = block_diag(P, wandering.covariance)
    if slow is not None:
        A, C, Q = slow.beside(A, C, Q)
        P = block_diag(P, slow.covariance)
    return Whitener(A, C, *filtered(A, C, R, Q, P))


def gathered(path: LinearSteps, disturbance: Array, M: Array | None = None) -> Array:
    """Noise gathered in every sample, ∫ e^{Ms} q e^{Mᵀs} ds: Simpson over an eighth, doubled three times."""
    kinds, kind = path.kinds
    one_by_one = M is None
    M = kinds if M is None else M
    q = np.zeros(M.shape[-1])
    q[:disturbance.size] = (disturbance / path.equations.capacity) ** 2
    half = expm(M * (path.h / 16))
    step = half @ half
    Q = (path.h / 48) * (np.diag(q) + 4.0 * (half * q) @ half.swapaxes(-1, -2) + (step * q) @ step.swapaxes(-1, -2))
    for _ in range(3):
        Q, step = Q + step @ Q @ step.swapaxes(-1, -2), step @ step
    return Q[kind] if one_by_one else Q


def heat_spread(path: LinearSteps, disturbance: Array, wandering: RandomAmbients | None = None) -> Array:
    """Mean squares (n_sensors,) of what random heat and ambients do to the readings of a free run [K²].

    Parameters
    ----------
    path : LinearSteps
        Linearization along the simulated record.
    disturbance : ndarray, shape (n_lumps,)
        Random heat of every lump [W/√Hz].
    wandering : RandomAmbients, optional
        Ambients that the record does not hold.
    """
    if wandering is None and not disturbance.any():
        return np.zeros(path.C.shape[1])
    A, C, Q, P = path.steps[0], path.C, gathered(path, disturbance), np.zeros(path.steps[0].shape[1:])
    if wandering is not None:
        A, C, Q = wandering.beside(A, C, Q, path.steps[1] + path.steps[2])
        P = block_diag(P, wandering.covariance)
    P = spread(A, Q, P)
    return np.asarray(np.einsum("ksi,ksi->s", C @ P, C) / len(P), np.float64)


def settled_cost(path: LinearSteps, r: Array, noise: Array, disturbance: Array, slow: SlowNoise | None = None,
                 wandering: RandomAmbients | None = None) -> float:
    """-2 log likelihood of residuals r (n, n_sensors) under the settled filter at the mean of the linearization.

    Good enough for noise levels, and faster than the time-varying filter. Infinite where nothing settles: what no
    sensor sees and no ambient holds.
    """
    A, C, M = path.mean
    Q, R = gathered(path, disturbance, M), np.diag(noise**2)
    if wandering is not None:
        A, C, Q = wandering.beside(A, C, Q, _held(M, path.equations.capacity, path.h))
    if slow is not None:
        A, C, Q = slow.beside(A, C, Q)
    try:
        P = settled(A, C, R, Q)
    except np.linalg.LinAlgError:
        return np.inf
    S = C @ P @ C.T + R
    gain = P @ C.T @ np.linalg.inv(S)
    step = np.broadcast_to(A - A @ gain @ C, (len(r), *A.shape))
    states = recursion(step, (r @ (A @ gain).T)[:, :, None])[:-1, :, 0]  # x(k+1) = (A - A K C) x + A K r
    e = r - states @ C.T
    with np.errstate(over="ignore"):  # of a model that runs away: infinite, and not chosen
        return float(np.sum((e @ np.linalg.inv(S)) * e)) + len(r) * float(np.linalg.slogdet(S)[1])


def _held(M: Array, capacity: Array, h: float) -> Array:
    """How heats into the lumps that are constant over a sample of length h enter deviations with rates M (n_z, n)."""
    n_z, n = len(M), capacity.size
    wide = np.zeros((n_z + n, n_z + n))
    wide[:n_z, :n_z], wide[:n, n_z:] = M, np.diag(1.0 / capacity)
    return np.asarray(expm(wide * h)[:n_z, n_z:], np.float64)
