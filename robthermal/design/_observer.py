"""Observers of all lumps from a few sensors: steady Kalman gain, positive gain, extended Kalman filter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_discrete_are

from ..certify import observer as certify_observer
from ..errors import InputError, Outcome
from ..signals import Record
from ..verification import Certificate
from ._error_box import Interval, Temperatures, blocks, largest_radius
from ._modules import Array
from ._observer_model import ObserverModel
from ._positive import positive_gain

Noise = float | Mapping[str, float] | None
_QUIET = 1e-2  # K per sample and lump, where neither the file nor the caller says how much is unmeasured
_DIRECTIONS = {"symmetric": (-1.0, 1.0), "cooling": (0.0, 1.0), "heating": (-1.0, 0.0)}


class Observer(Protocol):
    """Estimates all lumps; its memory is one vector."""

    @property
    def sample_time(self) -> float:
        """[s]."""

    @property
    def sensors(self) -> tuple[str, ...]:
        """What it reads."""

    def start(self, temperatures: Array) -> Array:
        """Memory at the first sample, from a first guess of all lumps [K]."""

    def estimate(self, memory: Array) -> Array:
        """Estimate of all lumps now, before this sample's readings are used [K]."""

    def step(self, memory: Array, readings: Array, inputs: Mapping[str, float]) -> Array:
        """Memory at the next sample, from this sample's readings [K] and held inputs by name."""


@dataclass(frozen=True)
class Estimate:
    """Estimates along a record.

    Parameters
    ----------
    model : ObserverModel
        Whose lumps.
    time : ndarray, shape (n,)
        [s].
    lumps : ndarray, shape (n, n_lumps)
        Predicted from the samples before [K].
    innovation : ndarray, shape (n, n_sensors)
        Measured minus predicted [K].
    """

    model: ObserverModel
    time: Array
    lumps: Array
    innovation: Array

    def __getitem__(self, lump: str) -> Array:
        """Estimate of one lump [K]."""
        if lump not in self.model.system.lumps:
            raise InputError(f"no lump {lump!r}", where="estimate[...]",
                             expected="one of " + ", ".join(self.model.system.lumps))
        return self.lumps[:, self.model.system.lump_names.index(lump)]

    def plot(self) -> Any:
        """Plot all estimates [°C]; returns the matplotlib axes."""
        from matplotlib import pyplot as plt  # heavy, only when a picture is wanted

        _, ax = plt.subplots(layout="constrained")
        ax.plot(self.time, self.lumps - 273.15, label=self.model.system.lump_names)
        ax.set(xlabel="time [s]", ylabel="temperature [°C]", title="estimate from " + ", ".join(self.model.sensors))
        ax.legend(fontsize="small", ncols=2)
        return ax


@dataclass(frozen=True)
class GainObserver:
    """x̂⁺ = A_d x̂ + Γ f(x̂, u) + L (y - C x̂), S and R at the estimate.

    Parameters
    ----------
    model : ObserverModel
        A_d, Γ, C.
    gain : ndarray, shape (n_lumps, n_sensors)
        L, predictor form, lumps in file order: what `rt.certify.observer` takes.
    method : str
        How it was found.
    outcome : Outcome
        What is known about its error.
    """

    model: ObserverModel
    gain: Array
    method: str
    outcome: Outcome

    @property
    def sample_time(self) -> float:
        """[s]."""
        return self.model.sample_time

    @property
    def sensors(self) -> tuple[str, ...]:
        """What it reads."""
        return self.model.sensors

    def start(self, temperatures: Array) -> Array:
        """Memory at the first sample."""
        return np.asarray(temperatures, float)

    def estimate(self, memory: Array) -> Array:
        """Estimate of all lumps [K]."""
        return memory

    def step(self, memory: Array, readings: Array, inputs: Mapping[str, float]) -> Array:
        """Memory at the next sample."""
        u = self.model.exogenous(inputs)
        return self.model.predict(memory, u) + self.gain @ (self.model.measured(readings) - self.model.C @ memory)

    def run(self, record: Record, initial: ArrayLike | None = None) -> Estimate:
        """Estimate along a record.

        Parameters
        ----------
        record : Record
            Currents, heaters, ambients (nominal where absent) and the sensors this observer reads.
        initial : array_like, shape (n_lumps,), optional
            First guess [K]; default every lump at its nearest reading.

        Returns
        -------
        Estimate
        """
        return along(self, self.model, record, initial)

    def spectral_radius(self, current: Mapping[str, Interval], temperature: Temperatures) -> float:
        """Largest spectral radius of the error with currents and temperatures frozen at the corners of a box.

        Parameters
        ----------
        current : mapping of module to (lower, upper)
            [A], every module named.
        temperature : (lower, upper) or mapping of lump to (lower, upper)
            [K].

        Returns
        -------
        float
            At 1 or above the observer is unstable at some constant current. Below 1 proves nothing yet: that takes
            a certificate.
        """
        return largest_radius(self.model, self.gain, blocks(self.model.system, current, temperature))

    def certify(self, current: Mapping[str, Interval], temperature: Temperatures) -> Certificate:
        """Certificate that the error decays for every temperature, estimate and current of a box.

        Parameters
        ----------
        current : mapping of module to (lower, upper)
            [A], every module named.
        temperature : (lower, upper) or mapping of lump to (lower, upper)
            [K].

        Returns
        -------
        Certificate
            What `rt.certify.observer` returns for this gain; `holds` may be False.
        """
        return certify_observer(self.model.system, gain=self.gain, sensors=list(self.sensors),
                                sample_time=self.sample_time, current=current, temperature=temperature)

    def frozen_limit(self, temperature: Temperatures,
                     direction: Literal["symmetric", "cooling", "heating"] = "symmetric") -> float:
        """Largest current, the same for all modules, with a stable frozen error: no certificate can exceed it.

        Parameters
        ----------
        temperature : (lower, upper) or mapping of lump to (lower, upper)
            [K].
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


@dataclass(frozen=True)
class ExtendedKalmanFilter:
    """Kalman filter with the model linearised at every estimate, for comparison: it comes with no guarantee.

    Parameters
    ----------
    model : ObserverModel
        A_d, Γ, C.
    process, noise, first : ndarray
        Covariances of a sample's disturbance, of the readings and of the first guess [K²].
    """

    model: ObserverModel
    process: Array
    noise: Array
    first: Array

    @property
    def sample_time(self) -> float:
        """[s]."""
        return self.model.sample_time

    @property
    def sensors(self) -> tuple[str, ...]:
        """What it reads."""
        return self.model.sensors

    def start(self, temperatures: Array) -> Array:
        """Memory at the first sample: estimate and covariance."""
        return np.concatenate([np.asarray(temperatures, float), self.first.ravel()])

    def estimate(self, memory: Array) -> Array:
        """Estimate of all lumps [K]."""
        return memory[:len(self.first)]

    def covariance(self, memory: Array) -> Array:
        """Its own idea of the error's covariance [K²]."""
        return memory[len(self.first):].reshape(self.first.shape)

    def step(self, memory: Array, readings: Array, inputs: Mapping[str, float]) -> Array:
        """Memory at the next sample: correct, then predict."""
        x, P, C = self.estimate(memory), self.covariance(memory), self.model.C
        u = self.model.exogenous(inputs)
        K = np.linalg.solve(C @ P @ C.T + self.noise, C @ P).T
        x = x + K @ (self.model.measured(readings) - C @ x)
        left = np.eye(len(x)) - K @ C  # Joseph form: stays positive
        P = left @ P @ left.T + K @ self.noise @ K.T
        M = self.model.A_d + self.model.Gamma @ self.model.rest_slope(x, u)
        return np.concatenate([self.model.predict(x, u), (M @ P @ M.T + self.process).ravel()])

    def run(self, record: Record, initial: ArrayLike | None = None) -> Estimate:
        """Estimate along a record; see `GainObserver.run`."""
        return along(self, self.model, record, initial)


def observer(system: Any, sensors: Sequence[str], *, sample_time: float = 1.0,
             method: Literal["kalman", "positive", "ekf"] = "kalman", process_noise: Noise = None,
             sensor_noise: Noise = None, current: Mapping[str, Interval] | None = None,
             temperature: Temperatures | None = None,
             time_constant: float | None = None) -> GainObserver | ExtendedKalmanFilter:
    """Design an observer of all lumps from a few sensors.

    Parameters
    ----------
    system : System
        Calibrated.
    sensors : sequence of str
        Names of sensors.
    sample_time : float, optional
        [s].
    method : {"kalman", "positive", "ekf"}, optional
        Steady Kalman gain of the passive network; a gain that keeps the error matrix nonnegative and contracts over a
        box; extended Kalman filter.
    process_noise : float or mapping of lump to float, optional
        Standard deviation of the unmeasured change of every lump per sample [K]; default from the lumps' declared
        disturbances, 0.01 K where none is declared.
    sensor_noise : float or mapping of sensor to float, optional
        [K]; default the sensors' declared noise.
    current, temperature
        Box of the positive gain [A], [K].
    time_constant : float, optional
        In which the weighted sum of the errors must decay, for the positive gain [s]; default 1.2 times the fastest
        possible one.

    Returns
    -------
    GainObserver or ExtendedKalmanFilter
        With `.gain` for `rt.certify.observer`, `.run(record)` for a record.

    Raises
    ------
    InputError
        Sensors that do not see every lump, with the lumps; sensors slower than a sample; noise that is not declared.

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
    model = ObserverModel.of(system, sensors, sample_time)
    if method == "positive":
        if current is None or temperature is None:
            raise InputError("no box is given", where="arguments current, temperature",
                             expected='current={"m1": (lower, upper), …} [A] and temperature=(lower, upper) [K]')
        found = positive_gain(model, blocks(system, current, temperature), time_constant)
        return GainObserver(model, found.gain, method, found.outcome)
    Q, R = _process(model, process_noise), _noise(model, sensor_noise)
    P = solve_discrete_are(model.A_d.T, model.C.T, Q, R)
    if method == "ekf":
        return ExtendedKalmanFilter(model, Q, R, P)
    if method != "kalman":
        raise InputError(f"method = {method!r}", where="argument method", expected='"kalman", "positive" or "ekf"')
    L = np.linalg.solve(model.C @ P @ model.C.T + R, model.C @ P @ model.A_d.T).T
    return GainObserver(model, L, method, Outcome(True, "designed", "Steady Kalman gain of the passive network; "
                        "whether it is stable with the modules on is for rt.certify.observer to prove."))


def along(obs: Observer, model: ObserverModel, record: Record, initial: ArrayLike | None) -> Estimate:
    """Run an observer along a record."""
    missing = [name for name in (*obs.sensors, *model.system.modules, *model.system.inputs) if name not in record]
    if missing:
        raise InputError(f"the record has no column {missing[0]!r}", where="argument record",
                         expected="the observer's sensors and every heater and current")
    if abs(record.sample_time - model.sample_time) > 1e-9 * model.sample_time:
        raise InputError(f"the record is sampled every {record.sample_time:g} s", where="argument record",
                         expected=f"{model.sample_time:g} s", remedy="Design the observer for this sample time.")
    Y = np.column_stack([record[name] for name in obs.sensors])
    drive = [name for name in model.system.exogenous_names if name in record.input_names]
    U = np.column_stack([record[name] for name in drive]) if drive else np.zeros((len(Y), 0))
    memory = obs.start(_first(model, Y[0]) if initial is None else np.asarray(initial, float))
    rows = []
    for y, u in zip(Y, U, strict=True):
        rows.append(obs.estimate(memory))
        memory = obs.step(memory, y, dict(zip(drive, u.tolist(), strict=True)))
    X = np.array(rows)
    return Estimate(model, record.time, X, np.array([model.measured(y) for y in Y]) - X @ model.C.T)


def _first(model: ObserverModel, readings: Array) -> Array:
    lumps = [model.system.sensors[name].lump for name in model.sensors]
    known = dict(zip(lumps, model.measured(readings).tolist(), strict=True))
    nearest = model.system.nearest_lumps(lumps)
    mean = float(np.mean(list(known.values())))
    return np.array([known[nearest[name]] if name in nearest else mean for name in model.system.lumps])


def _process(model: ObserverModel, given: Noise) -> Array:
    """Covariance of the unmeasured change over a sample [K²]."""
    lumps = model.system.lumps
    declared = np.array([lump.disturbance for lump in lumps.values()])
    if given is None and declared.any():
        return _sampled_disturbance(model, declared)
    values = _per_name(_QUIET if given is None else given, tuple(lumps), "process_noise")
    return np.diag(values**2)


def _sampled_disturbance(model: ObserverModel, density: Array) -> Array:
    """Integral of exp(As) E⁻¹ D² E⁻¹ exp(Aᵀs) over a sample, by the modes of the symmetric conduction."""
    eq = model.equations
    root = np.sqrt(eq.capacity)
    rates, V = np.linalg.eigh(eq.A.toarray() / root[:, None] / root)
    W = (V.T / root * density**2 / root) @ V
    both = rates[:, None] + rates
    slow = np.abs(both) * model.sample_time < 1e-12
    factor = np.where(slow, model.sample_time, np.expm1(both * model.sample_time) / np.where(slow, 1.0, both))
    Q = (V @ (W * factor) @ V.T) / root[:, None] / root
    return 0.5 * (Q + Q.T)


def _noise(model: ObserverModel, given: Noise) -> Array:
    if given is None:
        given = {name: model.system.sensors[name].noise for name in model.sensors}
        silent = [name for name, value in given.items() if value <= 0]
        if silent:
            raise InputError(f"sensor {silent[0]!r} declares no noise", where="argument sensor_noise",
                             remedy="Give sensor_noise [K], or noise in the system file.")
    return np.diag(_per_name(given, model.sensors, "sensor_noise") ** 2)


def _per_name(given: float | Mapping[str, float], names: tuple[str, ...], argument: str) -> Array:
    if isinstance(given, Mapping):
        missing = [name for name in names if name not in given]
        if missing:
            raise InputError(f"{missing[0]!r} is missing", where=f"argument {argument}",
                             expected="a number for every one of " + ", ".join(names))
        given = [given[name] for name in names]  # type: ignore[assignment]  # an array from here on
    values = np.broadcast_to(np.asarray(given, float), (len(names),))
    if not (np.isfinite(values).all() and values.min() > 0):
        raise InputError(f"{argument} has the value {values.min():g}", where=f"argument {argument}",
                         expected="positive standard deviations [K]")
    return values
