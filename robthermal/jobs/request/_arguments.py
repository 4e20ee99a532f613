"""Command-line values to boxes and file lists."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path

from ..._first_use import OnFirstUse
from ...errors import InputError
from ...thermal import System, drivable_range
from ._schema import METHODS, STRUCTURES, Boxes, Project, in_kelvin, range_in_kelvin

_calibrated = OnFirstUse(f"{__package__}._calibrated")  # few command lines name a calibration


def boxes_from_text(system: System, *, temperature: tuple[float, float] | None = None, current: Sequence[str] = (),
                    ambient: Sequence[str] = (), setpoint: Sequence[str] = (), method: str = "energy",
                    structure: str = "full", large: bool = False, parameters: Sequence[str] = (),
                    confidence: float = 0.95) -> Boxes:
    """Boxes from command-line values.

    Parameters
    ----------
    system : System
        Whose temperature unit and names apply.
    temperature : tuple of float, optional
        Box of all lumps [unit of the file].
    current, ambient : sequence of str
        ``NAME=LO:HI`` [A], [unit of the file].
    setpoint : sequence of str
        Set-points as ``NAME=VALUE`` [unit of the file].
    method : str
        "energy", "sum", "max" or "lyapunov".
    structure : str
        Method "lyapunov": "full" or "block", as in `rt.certify.contraction`.
    large : bool
        Method "lyapunov": search P for more than 40 lumps too.
    parameters : sequence of str
        As in `ranges_from_text`; with files alone the boxes say "calibration".
    confidence : float
        Of the ranges from a file, above 0.5.

    Returns
    -------
    Boxes

    Raises
    ------
    InputError
        A value that does not read, an unknown method or structure.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.jobs.request.boxes_from_text(rt.systems.two_module(), current=["m1=0:1.5", "m2=0:1.5"]).current
    {'m1': (0.0, 1.5), 'm2': (0.0, 1.5)}
    """
    if method not in METHODS:
        raise InputError(f"method is {method!r}", where="--method", expected="energy, sum, max or lyapunov")
    if structure not in STRUCTURES:
        raise InputError(f"structure is {structure!r}", where="--structure", expected="full or block")
    ranges = ranges_from_text(system, parameters, confidence)
    unit = system.temperature_unit
    box = range_in_kelvin(temperature, unit, "--temperature") if temperature else Boxes().temperature
    declared = {name: drivable_range(module, box) for name, module in system.modules.items()}
    default = {name: (one.low, one.high) for name, one in declared.items() if isfinite(one.high - one.low)}
    currents = {**default, **dict(_range(text, "--current") for text in current)}
    surroundings = dict(_range(text, "--ambient") for text in ambient)
    points = dict(_value(text, "--setpoint") for text in setpoint)
    for option, given, what, known in (("--current", currents, "module", system.module_names),
                                       ("--setpoint", points, "module", system.module_names),
                                       ("--ambient", surroundings, "ambient", system.ambient_names)):
        unknown = [name for name in given if name not in known]
        if unknown:
            raise InputError(f"there is no {what} {unknown[0]!r}", where=option,
                             expected=f"one of {', '.join(known)}" if known else f"none: the system has no {what}")
    return Boxes(temperature=box, current=currents,
                 ambient={name: range_in_kelvin(pair, unit, "--ambient") for name, pair in surroundings.items()},
                 setpoint={name: in_kelvin(value, unit, "--setpoint") for name, value in points.items()},
                 method=method, structure=structure, large=large, confidence=confidence,
                 parameters=Boxes().parameters if all(map(_is_file, parameters)) else ranges)


def gate_from_text(project: Project, *, confidence: float | None = None, tolerance: Sequence[str] = ()) -> Project:
    """A project with options of its [gate] table from the command line.

    Parameters
    ----------
    project : Project
        As the project file says, from `read_project`.
    confidence : float, optional
        Of the parameter ranges; default that of the file.
    tolerance : sequence of str
        ``SENSOR=VALUE`` or ``default=VALUE`` [K]; they replace those of the file by name.

    Returns
    -------
    Project

    Raises
    ------
    InputError
        A confidence that is none, a value that does not read or is negative, an unknown sensor.
    """
    boxes = project.boxes if confidence is None else replace(project.boxes, confidence=checked_confidence(confidence))
    given = dict(_value(text, "--tolerance") for text in tolerance)
    known = ("default", *project.system.sensors)
    for name, value in given.items():
        if name not in known or not (isfinite(value) and value >= 0.0):
            raise InputError(f"{name}={value:g}", where="--tolerance",
                             expected="a number of at least 0 [K] for " + " or ".join(known))
    return replace(project, boxes=boxes, gate=replace(project.gate, tolerance={**project.gate.tolerance, **given}))


def checked_confidence(value: float) -> float:
    """A confidence as [gate] takes it.

    Parameters
    ----------
    value : float
        Probability, above 0.5 and below 1.
    """
    if not 0.5 < value < 1.0:
        raise InputError(f"{value:g}", where="--confidence", expected="a probability above 0.5 and below 1")
    return value


def ranges_from_text(system: System, texts: Sequence[str], confidence: float = 0.95) -> dict[str, tuple[float, float]]:
    """Ranges of uncertain parameters from the command line.

    Parameters
    ----------
    system : System
        The calibrated system.
    texts : sequence of str
        ``NAME=LO:HI`` [unit of the parameter], or the calibrated.json of a calibration; a range beside a file replaces
        that of the file.
    confidence : float
        Of the ranges from such a file, above 0.5.

    Returns
    -------
    dict
        {parameter: (lower, upper)}; empty where nothing is given.

    Raises
    ------
    InputError
        A value that does not read, a file that is no calibration of this system.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.jobs.request.ranges_from_text(rt.systems.two_module(), ["lumps.x1.capacity=38:42"])
    {'lumps.x1.capacity': (38.0, 42.0)}
    """
    confidence = checked_confidence(confidence)
    ranges: dict[str, tuple[float, float]] = {}
    for text in filter(_is_file, texts):
        ranges |= _calibrated.read_calibrated(Path(text), system).ranges(confidence)
    return ranges | dict(_range(text, "--parameters") for text in texts if not _is_file(text))


def _is_file(text: str) -> bool:
    return text.endswith(".json")


def point_from_text(system: System, values: Sequence[str]) -> dict[str, float]:
    """Operating point from the command line.

    Parameters
    ----------
    system : System
        Whose unit ambients are given in.
    values : sequence of str
        ``NAME=VALUE``: heaters [unit], module currents [A], ambients [unit of the file].

    Returns
    -------
    dict
        Ambients in kelvin.

    Raises
    ------
    InputError
        Another form.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.jobs.request.point_from_text(rt.systems.two_module(), ["m1=0.8"])
    {'m1': 0.8}
    """
    given = dict(_value(text, "--operating-point") for text in values)
    unit, option = system.temperature_unit, "--operating-point"
    return {name: in_kelvin(value, unit, f"{option} {name}") if name in system.ambients else value
            for name, value in given.items()}


def _range(text: str, option: str) -> tuple[str, tuple[float, float]]:
    name, _, values = text.rpartition("=")
    try:
        low, high = (float(value) for value in values.split(":"))
    except ValueError:
        raise InputError(f"{text!r}", where=option, expected="NAME=LO:HI, for example m1=0:1.5") from None
    return name, (low, high)


def _value(text: str, option: str) -> tuple[str, float]:
    name, _, value = text.rpartition("=")
    try:
        return name, float(value)
    except ValueError:
        raise InputError(f"{text!r}", where=option, expected="NAME=VALUE, for example m1=5") from None
