"""Requests for a design, from the command line and from the [design] table of a project file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..._checks import finite_number
from ...design import checked_margins
from ...errors import InputError
from ...thermal import System
from ..request import Boxes, boxes_from_text, in_kelvin
from ._request import FORMATS, DesignRequest

Ranges = Mapping[str, tuple[float, float]]
_SYNONYMS = {"matlab": "mat"}
_KEYS = ("regulate", "setpoint", "bandwidth", "current", "sample_time", "sensors", "method", "margins", "export",
         "setpoint_ramp")


def design_from_text(system: System, *, setpoint: Sequence[str] = (), current: Sequence[str] = (),
                     ambient: Sequence[str] = (), temperature: tuple[float, float] | None = None,
                     bandwidth: float | None = None, sample_time: float = 1.0, sensors: str | None = None,
                     method: str = "energy", regulate: Sequence[str] = (), margins: Sequence[str] = (),
                     export: str | None = None, parameters: Ranges | None = None,
                     ramp: Sequence[str] = ()) -> DesignRequest:
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
    bandwidth : float, optional
        Crossover of the loops [rad/s]; default the largest that keeps the margins, 0.02 without margins.
    sample_time : float
        Time between two samples [s].
    sensors : str, optional
        Names, separated by commas; default the first sensor on every lump that does not lag. Empty for no observer.
    method : str
        "energy", "sum", "max" or "lyapunov".
    regulate : sequence of str
        ``MODULE=NAME`` of a sensor or lump; default the cold face of every module.
    margins : sequence of str
        ``gain=VALUE``, ``phase=VALUE`` [deg], ``modulus=VALUE`` or ``delay=VALUE`` [s] that every loop must keep.
    export : str, optional
        Formats, separated by commas: c, mat (or matlab), json.
    parameters : mapping, optional
        Ranges of uncertain parameters, as from `ranges_from_text`.
    ramp : sequence of str
        ``MODULE=RATE`` of its set-point [K/s]; default steps.

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
                            _sensors(system, sensors), boxes.method, _regulate(regulate),
                            _margins(margins), formats((export or "").split(",") if export else ()),
                            dict(parameters) if parameters else None, _rates(ramp))
    request.check(system)
    return request


def design_from_table(system: System, table: Mapping[str, Any], boxes: Boxes,
                      parameters: Ranges | None = None) -> DesignRequest:
    """Request from the [design] table of a project file.

    Parameters
    ----------
    system : System
        Whose names and temperature unit apply.
    table : mapping
        Its keys: regulate, setpoint, bandwidth, current, sample_time, sensors, method, margins, export,
        setpoint_ramp; set-points in the unit of the system file.
    boxes : Boxes
        Box of temperatures, ambients and heats of [certify], and its set-points where the table has none [K, W].
    parameters : mapping, optional
        Ranges of uncertain parameters, each in its unit.

    Returns
    -------
    DesignRequest

    Raises
    ------
    InputError
        An unknown key, a value of another type, or one that does not fit the system.

    Examples
    --------
    >>> import robthermal as rt
    >>> table = {"regulate": {"m1": "T15"}, "setpoint": {"m1": 10.0, "m2": 12.0}, "margins": {"phase": 45.0}}
    >>> wanted = rt.jobs.design.design_from_table(rt.systems.two_module(), table, rt.jobs.Boxes())
    >>> wanted.setpoint, wanted.regulate, wanted.bandwidth
    ({'m1': 283.15, 'm2': 285.15}, {'m1': 'T15'}, None)
    """
    unknown = [key for key in table if key not in _KEYS]
    if unknown:
        raise InputError(f"there is no key {unknown[0]!r}", where="[design]", expected="some of " + ", ".join(_KEYS))
    points = {name: in_kelvin(_number(value, f"setpoint.{name}"), system.temperature_unit, f"[design] setpoint.{name}")
              for name, value in _table(table, "setpoint").items()}
    current = {name: _pair(pair, f"current.{name}") for name, pair in _table(table, "current").items()}
    margins = {name: _number(value, f"margins.{name}") for name, value in _table(table, "margins").items()}
    sensors = table.get("sensors")
    request = DesignRequest(
        setpoint=points or boxes.setpoint or dict.fromkeys(system.modules, boxes.temperature[0]), current=current,
        ambient=boxes.ambient, temperature=boxes.temperature,
        bandwidth=_number(table["bandwidth"], "bandwidth") if "bandwidth" in table else None,
        sample_time=_number(table.get("sample_time", 1.0), "sample_time"),
        sensors=_sensors(system, None if sensors is None else ",".join(_texts(sensors, "sensors"))),
        method=boxes_from_text(system, method=str(table.get("method", boxes.method))).method,
        regulate={name: str(point) for name, point in _table(table, "regulate").items()} or None,
        margins=margins or None, export=formats(_texts(table.get("export", ()), "export")),
        parameters=dict(parameters) if parameters else None,
        setpoint_ramp={name: _number(value, f"setpoint_ramp.{name}")
                       for name, value in _table(table, "setpoint_ramp").items()} or None, heat=boxes.heat)
    request.check(system)
    return request


def _table(table: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    value = table.get(key) or {}
    if not isinstance(value, Mapping):
        raise InputError(f"{key} = {value!r}", where="[design]", expected="a table of module = value")
    return value


def _number(value: Any, key: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f"{key} = {value!r}", where="[design]", expected="a number")
    return finite_number(value, f"[design] {key}")


def _pair(value: Any, key: str) -> tuple[float, float]:
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise InputError(f"{key} = {value!r}", where="[design]", expected="[lower, upper]")
    return _number(value[0], key), _number(value[1], key)


def _texts(value: Any, key: str) -> list[str]:
    names = [value] if isinstance(value, str) else value
    if not isinstance(names, (list, tuple)) or not all(isinstance(name, str) for name in names):
        raise InputError(f"{key} = {value!r}", where="[design]", expected="a list of names")
    return list(names)


def _regulate(texts: Sequence[str]) -> dict[str, str] | None:
    found = {}
    for text in texts:
        module, equals, name = text.partition("=")
        if not (module and equals and name) or module in found:
            raise InputError(f"{text!r}", where="--regulate", expected="MODULE=NAME, every module at most once, for "
                             "example m1=T_stage")
        found[module] = name
    return found or None


def _rates(texts: Sequence[str]) -> dict[str, float] | None:
    found: dict[str, float] = {}
    for text in texts:
        module, _, value = text.partition("=")
        try:
            rate = float(value)
        except ValueError:
            rate = float("nan")
        if module in found or not (module and np.isfinite(rate)):
            raise InputError(f"{text!r}", where="--setpoint-ramp", expected="MODULE=RATE in K/s, every module at most "
                             "once, for example m1=0.02")
        found[module] = rate
    return found or None


def _margins(texts: Sequence[str]) -> dict[str, float] | None:
    found = {}
    for text in texts:
        key, _, value = text.partition("=")
        try:
            found[key] = float(value)
        except ValueError:
            raise InputError(f"{text!r}", where="--margin", expected="NAME=VALUE, for example phase=45") from None
    return checked_margins(found) if found else None


def formats(names: Iterable[str]) -> tuple[str, ...]:
    """Formats of an export, each once.

    Parameters
    ----------
    names : iterable of str
        "c", "mat", "json"; "matlab" is "mat".
    """
    found = [_SYNONYMS.get(name.strip(), name.strip()) for name in names]
    unknown = [name for name in found if name not in FORMATS]
    if unknown:
        raise InputError(f"there is no format {unknown[0]!r}", where="export", expected=" or ".join(FORMATS))
    return tuple(dict.fromkeys(found))


def _sensors(system: System, text: str | None) -> tuple[str, ...]:
    if text is not None:
        return tuple(name.strip() for name in text.split(",")) if text.strip() else ()
    first = {sensor.lump: name for name, sensor in reversed(system.thermometers.items()) if not sensor.lag}
    return tuple(name for name in system.thermometers if name in first.values())
