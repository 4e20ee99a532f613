"""Simulate a system: `simulate` gives a record, `trajectory` everything inside."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, NoReturn

import numpy as np

from .._celsius import ZERO_CELSIUS
from .._drawing import axes_for
from ..errors import InputError
from ..signals import Record
from ._drive import Initial, held_inputs, held_slopes, record_of, start_lumps, start_slope, start_state
from ._equations import Equations
from ._exponential import Integrator, Path
from ._implicit import refuse_memory, run_implicit
from ._jumps import jump_slopes, rates
from ._layout import Layout
from ._schedule import Schedule, schedule
from ._sensitivity import Sensitivity
from ._sensors import lumps_read, read_sampled, read_sensors, reading_slopes
from ._system import System, equations
from ._terms import Array

_DENSE_STATES = 250  # beyond this the dense propagators cost more than sparse implicit steps
_DENSE_HEATS = 120


@dataclass(frozen=True)
class Trajectory:
    """A simulation with everything inside.

    Parameters
    ----------
    system : System
        What was simulated.
    time : ndarray, shape (n,)
        Times of the samples [s].
    lumps : ndarray, shape (n, n_lumps)
        Temperatures of all lumps [K].
    readings : ndarray, shape (n, n_sensors)
        Noise-free sensor readings [K, or V].
    stored, ambient_heat, heater_heat, electrical_energy : ndarray
        Cumulative energies [J]: heat stored in all lumps (n,), received from every ambient (n, n_ambients), from every
        heater (n, n_inputs), electrical energy taken up by every module with its leads (n, n_modules).
    source_heat : ndarray, shape (n,)
        Cumulative heat of all other sources: constant and periodic ones, sensors, condensation, hysteresis [J].
    parameters : tuple of str
        Names of the sensitivities.
    derivative : callable
        Parameter names, and numbers to multiply the derivatives by if any, to those of the readings, (n, n_sensors,
        n_parameters).
    method : str
        "exponential" or "implicit".
    """

    system: System
    time: Array
    lumps: Array
    readings: Array
    stored: Array
    ambient_heat: Array
    heater_heat: Array
    electrical_energy: Array
    source_heat: Array
    parameters: tuple[str, ...]
    derivative: Callable[..., Array] = field(repr=False)
    method: str

    @cached_property
    def sensitivity(self) -> Array:
        """Derivative of the readings by `parameters`, (n, n_sensors, n_parameters); computed when first asked for."""
        return self.derivative(self.parameters) if self.parameters else np.zeros((*self.readings.shape, 0))

    @property
    def energy_residual(self) -> Array:
        """Stored minus received energy [J], (n,): zero to rounding."""
        received = self.ambient_heat.sum(1) + self.heater_heat.sum(1) + self.electrical_energy.sum(1) + self.source_heat
        return self.stored - received

    def __getitem__(self, name: str) -> Array:
        """Temperature of a lump or reading of a sensor by name [K, or V]."""
        if name in self.system.lumps:
            return self.lumps[:, self.system.lump_names.index(name)]
        if name in self.system.sensors:
            return self.readings[:, self.system.sensor_names.index(name)]
        raise InputError(f"no lump or sensor {name!r}", where="trajectory",
                         expected="one of " + ", ".join((*self.system.lumps, *self.system.sensors)))

    def plot(self, ax: Any = None) -> Any:
        """Plot all lump temperatures [°C] against time; returns the matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        ax = axes_for(ax)
        ax.plot(self.time, self.lumps - ZERO_CELSIUS, label=self.system.lump_names)
        ax.set(xlabel="time [s]", ylabel="temperature [°C]", title=self.system.name)
        ax.legend(fontsize="small", ncols=2)
        return ax


def simulate(system: System, record: Record, *, initial: Initial = None, tolerance: float = 1e-4) -> Record:
    """Simulate a system with the inputs of a record.

    Parameters
    ----------
    system : System
        What to simulate.
    record : Record
        Heaters, module currents [A] and ambients [K] by column name, held over each sample. Measured outputs in it
        serve for the initial temperatures only.
    initial : array_like, mapping or float, optional
        Initial lump temperatures [K]. Default: the system file's `initial`, else the nearest measured value, else the
        first ambient.
    tolerance : float
        Accepted truncation of the heats per step, as a temperature [K].

    Returns
    -------
    Record
        Same inputs; outputs are the noise-free readings of all sensors [K, or V] (of all lumps if the system has no
        sensor). Where those of `record` are means over the sample before, these are too; its first is kept, because the
        sample that it is the mean of is not in the record. The voltage of a row is that at the current of the same row,
        or of the row before (`read = "before"` of its sensor).

    Raises
    ------
    InputError
        Missing columns, Celsius in a record.
    Diverged
        Thermal runaway beyond every sensible temperature.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> system = rt.System(ambients={"room": {"temperature": 300.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                    links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}})
    >>> record = rt.Record(sample_time=10.0, inputs=np.ones(3), outputs=np.zeros((3, 0)), input_names=["heater"],
    ...                    output_names=[])
    >>> run = rt.thermal.simulate(system, record)
    >>> bool(np.allclose(run["bar"], 300 + 2 * (1 - np.exp(-run.time * 0.5 / 100))))
    True
    """
    eq = _equations(system, record)
    if is_small(eq):
        run = trajectory(system, record, initial=initial, tolerance=tolerance)
        readings = run.readings if system.sensors else run.lumps
    else:  # keep only what the sensors read
        measured = lumps_read(eq) or list(range(len(system.lumps)))
        u = held_inputs(eq, record)
        refuse_memory(eq)
        kept = run_implicit(eq, start_lumps(eq, record, initial), u, record.sample_time, tolerance,
                            np.array(measured, np.intp)).lumps
        readings = read_sampled(eq, measured, kept, u, record.sample_time) if system.sensors else kept
        _keep_first(eq, record, readings)
    volts = {name: unit for name, unit in system.sensor_units.items() if unit == "V"}
    return Record(sample_time=record.sample_time, inputs=record.inputs, outputs=readings,
                  input_names=record.input_names, output_names=system.sensor_names or system.lump_names, units=volts,
                  start_time=record.start_time, averaged=record.averaged, ripple=record.ripple,
                  name=f"simulation of {system.name}")


def trajectory(system: System, record: Record, *, initial: Initial = None, tolerance: float = 1e-4,
               sensitivities: Sequence[str] = ()) -> Trajectory:
    """Simulate a system and keep lump temperatures, energies and parameter sensitivities.

    Parameters
    ----------
    system, record, initial, tolerance
        As in `simulate`.
    sensitivities : sequence of str
        Parameter names, for example ``["modules.m1.seebeck.value"]``; the derivatives are those of the computed
        readings.

    Returns
    -------
    Trajectory

    Raises
    ------
    InputError, Diverged
        As in `simulate`; an unknown parameter name.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> system = rt.System(ambients={"room": {"temperature": 300.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                    links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
    ...                    sensors={"T": {"lump": "bar"}})
    >>> record = rt.Record(sample_time=10.0, inputs=np.ones(3), outputs=np.zeros((3, 0)), input_names=["heater"],
    ...                    output_names=[])
    >>> run = rt.thermal.trajectory(system, record, sensitivities=["lumps.bar.capacity"])
    >>> run.heater_heat[-1].tolist()  # 1 W for 20 s [J]
    [20.0]
    >>> bool(abs(run.energy_residual).max() < 1e-9)
    True
    >>> slope = -0.5 * run.time / 100**2 * 2 * np.exp(-run.time * 0.5 / 100)  # d/dC of 300 + 2 (1 - exp(-t G/C))
    >>> bool(np.allclose(run.sensitivity[:, 0, 0], slope))
    True
    """
    eq = _equations(system, record)
    u = held_inputs(eq, record)
    for name in sensitivities:
        system.parameter(name)  # a misspelt name is refused at once
    if is_small(eq):
        return _exponential(eq, record, u, initial, tolerance, list(sensitivities))
    if sensitivities:
        _refuse_large(system, sensitivities)
    everything = np.arange(len(system.lumps))
    refuse_memory(eq)
    start = start_lumps(eq, record, initial)
    run = run_implicit(eq, start, u, record.sample_time, tolerance, everything)
    readings = read_sampled(eq, everything.tolist(), run.lumps, u, record.sample_time)
    _keep_first(eq, record, readings)
    return Trajectory(system, record.time, run.lumps, readings, run.stored, run.ambient_heat,
                      run.heater_heat, run.electrical_energy, run.source_heat, (),
                      partial(_refuse_large, system), "implicit")


def _equations(system: System, record: Record) -> Equations:
    """Equations of a system for the readings of a record."""
    eq = equations(system)
    eq = replace(eq, ripple=tuple(name for name in system.modules if name in record_of(record).ripple))
    if not record.averaged:
        return eq
    if volts := [name for name, unit in system.sensor_units.items() if unit == "V"]:
        raise InputError(f"the record holds means, and {', '.join(map(repr, volts))} is a voltage",
                         where="argument record", expected="thermometers alone where readings are means over a sample",
                         remedy="Log samples, or leave the voltage out of the system.")
    return replace(eq, averaged=True)


def _first_measured(eq: Equations, record: Record) -> list[tuple[int, str]]:
    """Column and name of sensors whose first reading is the record's: what it depends on was before the record.

    A mean over the step before, or a voltage at the current of the row before.
    """
    return [(i, name) for i, (name, sensor) in enumerate(eq.system.sensors.items())
            if name in record.output_names and (eq.averaged or sensor.read == "before")]


def _keep_first(eq: Equations, record: Record, readings: Array) -> None:
    for column, name in _first_measured(eq, record):
        readings[0, column] = record[name][0]


def _refuse_large(system: System, names: Sequence[str], scale: Array | None = None) -> NoReturn:
    raise InputError(f"sensitivities of a network of {len(system.lumps)} lumps", where="argument sensitivities",
                     expected=f"at most {_DENSE_STATES} states",
                     remedy="Reduce the model first (rt.thermal.reduce), or difference two simulations.")


def is_small(eq: Equations) -> bool:
    """Whether the dense exponential method is the faster one."""
    heats = sum(2 * len(term.a) for term in eq.terms)
    return Layout(eq).size <= _DENSE_STATES and heats <= _DENSE_HEATS


def _exponential(eq: Equations, record: Record, u: Array, initial: Initial, tolerance: float,
                 names: list[str]) -> Trajectory:
    h, n = record.sample_time, len(eq.system.lumps)
    plan = schedule(eq, u, h, record.start_time, record.ripple)
    by = Integrator(eq, plan.lengths, tolerance)
    layout, at = by.layout, plan.samples
    path = by.run(start_state(eq, record, initial, plan), plan)
    states = path.z[at, :layout.n_free]
    derivative = _Derivative(record, initial, by, plan, path)
    readings = read_sensors(eq, states, _rates(by, states, plan) if derivative.delayed else None, _around(plan), h)
    _keep_first(eq, record, readings)
    lumps, meters = states[:, :n], path.z[at]
    return Trajectory(eq.system, record.time, lumps, readings, (lumps - lumps[0]) @ eq.capacity,
                      meters[:, layout.ambient_meters], meters[:, layout.heater_meters],
                      meters[:, layout.module_meters], meters[:, layout.source_meter], tuple(names), derivative,
                      "exponential")


@dataclass(frozen=True)
class _Derivative:
    """Derivative (n, n_sensors, n_parameters) of the readings of a run by named parameters, each times a number."""

    record: Record
    initial: Initial
    by: Integrator
    plan: Schedule
    path: Path

    @property
    def delayed(self) -> bool:
        """Whether a sensor reads what was between the samples."""
        return any(sensor.delay for sensor in self.by.eq.system.sensors.values())

    def __call__(self, names: Sequence[str], scale: Array | None = None) -> Array:
        by, plan, eq, at = self.by, self.plan, self.by.eq, self.plan.samples
        states = self.path.z[at, :by.layout.n_free]
        by_rate = self.delayed or any(name.startswith("sensors.") and name.endswith((".delay", ".time_constant"))
                                      for name in names)
        held = held_slopes(eq, self.record, names, plan)
        along = Sensitivity(by, names, held, jump_slopes(by, names, self.path.z, plan))
        slopes = along.along(self.path, plan, start_slope(eq, self.record, self.initial, names, held))
        if len(at) < len(slopes):  # else every segment is a sample
            slopes = slopes[at]
        sooner = np.maximum(at - 1, 0)
        out = reading_slopes(eq, states, _rates(by, states, plan) if by_rate else None, _around(plan), slopes,
                              _rate_slopes(along, states, plan, slopes) if self.delayed else None,
                              {name: (moved[at], moved[sooner]) for name, moved in held.items()}, names,
                              self.record.sample_time, np.ones(len(names)) if scale is None else scale)
        out[0, [column for column, _ in _first_measured(eq, self.record)]] = 0.0
        return out


def _around(plan: Schedule) -> tuple[Array, Array]:
    """Drives just after and just before every sample (they jump there)."""
    return plan.w[plan.samples], plan.w[np.maximum(plan.samples - 1, 0)]


def _rates(by: Integrator, states: Array, plan: Schedule) -> tuple[Array, Array]:
    """Rates of all states just after and just before every sample [K/s]."""
    after, before = _around(plan)
    return rates(by, states, after), rates(by, states, before)


def _rate_slopes(along: Sensitivity, states: Array, plan: Schedule, slopes: Array) -> tuple[Array, Array]:
    """Derivative of `_rates` along the sensitivities (n, n_states, n_parameters)."""
    after, before = (along.rate_slopes(states, w, slopes, {name: held[segment] for name, held in along.held.items()})
                     for w, segment in zip(_around(plan), (plan.samples, np.maximum(plan.samples - 1, 0)), strict=True))
    return after, before
