"""Simulate a system: `simulate` gives a record, `trajectory` everything inside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..signals import Record
from ._augmented import lagged
from ._drive import Initial, held_inputs, held_slope, start_slope, start_state
from ._equations import Equations
from ._exponential import Integrator
from ._implicit import run_implicit
from ._sensitivity import Sensitivity
from ._sensors import read_sampled, read_sensors, reading_slopes
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
        Samples [s].
    lumps : ndarray, shape (n, n_lumps)
        Temperatures [K].
    readings : ndarray, shape (n, n_sensors)
        Noise-free sensor readings [K].
    stored, ambient_heat, heater_heat, electrical_energy : ndarray
        Cumulative energies [J]: heat stored in all lumps (n,), received from every ambient (n, n_ambients), from every
        heater (n, n_inputs), electrical energy taken up by every module (n, n_modules).
    parameters : tuple of str
        Names of the sensitivities.
    sensitivity : ndarray, shape (n, n_sensors, n_parameters)
        Derivative of the readings.
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
    parameters: tuple[str, ...]
    sensitivity: Array
    method: str

    @property
    def energy_residual(self) -> Array:
        """Stored minus received energy [J], (n,): zero to rounding."""
        received = self.ambient_heat.sum(1) + self.heater_heat.sum(1) + self.electrical_energy.sum(1)
        return self.stored - received

    def __getitem__(self, name: str) -> Array:
        """Temperature of a lump or reading of a sensor by name [K]."""
        if name in self.system.lumps:
            return self.lumps[:, self.system.lump_names.index(name)]
        if name in self.system.sensors:
            return self.readings[:, self.system.sensor_names.index(name)]
        raise InputError(f"no lump or sensor {name!r}", where="trajectory",
                         expected="one of " + ", ".join((*self.system.lumps, *self.system.sensors)))

    def plot(self) -> Any:
        """Plot all lump temperatures [°C] against time; returns the matplotlib axes."""
        from matplotlib import pyplot as plt  # half a second to import, only when a picture is wanted

        _, ax = plt.subplots(layout="constrained")
        ax.plot(self.time, self.lumps - 273.15, label=self.system.lump_names)
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
        Same inputs; outputs are the noise-free readings of all sensors [K] (of all lumps if the system has no sensor).

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
    eq = equations(system)
    if is_small(eq):
        run = trajectory(system, record, initial=initial, tolerance=tolerance)
        readings = run.readings if system.sensors else run.lumps
    else:  # keep only what the sensors read
        measured = [system.lump_names.index(s.lump) for s in system.sensors.values()] or range(len(system.lumps))
        u = held_inputs(eq, record)
        kept = run_implicit(eq, start_state(eq, record, initial, len(system.lumps)), u, record.sample_time, tolerance,
                            np.array(measured, np.intp)).lumps
        readings = read_sampled(eq, kept, record.sample_time) if system.sensors else kept
    return Record(sample_time=record.sample_time, inputs=record.inputs, outputs=readings,
                  input_names=record.input_names, output_names=system.sensor_names or system.lump_names,
                  start_time=record.start_time, name=f"simulation of {system.name}")


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
    eq = equations(system)
    u = held_inputs(eq, record)
    for name in sensitivities:
        system.parameter(name)
    if is_small(eq):
        return _exponential(eq, record, u, initial, tolerance, list(sensitivities))
    if sensitivities:
        raise InputError(f"sensitivities of a network of {len(system.lumps)} lumps", where="argument sensitivities",
                         expected=f"at most {_DENSE_STATES} states",
                         remedy="Reduce the model first (rt.thermal.reduce), or difference two simulations.")
    everything = np.arange(len(system.lumps))
    start = start_state(eq, record, initial, everything.size)
    run = run_implicit(eq, start, u, record.sample_time, tolerance, everything)
    measured = run.lumps[:, [system.lump_names.index(s.lump) for s in system.sensors.values()]]
    readings = read_sampled(eq, measured, record.sample_time)
    return Trajectory(system, record.time, run.lumps, readings, run.stored, run.ambient_heat,
                      _heater_heat(eq, record, u), run.electrical_energy, (),
                      np.zeros((len(u), readings.shape[1], 0)), "implicit")


def is_small(eq: Equations) -> bool:
    """Whether the dense exponential method is the faster one."""
    heats = sum(2 * len(term.a) for term in eq.terms)
    states = len(eq.system.lumps) + len(lagged(eq)) + len(eq.system.ambients) + len(eq.system.modules)
    return states <= _DENSE_STATES and heats <= _DENSE_HEATS


def _exponential(eq: Equations, record: Record, u: Array, initial: Initial, tolerance: float,
                 names: list[str]) -> Trajectory:
    integrator = Integrator(eq, record.sample_time, tolerance)
    path = integrator.run(start_state(eq, record, initial, integrator.nz), u)
    n, na, lags = len(eq.system.lumps), len(eq.system.ambients), len(lagged(eq))
    slopes = None
    if names:
        along = Sensitivity(integrator, names, held_slope(eq, record, names))
        slopes = along.along(path, u, start_slope(eq, record, initial, names, integrator.nz))
    meters = path.z[:, n + lags:]
    states, h = path.z[:, :n + lags], record.sample_time
    delayed = any(s.delay for s in eq.system.sensors.values())
    by_rate = delayed or any(n.endswith((".delay", ".time_constant")) for n in names)
    rates = _rates(eq, states, u) if by_rate else None
    readings = read_sensors(eq, states, rates, h)
    sensitivity: Array = np.zeros((len(u), readings.shape[1], 0))
    if slopes is not None:
        held = held_slope(eq, record, names)
        rate_slopes = rates and _rate_slopes(eq, states, u, slopes, names, held)
        sensitivity = reading_slopes(eq, states, rates, slopes, rate_slopes, names, h)
    lumps = states[:, :n]
    return Trajectory(eq.system, record.time, lumps, readings, (lumps - lumps[0]) @ eq.capacity, meters[:, :na],
                      _heater_heat(eq, record, u), meters[:, na:], tuple(names), sensitivity, "exponential")


def _heater_heat(eq: Equations, record: Record, u: Array) -> Array:
    """Cumulative heat of every heater [J]."""
    heat = np.array([h.gain for h in eq.system.inputs.values()]) * u[:, :len(eq.system.inputs)] * record.sample_time
    return np.concatenate([np.zeros((1, heat.shape[1])), np.cumsum(heat[:-1], axis=0)])


def _rates(eq: Equations, states: Array, u: Array) -> tuple[Array, Array]:
    """Rates of all states just after and just before every sample (inputs jump there) [K/s]."""
    return _rate(eq, states, u), _rate(eq, states, np.concatenate([u[:1], u[:-1]]))


def _rate(eq: Equations, states: Array, u: Array) -> Array:
    n = len(eq.system.lumps)
    lumps = states[:, :n]
    columns: list[Array] = [eq.rate(lumps, u)]
    for row, name in enumerate(lagged(eq), start=n):
        sensor = eq.system.sensors[name]
        source = lumps[:, eq.system.lump_names.index(sensor.lump)]
        columns.append(((source - states[:, row]) / sensor.time_constant)[:, None])
    return np.concatenate(columns, axis=1)


def _rate_slopes(eq: Equations, states: Array, u: Array, slopes: Array, names: list[str],
                 held: Array) -> tuple[Array, Array]:
    """Derivative of `_rates` along the sensitivities (n, n_states, n_parameters), by complex steps."""
    before = np.concatenate([u[:1], u[:-1]])
    after_slopes, before_slopes = np.zeros_like(slopes), np.zeros_like(slopes)
    for column, name in enumerate(names):
        for out, inputs in ((after_slopes, u), (before_slopes, before)):
            moved = _rate(eq, states + 1e-40j * slopes[..., column], inputs + 1e-40j * held[:, column])
            out[..., column] = moved.imag / 1e-40
            for i, heat in eq.parameter_heat(name, states[:, :len(eq.capacity)], inputs):
                if not name.startswith("ambients."):  # an ambient acts through the held inputs
                    out[:, i, column] += heat / eq.capacity[i]
        sensor = name.removeprefix("sensors.").removesuffix(".time_constant")
        if sensor in lagged(eq) and name == f"sensors.{sensor}.time_constant":
            row = len(eq.capacity) + lagged(eq).index(sensor)
            own = _rate(eq, states, u)[:, row] / eq.system.sensors[sensor].time_constant
            after_slopes[:, row, column] -= own
            before_slopes[:, row, column] -= own
    return after_slopes, before_slopes
