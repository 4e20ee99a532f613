"""What a controller is designed for: set-points, limits, box, bandwidth, sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..._celsius import ZERO_CELSIUS
from ...design import RegulatedPoint, feedback_linearization, regulated_points
from ...errors import InputError
from ...thermal import System
from ..request import Method, boxes_from_text

_MOST_LUMPS = 40  # of an observer's certificate, a dense matrix inequality


@dataclass(frozen=True)
class DesignRequest:
    """What `design_system` is asked for.

    Parameters
    ----------
    setpoint : dict
        Module to temperature of its cold face, or of what it regulates instead [K]; every module.
    current : dict
        Module to (lower, upper) [A]; modules that are left out get the largest range that is certified.
    ambient : dict
        Ambient to (lower, upper) [K]; the others stay nominal.
    temperature : tuple of float
        Box of the certificates, for all lumps [K].
    bandwidth : float
        Crossover of the loops [rad/s].
    sample_time : float
        Of controller and observer [s].
    sensors : tuple of str
        What the observer reads; empty for no observer.
    method : str
        Norm of the contraction: "energy", "sum", "max", "lyapunov".
    regulate : dict
        Module to the sensor or lump that it regulates; modules that are left out regulate their cold face. With a
        lag, offset or distance to the module these are part of the loop.

    Examples
    --------
    >>> import robthermal as rt
    >>> wanted = rt.jobs.DesignRequest(setpoint={"m1": 278.15, "m2": 278.15}, sensors=("T6", "T7"))
    >>> wanted.temperature, wanted.bandwidth
    ((278.15, 358.15), 0.02)
    """

    setpoint: dict[str, float]
    current: dict[str, tuple[float, float]] | None = None
    ambient: dict[str, tuple[float, float]] | None = None
    temperature: tuple[float, float] = (278.15, 358.15)
    bandwidth: float = 0.02
    sample_time: float = 1.0
    sensors: tuple[str, ...] = ()
    method: Method = "energy"
    regulate: dict[str, str] | None = None

    def points(self, system: System) -> dict[str, RegulatedPoint]:
        """What every module regulates.

        Parameters
        ----------
        system : System
            To be controlled.
        """
        return {point.module: point for point in regulated_points(feedback_linearization(system), self.regulate)}

    def check(self, system: System) -> None:
        """Refuse what does not fit a system.

        Parameters
        ----------
        system : System
            To be controlled.

        Raises
        ------
        InputError
            No modules; a module without set-point, or one that does not exist; a set-point outside of the box; current
            limits beyond the file's or without zero; too many lumps for a certified observer.
        """
        if not system.modules:
            raise InputError(f"{system.name!r} has no thermoelectric module", where="design",
                             remedy="Add a [modules.NAME] table, or control its heaters directly.")
        for option, given in (("--setpoint", self.setpoint), ("--current", self.current or {})):
            unknown = [name for name in given if name not in system.modules]
            if unknown:
                raise InputError(f"there is no module {unknown[0]!r}", where=option,
                                 expected="some of " + ", ".join(system.modules))
        missing = [name for name in system.modules if name not in self.setpoint]
        if missing:
            raise InputError(f"module {missing[0]!r} has no set-point", where="--setpoint",
                             expected="one for every module: " + ", ".join(system.modules))
        for name, (low, high) in (self.current or {}).items():
            where, declared = f"--current {name}={low:g}:{high:g}", system.modules[name].current_limits
            if not low <= 0 <= high:
                raise InputError("the range leaves zero out", where=where, expected="lower ≤ 0 ≤ upper",
                                 remedy="A controller must be able to switch the module off.")
            if declared is not None and (low < declared[0] or high > declared[1]):
                raise InputError("the range is beyond the current_limits of the system file", where=where,
                                 expected=f"within {declared[0]:g}:{declared[1]:g}")
        low, high = self.temperature
        points = self.points(system)
        for name, value in self.setpoint.items():
            if not low <= points[name].temperature(value) <= high:
                raise InputError(f"{name} at {celsius(value)} is outside of the box {celsius(low)} to {celsius(high)}",
                                 where="--setpoint", expected="a set-point inside it",
                                 remedy="Widen the box with --temperature, or move the set-point.")
        if self.sensors and len(system.lumps) > _MOST_LUMPS:
            raise InputError(f"{len(system.lumps)} lumps are too many for a certified observer", where=system.name,
                             expected=f"at most {_MOST_LUMPS}", remedy="Reduce the system with rt.thermal.reduce, or "
                             "take its sensors out to design without an observer.")


def design_from_text(system: System, *, setpoint: Sequence[str] = (), current: Sequence[str] = (),
                     ambient: Sequence[str] = (), temperature: tuple[float, float] | None = None,
                     bandwidth: float = 0.02, sample_time: float = 1.0, sensors: str | None = None,
                     method: str = "energy", regulate: Sequence[str] = ()) -> DesignRequest:
    """Request from command-line values.

    Parameters
    ----------
    system : System
        Whose names and temperature unit apply.
    setpoint : sequence of str
        ``NAME=VALUE`` [unit of the file]; default the lower end of the box for every module, where I* is smallest.
    current, ambient : sequence of str
        ``NAME=LO:HI`` [A], [unit of the file].
    temperature : tuple of float, optional
        Box of all lumps [unit of the file].
    bandwidth, sample_time : float
        Bandwidth of the closed loop [rad/s] and time between two samples [s].
    sensors : str, optional
        Names, separated by commas; default the first sensor on every lump that does not lag.
    method : str
        "energy", "sum", "max" or "lyapunov".
    regulate : sequence of str
        ``MODULE=NAME`` of a sensor or lump; default the cold face of every module.

    Returns
    -------
    DesignRequest

    Raises
    ------
    InputError
        A value that does not read, or does not fit the system.

    Examples
    --------
    >>> import robthermal as rt
    >>> wanted = rt.jobs.design.design_from_text(rt.systems.two_module(), setpoint=["m1=5", "m2=8"], sensors="T6,T7")
    >>> wanted.setpoint, wanted.sensors
    ({'m1': 278.15, 'm2': 281.15}, ('T6', 'T7'))
    """
    boxes = boxes_from_text(system, temperature=temperature, current=current, ambient=ambient, setpoint=setpoint,
                            method=method)
    named = {text.rpartition("=")[0] for text in current}
    targets = boxes.setpoint or dict.fromkeys(system.modules, boxes.temperature[0])
    limits = {name: pair for name, pair in (boxes.current or {}).items() if name in named}
    request = DesignRequest(targets, limits, boxes.ambient, boxes.temperature, bandwidth, sample_time,
                            _sensors(system, sensors, sample_time), boxes.method, _regulate(regulate))
    request.check(system)
    return request


def _regulate(texts: Sequence[str]) -> dict[str, str] | None:
    found = {}
    for text in texts:
        module, equals, name = text.partition("=")
        if not (module and equals and name) or module in found:
            raise InputError(f"{text!r}", where="--regulate", expected="MODULE=NAME, every module at most once, for "
                             "example m1=T_stage")
        found[module] = name
    return found or None


def _sensors(system: System, text: str | None, sample_time: float) -> tuple[str, ...]:
    if text is not None:
        names = tuple(name.strip() for name in text.split(","))
        for name in names:
            system.thermometer(name, "--sensors")
        return names
    first = {sensor.lump: name for name, sensor in reversed(system.thermometers.items())
             if not sensor.time_constant and not sensor.delay}
    return tuple(name for name in system.thermometers if name in first.values())


def celsius(kelvin: float) -> str:
    """For people."""
    return f"{kelvin - ZERO_CELSIUS:.4g} °C"
