"""Sampled model of an observer: x⁺ = A_d x + Γ f(x, u), Evers (5.33) with the exact zero-order hold, not Euler."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from .._checks import positive_number
from ..errors import InputError
from ..thermal import Equations, System
from ._modules import Array, check_system


@dataclass(frozen=True)
class ObserverModel:
    """Model of all lumps, sampled, with the sensors an observer reads.

    Parameters
    ----------
    system : System
        System whose lumps are estimated.
    sensors : tuple of str
        Sensors it reads.
    sample_time : float
        Time between two samples [s].
    A_d : ndarray, shape (n, n)
        exp(E⁻¹A h) of the passive network, with the modules' conductance at the reference temperature.
    Gamma : ndarray, shape (n, n)
        (E⁻¹A)⁻¹(A_d - 1)E⁻¹ [K/W]: what held heats do over a sample.
    C : ndarray, shape (n_sensors, n)
        Selects the measured lumps.
    """

    system: System
    sensors: tuple[str, ...]
    sample_time: float
    A_d: Array
    Gamma: Array
    C: Array

    @classmethod
    def of(cls, system: System, sensors: Sequence[str], sample_time: float) -> ObserverModel:
        """Sample a system, checking the sensors.

        Parameters
        ----------
        system : System
            System whose lumps are estimated.
        sensors : sequence of str
            Sensors in use.
        sample_time : float
            Time between samples [s].
        """
        check_system(system)
        h, names = positive_number(sample_time, "sample_time", "s"), check_sensors(system, sensors)
        for name in names:
            sensor = system.sensors[name]
            if sensor.time_constant + sensor.delay > h:
                raise InputError(f"sensor {name!r} lags {sensor.time_constant + sensor.delay:g} s, more than a sample",
                                 where="argument sensors", expected=f"sensors that lag at most {h:g} s; for a "
                                 "certificate sensors that read their lump at once",
                                 remedy="Describe its mass as a lump, linked to the lump it measures.")
        eq = Equations(system)
        n, E = len(system.lumps), eq.capacity
        both = np.zeros((2 * n, 2 * n))
        both[:n, :n], both[:n, n:] = eq.A.toarray() / E[:, None] * h, np.eye(n) * h
        exact = expm(both)[:n]  # the second block is the integral of the exponential: no inverse of A needed
        C = np.array([[float(lump == system.sensors[name].lump) for lump in system.lumps] for name in names])
        return cls(system, names, h, exact[:, :n], exact[:, n:] / E, C)

    @cached_property
    def equations(self) -> Equations:
        """Of the system."""
        return Equations(self.system)

    def exogenous(self, inputs: Mapping[str, float]) -> Array:
        """Heaters, currents and ambients in order; off and nominal where not given.

        Parameters
        ----------
        inputs : ndarray
            Heaters, currents and ambients held over the sample [unit, A, K].
        """
        eq = self.equations
        u, names = eq.nominal(), list(self.system.exogenous_names)
        for name, value in inputs.items():
            if name not in names or not np.isfinite(value):
                raise InputError(f"{name} = {value}", where="argument inputs",
                                 expected="a finite number for one of " + ", ".join(names))
            u[names.index(name)] = value
        return u

    def rest(self, x: Array, u: Array) -> Array:
        """All heat that A x does not hold, f(x, u) [W]: S and R at the estimate.

        Parameters
        ----------
        x : ndarray
            Temperatures of all lumps [K].
        u : ndarray
            Heaters, currents and ambients [unit, A, K].
        """
        eq = self.equations
        return eq.heat(x, u) - eq.A @ x

    def rest_slope(self, x: Array, u: Array) -> Array:
        """∂f/∂x at one point, with the S′ and R′ terms [W/K].

        Parameters
        ----------
        x : ndarray
            Temperatures of all lumps [K].
        u : ndarray
            Heaters, currents and ambients [unit, A, K].
        """
        eq = self.equations
        return (eq.jacobian(x, u) - eq.A).toarray()

    def predict(self, x: Array, u: Array) -> Array:
        """State at the next sample [K].

        Parameters
        ----------
        x : ndarray
            Temperatures of all lumps [K].
        u : ndarray
            Heaters, currents and ambients [unit, A, K].
        """
        return self.A_d @ x + self.Gamma @ self.rest(x, u)

    def measured(self, readings: Array) -> Array:
        """Lump temperatures from sensor readings: gain and offset undone [K].

        Parameters
        ----------
        readings : ndarray
            Readings of the observer's sensors [K].
        """
        T_ref = next(iter(self.system.ambients.values())).temperature
        parts = [self.system.sensors[name] for name in self.sensors]
        gain, offset = np.array([s.gain for s in parts]), np.array([s.offset for s in parts])
        return T_ref + (np.asarray(readings, float) - offset - T_ref) / gain

    def indices(self) -> NDArray[np.intp]:
        """Lump of every sensor."""
        return self.C.argmax(axis=1)


def check_sensors(system: System, sensors: Sequence[str]) -> tuple[str, ...]:
    """Names of sensors, each once, that see every lump."""
    names = _names(sensors)
    hidden = unobservable(system, names)
    lumps = [system.sensors[name].lump for name in names]
    if len(set(lumps)) < len(lumps):
        raise InputError("two of the sensors are on one lump", where="argument sensors", remedy="Name one of them.")
    if hidden:
        raise InputError(f"sensors {', '.join(names)} do not see lumps {', '.join(hidden)}", where="argument sensors",
                         expected="sensors from which every lump can be reconstructed",
                         remedy="Add a sensor on, or next to, one of these lumps.")
    return names


def unobservable(system: System, sensors: Sequence[str]) -> tuple[str, ...]:
    """Lumps that a set of sensors cannot reconstruct, with all modules off.

    Parameters
    ----------
    system : System
        Its conduction is symmetric: modes are orthogonal in the capacities.
    sensors : sequence of str
        Names of the sensors that are read.

    Returns
    -------
    tuple of str
        Lumps with at least a tenth of the heat of a mode that the sensors do not see; empty when all is observable.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.design.unobservable(rt.systems.two_module(), ["T6", "T7"])
    ()
    """
    check_system(system)
    for name in _names(sensors):
        system.thermometer(name, "argument sensors")
    eq = Equations(system)
    warm = np.full(len(system.lumps), next(iter(system.ambients.values())).temperature)
    root = np.sqrt(eq.capacity)
    J = eq.jacobian(warm, eq.nominal()).toarray() / root[:, None] / root
    rates, modes = np.linalg.eigh(0.5 * (J + J.T))
    seen = [system.lump_names.index(system.sensors[name].lump) for name in sensors]
    hidden: set[int] = set()
    first = 0
    for last in range(1, len(rates) + 1):
        if last < len(rates) and rates[last] - rates[last - 1] < 1e-9 * abs(rates[0]):
            continue
        group = modes[:, first:last]  # one eigenvalue: the sensors must tell all of its modes apart
        _, size, Vt = np.linalg.svd(group[seen] / root[seen, None] * root.min())
        rank = int((size > 1e-10).sum())
        share = (group @ Vt[rank:].T) ** 2
        hidden.update(np.flatnonzero((share > 0.1).any(axis=1)).tolist())
        first = last
    return tuple(system.lump_names[i] for i in sorted(hidden))


def _names(sensors: Sequence[str]) -> tuple[str, ...]:
    if isinstance(sensors, str) or not isinstance(sensors, Sequence) or not len(sensors):
        raise InputError(f"sensors = {sensors!r}", where="argument sensors", expected="a list of sensor names")
    return tuple(sensors)
