"""Controllers that are linear in their gains: PI, PID, PD, or a basis with fixed poles; continuous or sampled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._arrays import Array
from .._checks import quoted
from ..errors import InputError
from ..linear import Plant

_NAMED = {"pi": ("Kp", "Ki"), "pid": ("Kp", "Ki", "Kd"), "pd": ("Kp", "Kd")}


@dataclass(frozen=True)
class Structure:
    """C = Σ gain_k basis_k.

    Basis: 1; 1/s (sampled T z/(z - 1)); s/(τ s + 1) (sampled (z - 1)/(T' z - τ), backward difference); of an order n
    the powers (a/(s + a))^k (sampled (1 - b)^k/(z - b)^k, b = exp(-a T)).
    """

    names: tuple[str, ...]
    filter_time: float
    pole: float
    dt: float

    def basis(self, omega: Array) -> Array:
        """Values of the basis, shape (n_f, n_gains)."""
        z = np.exp(1j * omega * self.dt) if self.dt else None
        columns = []
        for name in self.names:
            if name == "Kp":
                columns.append(np.ones(len(omega), complex))
            elif name == "Ki":
                columns.append(1 / (1j * omega) if z is None else self.dt * z / (z - 1))
            elif name == "Kd":
                tau = self.filter_time
                columns.append(1j * omega / (1j * omega * tau + 1) if z is None else
                               (z - 1) / ((self.dt + tau) * z - tau))
            else:
                columns.append(self._lag(omega, z) ** int(name[1:]))
        return np.stack(columns, axis=1)

    def integral(self, gains: Array) -> float:
        """Integral gain, 0 where the structure has none."""
        return float(gains[self.names.index("Ki")]) if "Ki" in self.names else 0.0

    def _lag(self, omega: Array, z: Array | None) -> Array:
        if z is None:
            return self.pole / (1j * omega + self.pole)
        b = np.exp(-self.pole * self.dt)
        return (1 - b) / (z - b)

    def realized(self, gains: Array) -> Plant:
        """Controller from error to control, one state for every basis function but the constant."""
        gain_of = dict(zip(self.names, np.asarray(gains, float).tolist(), strict=True))
        own = [(gain, *self._state(name)) for name, gain in gain_of.items() if name in ("Ki", "Kd")]
        A = np.diag([one[1] for one in own])
        B = np.array([[one[2]] for one in own]).reshape(len(own), 1)
        C = np.array([[one[0] * one[3] for one in own]]).reshape(1, len(own))
        D = gain_of.get("Kp", 0.0) + sum(one[0] * one[4] for one in own)
        chain = [gain for name, gain in gain_of.items() if name.startswith("c")]
        n = len(chain)
        if n:
            b = np.exp(-self.pole * self.dt) if self.dt else -self.pole
            gain = 1 - b if self.dt else self.pole
            Ac = b * np.eye(n) + gain * np.eye(n, k=-1)
            A = np.block([[A, np.zeros((len(A), n))], [np.zeros((n, len(A))), Ac]])
            B = np.vstack([B, gain * np.eye(n)[:, :1]])
            C = np.hstack([C, np.array([chain])])
        return Plant(A, B, C, np.array([[D]]), self.dt)

    def _state(self, name: str) -> tuple[float, float, float, float]:
        """A, B, C, D of integrator or filtered derivative."""
        T, tau = self.dt, self.filter_time
        if name == "Ki":
            return (1.0, T, 1.0, T) if T else (0.0, 1.0, 1.0, 0.0)
        if T:  # (z - 1)/((T + τ) z - τ)
            a = tau / (T + tau)
            return a, 1.0, (a - 1) / (T + tau), 1 / (T + tau)
        return -1 / tau, 1.0, -1 / tau**2, 1 / tau


def read_structure(structure: object, omega: Array, bandwidth: float | None, dt: float) -> Structure:
    """Structure by its name, or by the number of lags beside proportional and integral action."""
    middle = bandwidth or float(np.exp(np.log(omega).mean()))
    filter_time = 1.0 / float(omega[-1])
    if isinstance(structure, str) and structure in _NAMED:
        return Structure(_NAMED[structure], filter_time, middle, dt)
    if isinstance(structure, int) and not isinstance(structure, bool) and 1 <= structure <= 20:
        return Structure(("Kp", "Ki", *(f"c{k + 1}" for k in range(structure))), filter_time, middle, dt)
    raise InputError(f"structure = {quoted(structure)}", where="argument structure",
                     expected=f"one of {list(_NAMED)}, or a number of lags from 1 to 20")
