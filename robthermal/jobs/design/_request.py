"""What a controller is designed for: set-points, limits, box, bandwidth, sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..._celsius import ZERO_CELSIUS
from ...design import (
    RegulatedPoint,
    SetpointRamp,
    checked_margins,
    feedback_linearization,
    regulated_points,
    setpoint_ramp,
)
from ...errors import InputError
from ...thermal import System, drivable_range
from ..request import Method

FORMATS = ("c", "mat", "json")
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
        Crossover of the loops [rad/s]; default the largest that keeps `margins`, 0.02 where there are none.
    sample_time : float
        Of controller and observer [s].
    sensors : tuple of str
        What the observer reads; empty for no observer.
    method : str
        Norm of the contraction: "energy", "sum", "max", "lyapunov".
    regulate : dict
        Module to the sensor or lump that it regulates; modules that are left out regulate their cold face. With a
        lag, offset or distance to the module these are part of the loop.
    margins : dict
        Least "gain" [-], "phase" [deg], "modulus" [-] and "delay" [s] of every loop, some of them, for all plants of
        the parameter ranges. With a bandwidth they are checked, without one it is tuned to keep them.
    export : tuple of str
        Formats in which law, controller and observer are written too: "c", "mat", "json".
    parameters : dict
        {parameter name: (lower, upper)}: limits, claims and margins are for all of these too.
    setpoint_ramp : dict
        Module to the largest rate of its set-point, up and down [K/s], every module; default steps. Nothing that is
        certified depends on it.
    heat : dict
        Lump to the heat into it, (lower, upper) [W], instead of what the limits of its heaters allow. The set-points
        must be held at both ends.

    Examples
    --------
    >>> import robthermal as rt
    >>> wanted = rt.jobs.DesignRequest(setpoint={"m1": 278.15, "m2": 278.15}, sensors=("T6", "T7"))
    >>> wanted.temperature, wanted.sample_time
    ((278.15, 358.15), 1.0)
    """

    setpoint: dict[str, float]
    current: dict[str, tuple[float, float]] | None = None
    ambient: dict[str, tuple[float, float]] | None = None
    temperature: tuple[float, float] = (278.15, 358.15)
    bandwidth: float | None = None
    sample_time: float = 1.0
    sensors: tuple[str, ...] = ()
    method: Method = "energy"
    regulate: dict[str, str] | None = None
    margins: dict[str, float] | None = None
    export: tuple[str, ...] = ()
    parameters: dict[str, tuple[float, float]] | None = None
    setpoint_ramp: dict[str, float] | None = None
    heat: dict[str, tuple[float, float]] | None = None

    def ramp(self, modules: Sequence[str]) -> SetpointRamp | None:
        """Rates at which the set-points move; None where they step.

        Parameters
        ----------
        modules : sequence of str
            Modules, in the order of the controller.
        """
        given = self.setpoint_ramp
        return None if given is None else setpoint_ramp({name: given[name] for name in modules})

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
            No modules; a cascade; a module without set-point, or one that does not exist; a set-point outside of the
            box; current limits beyond the file's or without zero; too many lumps for a certified observer; sensors
            that lag; points, margins or parameters that there are not; another format.
        """
        if not system.modules:
            raise InputError(f"{system.name!r} has no thermoelectric module", where="design",
                             remedy="Add a [modules.NAME] table, or control its heaters directly.")
        if system.cascade:
            raise InputError(f"a cascade: {system.cascade}", where="design",
                             expected="modules side by side: a cascade is not designed at once",
                             remedy="Leave [design] out: contraction, boxes and limits of a cascade are certified all "
                             "the same. In Python design one stage, rt.design.feedback_linearization(..., "
                             "modules=[…]), while the other holds its own temperature.")
        for option, given in (("--setpoint", self.setpoint), ("--current", self.current or {}),
                              ("--regulate", self.regulate or {}), ("--setpoint-ramp", self.setpoint_ramp or {})):
            unknown = [name for name in given if name not in system.modules]
            if unknown:
                raise InputError(f"there is no module {unknown[0]!r}", where=option,
                                 expected="some of " + ", ".join(system.modules))
        missing = [name for name in system.modules if name not in self.setpoint]
        if missing:
            raise InputError(f"module {missing[0]!r} has no set-point", where="--setpoint",
                             expected="one for every module: " + ", ".join(system.modules))
        unramped = [name for name in system.modules if name not in (self.setpoint_ramp or system.modules)]
        if unramped:
            raise InputError(f"module {unramped[0]!r} has no rate", where="--setpoint-ramp",
                             expected="one for every module [K/s]: " + ", ".join(system.modules))
        self.ramp(system.module_names)  # refuses rates that are not positive
        self._check_currents(system)
        low, high = self.temperature
        points = self.points(system)
        for name, value in self.setpoint.items():
            if not low <= points[name].temperature(value) <= high:
                raise InputError(f"{name} at {celsius(value)} is outside of the box {celsius(low)} to {celsius(high)}",
                                 where="--setpoint", expected="a set-point inside it",
                                 remedy="Widen the box (--temperature; in [design] temperature) or move the set-point.")
        if self.margins is not None:
            checked_margins(self.margins)
        unknown = [name for name in self.export if name not in FORMATS]
        if unknown:
            raise InputError(f"there is no format {unknown[0]!r}", where="--export", expected=" or ".join(FORMATS))
        for name in self.parameters or {}:
            system.parameter(name)  # refuses unknown names
        for name in self.sensors:
            system.prompt_thermometer(name, "--sensors")
        if self.sensors and len(system.lumps) > _MOST_LUMPS:
            raise InputError(f"{len(system.lumps)} lumps are too many for a certified observer", where=system.name,
                             expected=f"at most {_MOST_LUMPS}", remedy="Reduce the system with rt.thermal.reduce, or "
                             "take its sensors out to design without an observer.")

    def _check_currents(self, system: System) -> None:
        """Currents that are asked for are those that module, bridge and supply can have."""
        for name, module in system.modules.items():
            found = drivable_range(module, self.temperature)
            if not found.low < found.high:
                raise InputError(f"no current can be driven: {found.why_high}", where=f"[modules.{name}] supply",
                                 expected="a supply with voltage to spare", remedy="Another supply, fewer modules in "
                                 "series, or a narrower box with --temperature.")
        for name, (low, high) in (self.current or {}).items():
            where, declared = f"--current {name}={low:g}:{high:g}", drivable_range(system.modules[name],
                                                                                    self.temperature)
            if not low <= 0 <= high:
                raise InputError("the range leaves zero out", where=where, expected="lower ≤ 0 ≤ upper",
                                 remedy="A controller must be able to switch the module off.")
            if low < declared.low or high > declared.high:
                what = declared.why_high if high > declared.high else declared.why_low
                what = "the current_limits" if what == "current_limits" else f"{what}: the supply"
                raise InputError(f"the range is beyond {what} of the system file", where=where,
                                 expected=f"within {declared.low:.4g}:{declared.high:.4g}")


def celsius(kelvin: float) -> str:
    """For people."""
    return f"{kelvin - ZERO_CELSIUS:.4g} °C"
