"""Command-line values to boxes and file lists."""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import InputError
from ...thermal import System
from ._schema import METHODS, STRUCTURES, Boxes, in_kelvin, range_in_kelvin


def boxes_from_text(system: System, *, temperature: tuple[float, float] | None = None, current: Sequence[str] = (),
                    ambient: Sequence[str] = (), setpoint: Sequence[str] = (), method: str = "energy",
                    structure: str = "full", large: bool = False) -> Boxes:
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
        ``NAME=VALUE`` [unit of the file].
    method : str
        "energy", "sum", "max" or "lyapunov".
    structure : str
        Method "lyapunov": "full" or "block", as in `rt.certify.contraction`.
    large : bool
        Method "lyapunov": search P for more than 40 lumps too.

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
    unit = system.temperature_unit
    default = {name: m.current_limits for name, m in system.modules.items() if m.current_limits is not None}
    currents = {**default, **dict(_range(text, "--current") for text in current)}
    surroundings = dict(_range(text, "--ambient") for text in ambient)
    points = dict(_value(text, "--setpoint") for text in setpoint)
    box = range_in_kelvin(temperature, unit, "--temperature") if temperature else Boxes().temperature
    return Boxes(temperature=box, current=currents,
                 ambient={name: range_in_kelvin(pair, unit, "--ambient") for name, pair in surroundings.items()},
                 setpoint={name: in_kelvin(value, unit, "--setpoint") for name, value in points.items()},
                 method=method, structure=structure, large=large)


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
