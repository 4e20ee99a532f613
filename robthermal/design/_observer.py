"""Observers of all lumps from a few sensors, with a constant gain: steady Kalman, positive, or from an LMI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.linalg import solve_discrete_are

from .._checks import positive_number
from ..certify import observer as certify_observer
from ..errors import InputError, Outcome
from ..verification import Certificate
from ._covariances import Noise, process_covariance, reading_covariance
from ._error_box import Block, Interval, Temperatures, blocks, check_box, largest_radius
from ._estimate import Observer
from ._export_observer import export
from ._extended import ExtendedKalmanFilter
from ._modules import Array
from ._observer_model import ObserverModel
from ._outcomes import DesignCode
from ._positive import positive_gain
from ._robust_gain import helpful_sensors, robust_gain

_METHODS = ("kalman", "positive", "lmi", "ekf")
_DIRECTIONS = {"symmetric": (-1.0, 1.0), "cooling": (0.0, 1.0), "heating": (-1.0, 0.0)}


@dataclass(frozen=True)
class GainObserver(Observer):
    """x̂⁺ = A_d x̂ + Γ f(x̂, u) + L (y - C x̂), S and R at the estimate.

    Parameters
    ----------
    model : ObserverModel
        A_d, Γ, C.
    gain : ndarray, shape (n_lumps, n_sensors)
        L, predictor form, lumps in file order; acts on lump temperatures, readings with gain and offset undone. What
        `rt.certify.observer` takes for sensors of gain 1; `certify` divides by the others.
    method : str
        How it was found.
    outcome : Outcome
        What is known about its error.
    """

    model: ObserverModel
    gain: Array
    method: str
    outcome: Outcome

    def start(self, temperatures: Array) -> Array:
        return np.asarray(temperatures, float)

    def estimate(self, memory: Array) -> Array:
        return memory

    def step(self, memory: Array, readings: Array, inputs: Mapping[str, float]) -> Array:
        u = self.model.exogenous(inputs)
        return self.model.predict(memory, u) + self.gain @ (self.model.measured(readings) - self.model.C @ memory)

    def export(self, path: str | Path, name: str = "observer") -> None:
        """Write the observer for another program: C99 (.c, .h), MATLAB (.mat) or JSON (.json).

        C gets a state struct, init and step in double, with a test vector; MATLAB and JSON get the matrices and the
        text of the system file.

        Parameters
        ----------
        path : str or path
            File to write, replaced in one step; its ending says which.
        name : str
            Name of the design; in C the prefix of every identifier.

        Raises
        ------
        InputError
            For another ending, or when the file cannot be written.
        """
        export(self.model, self.gain, self.method, path, name)

    def spectral_radius(self, current: Mapping[str, Interval], temperature: Temperatures) -> float:
        """Largest spectral radius of the error with currents and temperatures frozen at the corners of a box.

        Parameters
        ----------
        current : mapping of module to (lower, upper)
            [A], every module named.
        temperature : (lower, upper) or mapping of lump to (lower, upper)
            Temperature range of all lumps, or of each [K].

        Returns
        -------
        float
            At 1 or above the observer is unstable at some constant current. Below 1 proves nothing yet: that takes
            a certificate.
        """
        return largest_radius(self.model, self.gain, blocks(self.model.system, current, temperature))

    def certify(self, current: Mapping[str, Interval], temperature: Temperatures,
                parameters: Mapping[str, Interval] | None = None) -> Certificate:
        """Certificate that the error decays for every temperature, estimate and current of a box.

        Parameters
        ----------
        current : mapping of module to (lower, upper)
            [A], every module named.
        temperature : (lower, upper) or mapping of lump to (lower, upper)
            Temperature range of all lumps, or of each [K].
        parameters : mapping, optional
            Ranges of uncertain numbers of the system, as in `rt.certify.observer`.

        Returns
        -------
        Certificate
            What `rt.certify.observer` returns for this gain; `holds` may be False.
        """
        # the certificate's sensors read gain times their lump, this observer undoes that first
        gain = self.gain / np.array([self.model.system.sensors[name].gain for name in self.sensors])
        return certify_observer(self.model.system, gain=gain, sensors=list(self.sensors),
                                sample_time=self.sample_time, current=current, temperature=temperature,
                                parameters=parameters)

    def frozen_limit(self, temperature: Temperatures,
                     direction: Literal["symmetric", "cooling", "heating"] = "symmetric") -> float:
        """Largest current, the same for all modules, with a stable frozen error: no certificate can exceed it.

        Parameters
        ----------
        temperature : (lower, upper) or mapping of lump to (lower, upper)
            Temperature range of all lumps, or of each [K].
        direction : {"symmetric", "cooling", "heating"}, optional
            Sign of the currents.

        Returns
        -------
        float
            [A], to 0.001 A; 0 if the error is unstable without current, infinite above 1000 A.
        """
        if direction not in _DIRECTIONS:
            raise InputError(f"direction = {direction!r}", where="argument direction",
                             expected="one of " + ", ".join(_DIRECTIONS))
        low, high = 0.0, 0.25

        def stable(size: float) -> bool:
            pair = (_DIRECTIONS[direction][0] * size, _DIRECTIONS[direction][1] * size)
            return self.spectral_radius(dict.fromkeys(self.model.system.modules, pair), temperature) < 1

        while stable(high):
            low, high = high, 2 * high
            if high > 1000:
                return np.inf
        while high - low > 1e-3:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if stable(middle) else (low, middle)
        return low


def observer(system: Any, sensors: Sequence[str], *, sample_time: float = 1.0,
             method: Literal["kalman", "positive", "lmi", "ekf"] = "kalman", process_noise: Noise = None,
             sensor_noise: Noise = None, current: Mapping[str, Interval] | None = None,
             temperature: Temperatures | None = None,
             time_constant: float | None = None) -> GainObserver | ExtendedKalmanFilter:
    """Design an observer of all lumps from a few sensors.

    Parameters
    ----------
    system : System
        System with calibrated parameters.
    sensors : sequence of str
        Names of sensors.
    sample_time : float, optional
        Time between two samples [s].
    method : {"kalman", "positive", "lmi", "ekf"}, optional
        Steady Kalman gain of the passive network; a gain that keeps the error matrix nonnegative and contracts over a
        box; the gain nearest to the Kalman gain whose error decays in one quadratic norm over a box, by a linear matrix
        inequality; extended Kalman filter.
    process_noise : float or mapping of lump to float, optional
        Standard deviation of the unmeasured change of every lump per sample [K]; default from the lumps' declared
        disturbances, 0.01 K where none is declared.
    sensor_noise : float or mapping of sensor to float, optional
        [K]; default the sensors' declared noise.
    current, temperature
        Box of the positive gain and of the matrix inequality [A], [K].
    time_constant : float, optional
        In which the error must decay over the box, for the positive gain (weighted sum; default 1.2 times the fastest
        possible one) and the matrix inequality (quadratic norm; default any) [s].

    Returns
    -------
    GainObserver or ExtendedKalmanFilter
        With `.gain` for `rt.certify.observer`, `.run(record)` for a record. Where the box allows no gain that was
        asked for, `.outcome` is not ok and, for "lmi", names the sensors that would help.

    Raises
    ------
    InputError
        Sensors that do not see every lump, with the lumps; sensors slower than a sample; noise that is not declared; a
        missing box.

    References
    ----------
    Evers (2021), section 5.6; gain (5.39) corrected: L = A P Cᵀ (C P Cᵀ + R)⁻¹ without cross term.

    Examples
    --------
    >>> import robthermal as rt
    >>> obs = rt.design.observer(rt.systems.two_module(), ["T6", "T7"], sample_time=1.0)
    >>> obs.gain.shape
    (18, 2)
    >>> obs.spectral_radius({"m1": (0, 1.5), "m2": (0, 1.5)}, (278.15, 358.15)) < 1
    True
    """
    if method in ("positive", "lmi") and current is not None and temperature is not None:
        check_box(system, current, temperature)
    obs = without_advice(system, sensors, sample_time, method, process_noise, sensor_noise, current, temperature,
                         time_constant)
    if method != "lmi" or obs.outcome or current is None or temperature is None:
        return obs
    helpful = helpful_sensors(obs.model, blocks(system, current, temperature), _factor(sample_time, time_constant))
    advice = f" With one of {', '.join(helpful)} added there is one." if helpful else (
        " No further sensor of the system is enough alone: rt.design.place_sensors(…, keep=[…]) tries sets.")
    return replace(obs, outcome=replace(obs.outcome, text=obs.outcome.text + advice))


def without_advice(system: Any, sensors: Sequence[str], sample_time: float, method: str, process_noise: Noise,
                   sensor_noise: Noise, current: Mapping[str, Interval] | None, temperature: Temperatures | None,
                   time_constant: float | None) -> Any:
    """Design an observer; where it fails, no search for sensors that would help."""
    if method not in _METHODS:
        raise InputError(f"method = {method!r}", where="argument method", expected="one of " + ", ".join(_METHODS))
    model = ObserverModel.of(system, sensors, sample_time)
    found: list[Block] = []
    if method in ("positive", "lmi"):
        if current is None or temperature is None:
            raise InputError("no box is given", where="arguments current, temperature",
                             expected='current={"m1": (lower, upper), …} [A] and temperature=(lower, upper) [K]')
        found = blocks(system, current, temperature)
    if method == "positive":
        gain = positive_gain(model, found, time_constant)
        return GainObserver(model, gain.gain, method, gain.outcome)
    Q, R = process_covariance(model, process_noise), reading_covariance(model, sensor_noise)
    P = solve_discrete_are(model.A_d.T, model.C.T, Q, R)
    if method == "ekf":
        return ExtendedKalmanFilter(model, Q, R, P)
    L = np.linalg.solve(model.C @ P @ model.C.T + R, model.C @ P @ model.A_d.T).T
    if method == "kalman":
        return GainObserver(model, L, method, DesignCode.DESIGNED.outcome(
            "Steady Kalman gain of the passive network; whether it is stable with the modules on is for "
            "rt.certify.observer to prove."))
    L, outcome = robust_gain(model, found, _factor(sample_time, time_constant), L)
    return GainObserver(model, L, method, outcome)


def _factor(sample_time: float, time_constant: float | None) -> float:
    """Decay per sample; 1 where any will do."""
    tau = np.inf if time_constant is None else positive_number(time_constant, "time_constant", "s")
    return float(np.exp(-sample_time / tau))
