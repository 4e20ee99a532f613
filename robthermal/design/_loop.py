"""Closed loops of the nonlinear plant with a sampled controller, simulated exactly between the samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._celsius import ADD_ZERO, ZERO_CELSIUS
from .._checks import positive_number
from ..errors import Diverged, InputError, Outcome
from ..thermal import Stepper, System
from ._constant_gain import ConstantGain
from ._controller import Controller, ControllerInput, expect_controller
from ._estimate import Observer
from ._linearization import Command, FeedbackLinearization
from ._modules import Array, ModuleSet, check_system
from ._outcomes import DesignCode
from ._plant import ColdSide, cold_side
from ._regulated_points import Regulate

Law = FeedbackLinearization | ConstantGain
Signals = Mapping[str, ArrayLike]
_SUBSTEPS = 10  # of a sample under voltage drive: the current follows the temperatures
_SETTLED = 0.05  # K


@dataclass(frozen=True)
class ClosedLoop:
    """What happened in a simulated closed loop; row k of the inputs acts after row k of the temperatures.

    Parameters
    ----------
    law : FeedbackLinearization or ConstantGain
        What turned heats into currents.
    time : ndarray, shape (n,)
        Times of the samples [s].
    reference, cold : ndarray, shape (n, n_modules)
        Set-points and cold faces [K].
    lumps : ndarray, shape (n, n_lumps)
        True temperatures of all lumps [K].
    estimate : ndarray, shape (n, n_lumps)
        What the controller believed: the truth without an observer [K].
    current, voltage, wanted, achieved : ndarray, shape (n, n_modules)
        [A], [V], heats v that were asked for and, in the feedback law's view, achieved [W].
    limit : ndarray of str, shape (n, n_modules)
        Name of the active limit of every module; empty where none is active.
    outcome : Outcome
        "settled", "moving", "limited" or "ran_away".
    regulated : ndarray, shape (n, n_modules)
        What is regulated, without noise: the cold faces, other lumps, or readings [K].
    points : tuple of str
        Names of the lumps or sensors that are regulated.
    """

    law: Law
    time: Array
    reference: Array
    cold: Array
    lumps: Array
    estimate: Array
    current: Array
    voltage: Array
    wanted: Array
    achieved: Array
    limit: np.ndarray
    outcome: Outcome
    regulated: Array
    points: tuple[str, ...]

    def __str__(self) -> str:
        return self.outcome.text

    def plot(self) -> NDArray[Any]:
        """Plot what is regulated with its set-points [°C], other cold faces thin, and currents [A]; two axes."""
        from matplotlib import pyplot as plt  # heavy, only when a picture is wanted

        _, axes = plt.subplots(2, sharex=True, layout="constrained")
        for i, name in enumerate(base_law(self.law).names):
            line, = axes[0].plot(self.time, self.regulated[:, i] - ZERO_CELSIUS, label=f"{name}: {self.points[i]}")
            if (self.regulated[:, i] != self.cold[:, i]).any():
                axes[0].plot(self.time, self.cold[:, i] - ZERO_CELSIUS, ":", color=line.get_color(),
                             label=f"cold face of {name}")
            axes[0].plot(self.time, self.reference[:, i] - ZERO_CELSIUS, "--", color=line.get_color())
            axes[1].plot(self.time, self.current[:, i], color=line.get_color(), drawstyle="steps-post")
        axes[0].set_ylabel("temperature [°C]")
        axes[0].set_title(self.outcome.code, loc="left")
        axes[0].plot([], [], "--", color="0.5", label="set-point")
        axes[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False)  # above the curves
        axes[1].set(xlabel="time [s]", ylabel="current [A]")
        return axes


def simulate_loop(system: System, controller: Controller, reference: ArrayLike | Signals, *, law: Law, duration: float,
                  inputs: Signals | None = None, load: Signals | None = None,
                  initial: ArrayLike | Mapping[str, float] | None = None, current: ArrayLike = 0.0,
                  drive: Literal["current", "voltage"] = "current", observer: Observer | None = None,
                  noise_seed: int | None = None, regulate: Regulate = None) -> ClosedLoop:
    """Simulate a sampled controller on the nonlinear system.

    Parameters
    ----------
    system : System
        The plant; it may differ from the one the feedback law was built for in everything but names.
    controller : Controller
        From `pid`, `state_feedback`, `linear_controller`, `feed_forward` or `disturbance_observer`.
    reference : array_like or mapping
        Set-points of the cold faces, or of what is regulated instead [K]: one number, one per module, (n, n_modules),
        or module to number or (n,).
    law : FeedbackLinearization or ConstantGain
        Turns the heats into currents.
    duration : float
        Simulated time from the start [s].
    inputs : mapping, optional
        Heaters [unit], ambients [K] and currents of modules the feedback law does not drive [A], by name: a
        number or (n,).
    load : mapping of lump, optional
        Unmeasured heat into lumps [W]: a number or (n,).
    initial : array_like or mapping, optional
        Lump temperatures at the start [K].
    current : array_like, optional
        Currents that flowed before the start [A]: the controller starts from them.
    drive : {"current", "voltage"}, optional
        What the driver holds over a sample.
    observer : Observer, optional
        Estimates all lumps from the sensors; without it every lump is measured.
    noise_seed : int, optional
        Adds the sensors' noise; None for none.
    regulate : mapping of module to str, optional
        Sensor or lump that a module regulates; default its cold face. The controller sees what the sensor reads, with
        its lag, delay, gain, offset and noise; of a lump what is measured or estimated. A delay is interpolated
        between samples.

    Returns
    -------
    ClosedLoop
        Up to the runaway, if there is one.

    Raises
    ------
    InputError
        Unknown names, wrong lengths, Celsius, an observer of another sample time.

    Examples
    --------
    >>> import robthermal as rt
    >>> system = rt.systems.two_module()
    >>> law = rt.design.feedback_linearization(system)
    >>> pi = rt.design.pid(rt.design.cold_side(law), bandwidth=0.05, sample_time=1.0)
    >>> loop = rt.design.simulate_loop(system, pi, 288.15, law=law, duration=600.0)
    >>> loop.outcome.code
    'settled'
    """
    run = _Run(system, controller, law, duration, inputs or {}, load or {}, initial, drive, observer, noise_seed,
               regulate)
    return run.go(reference, base_law(law).modules.vector(current, "current", "A"))


def base_law(law: Law) -> FeedbackLinearization:
    """The linearizing law itself, or the one that a constant gain is the tangent of."""
    if isinstance(law, ConstantGain):
        return law.law
    if not isinstance(law, FeedbackLinearization):
        raise InputError(f"law is a {type(law).__name__}", where="argument law",
                         expected="what rt.design.feedback_linearization or rt.design.constant_gain returned")
    return law


class _Run:
    """One closed loop in progress."""

    def __init__(self, system: System, controller: Controller, law: Law, duration: float, inputs: Signals,
                 load: Signals, initial: ArrayLike | Mapping[str, float] | None, drive: str,
                 observer: Observer | None, noise_seed: int | None, regulate: Regulate):
        check_system(system)
        expect_controller(controller)
        base = base_law(law)
        if not set(base.names) <= set(system.modules) or system.lump_names != base.system.lump_names:
            raise InputError("lumps or modules differ from those of the feedback law's system", where="argument system",
                             expected="the same names")
        if drive not in ("current", "voltage"):
            raise InputError(f"drive = {drive!r}", where="argument drive", expected='"current" or "voltage"')
        self.law, self.base, self.controller, self.observer = law, base, controller, observer
        self.h = positive_number(controller.sample_time, "controller.sample_time", "s")
        if observer is not None and abs(observer.sample_time - self.h) > 1e-9 * self.h:
            raise InputError(f"the observer's sample time is {observer.sample_time:g} s", where="argument observer",
                             expected=f"the controller's, {self.h:g} s")
        self.n = max(int(round(positive_number(duration, "duration", "s") / self.h)), 1)
        self.substeps = _SUBSTEPS if drive == "voltage" else 1
        self.plant = Stepper(system, self.h / self.substeps, initial=initial, loads=tuple(load))
        self.inputs = self._signals(inputs, "inputs")
        self.load = self._signals(load, "load")
        self.linear: ColdSide = cold_side(base, regulate=regulate)
        self.points = self.linear.points
        self.reads = observer is not None or any(point.kind == "sensor" for point in self.points)
        self.sources: list[Array] = []  # readings of every sample, as if without delay
        self.true = ModuleSet.of(system, base.names)
        self.noise = None if noise_seed is None else np.random.default_rng(noise_seed)

    def _signals(self, given: Signals, argument: str) -> dict[str, Array]:
        out = {}
        for name, values in given.items():
            if name in self.base.names:
                raise InputError(f"{name!r} is driven by the feedback law", where=f"argument {argument}",
                                 remedy="Leave its current out.")
            array = np.asarray(values, float)
            if array.shape not in ((), (self.n,)) or not np.isfinite(array).all():
                raise InputError(f"{name!r} has shape {array.shape}", where=f"argument {argument}",
                                 expected=f"a finite number or {self.n} of them, one per sample")
            out[name] = np.broadcast_to(array, (self.n,))
        return out

    def go(self, reference: ArrayLike | Signals, current: Array) -> ClosedLoop:
        """Run to the end, or to the runaway."""
        wanted_cold = self.base.modules.vector(reference, "reference", "K")
        if wanted_cold.shape not in ((len(self.base.names),), (self.n, len(self.base.names))):
            raise InputError(f"reference has shape {wanted_cold.shape}", where="argument reference",
                             expected=f"one row, or {self.n} of them, one per sample")
        wanted_cold = np.broadcast_to(wanted_cold, (self.n, len(self.base.names)))
        if wanted_cold.min() < 150.0:
            raise InputError(f"a set-point is {wanted_cold.min():g} K", where="argument reference", expected="kelvin",
                             remedy=ADD_ZERO)
        rows: list[tuple[Any, ...]] = []
        memory = self.observer.start(self.plant.lumps) if self.observer else np.zeros(0)
        state: Array | None = None
        try:
            for k in range(self.n):
                true, named = self.plant.lumps, {name: float(values[k]) for name, values in self.inputs.items()}
                believed = true if self.observer is None else self.observer.estimate(memory)
                clean = self._readings() if self.reads else np.empty(0)
                seen = clean if self.noise is None else clean + self._noise()
                given = ControllerInput(wanted_cold[k], self._regulated(believed, seen), believed,
                                        self.linear.surroundings(believed, named))
                if state is None:
                    state = self.controller.start(given, self._heat_of(current, believed))
                heat = self.controller.heat(state, given)
                command = self.law.command(heat, believed, previous=current, sample_time=self.h)
                state = self.controller.advance(state, given, heat, command.heat)
                rows.append((true, believed, command, heat, self._regulated(true, clean)))
                if self.observer is not None:
                    u = {**named, **dict(zip(self.base.names, command.current.tolist(), strict=True))}
                    names = self.plant.system.sensor_names
                    memory = self.observer.step(memory, seen[[names.index(name) for name in self.observer.sensors]], u)
                self._advance(command, named, k)
                current = command.current
        except Diverged as error:
            return self._result(rows, wanted_cold, DesignCode.RAN_AWAY.outcome(str(error), remedy=""))
        return self._result(rows, wanted_cold, None)

    def _heat_of(self, current: Array, temperatures: Array) -> Array:
        if isinstance(self.law, ConstantGain):
            return self.law.heat - (current - self.law.current) / self.law.gain
        return self.law.heat(current, temperatures)

    def _readings(self) -> Array:
        """Readings of all sensors now, without noise; before the start they were what they are at the start."""
        self.sources.append(self.plant.undelayed)
        found = self.sources[-1].copy()
        for i, sensor in enumerate(self.plant.system.sensors.values()):
            if sensor.delay:
                at = max(len(self.sources) - 1 - sensor.delay / self.h, 0.0)
                first = min(int(at), len(self.sources) - 2) if len(self.sources) > 1 else 0
                later = self.sources[min(first + 1, len(self.sources) - 1)][i]
                found[i] = self.sources[first][i] + (at - first) * (later - self.sources[first][i])
        return found

    def _noise(self) -> Array:
        if not self.reads:
            return np.empty(0)
        sigma = np.array([sensor.noise for sensor in self.plant.system.sensors.values()])
        return sigma * (0.0 if self.noise is None else self.noise.standard_normal(len(sigma)))

    def _regulated(self, lumps: Array, readings: Array) -> Array:
        """What the modules regulate: readings, or temperatures of lumps."""
        system = self.plant.system
        return np.array([readings[system.sensor_names.index(point.name)] if point.kind == "sensor"
                         else lumps[system.lump_names.index(point.name)] for point in self.points])

    def _advance(self, command: Command, named: dict[str, float], k: int) -> None:
        load = {lump: float(values[k]) for lump, values in self.load.items()}
        for _ in range(self.substeps):
            current = command.current
            if self.substeps > 1:
                p = self.true.properties(self.plant.lumps)
                current = (command.voltage - p.S * (p.hot - p.cold)) / p.R
            self.plant.step({**named, **dict(zip(self.base.names, current.tolist(), strict=True))}, load)

    def _result(self, rows: list[tuple[Any, ...]], reference: Array, outcome: Outcome | None) -> ClosedLoop:
        true, believed, commands, wanted, regulated = zip(*rows, strict=True)
        lumps = np.array(true)
        fields = {key: np.array([getattr(c, key) for c in commands]) for key in ("current", "voltage", "heat", "limit")}
        cold = lumps[:, self.base.modules.cold]
        reference = reference[:len(cold)]
        return ClosedLoop(self.law, self.h * np.arange(len(cold)), reference, cold, lumps, np.array(believed),
                          fields["current"], fields["voltage"], np.array(wanted), fields["heat"], fields["limit"],
                          self._judge(np.array(regulated), reference, fields["limit"]) if outcome is None else outcome,
                          np.array(regulated), tuple(point.name for point in self.points))

    def _judge(self, regulated: Array, reference: Array, limit: np.ndarray) -> Outcome:
        tail = slice(-max(len(regulated) // 20, 2), None)
        error = np.abs(regulated - reference)[tail].max(axis=0)
        if error.max() < _SETTLED:
            what = "cold face" if self.linear.at_faces else "regulated temperature"
            return DesignCode.SETTLED.outcome(f"Settled: every {what} stays within {_SETTLED} K of its set-point.")
        i = int(np.argmax(error))
        if (limit[tail, i] != "").all():
            return DesignCode.LIMITED.outcome(
                f"{self.base.names[i]} is at its {limit[-1, i]} limit and {error[i]:.3g} K from its set-point:")
        return DesignCode.MOVING.outcome(f"{self.base.names[i]} is still {error[i]:.3g} K from its set-point:")
