"""Short hashes of exact content, so that a sentence can name the machine it is about."""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from ._exact import ZERO, Malformed, Token, exact


class Name(str):
    """A text that never denotes a number."""

    __slots__ = ()


def short_hash(value: Any) -> str:
    """Return the first 12 hexadecimal digits of the SHA-256 of the canonical text of a value.

    Examples
    --------
    >>> short_hash([0.5, "0x1p-1"]) == short_hash(["5e-1", 0.5])
    True
    """
    pieces: list[str] = []
    _write(pieces, value)
    return hashlib.sha256("".join(pieces).encode("ascii")).hexdigest()[:12]


def machine_hash(system: Mapping[str, Any]) -> str:
    """Return the hash of the numbers and names of a "system" section; notes are left out."""
    if "lumps" in system:
        return short_hash(_thermal(system))
    if "vertices" in system and not {"gain", "n_meas"} & set(system):
        return short_hash([Name("ellipsoid"), system["vertices"],
                           *(system.get(name, {}) for name in ("measured", "controller", "performance")),
                           system["sample_time"]])
    if "vertices" in system:
        own = ("controller", "n_meas", "n_ctrl") if "n_meas" in system else ("gain",)
        return short_hash([Name("polytope"), *(system[name] for name in ("vertices", *own, "sample_time"))])
    keys = ("A", "B", "C", "D", "sample_time"), ("capacity", "rows", "cols", "values")
    for kind, names in zip(("linear", "network"), keys, strict=True):
        if names[0] in system:
            return short_hash([Name(kind), *(system[name] for name in names)])
    constants = ("seebeck", "resistance", "conductance", "sink_conductance", "sink_temperature", "setpoint")
    return short_hash([Name("runaway"), Name(system.get("name", "")), *(system[name] for name in constants)])


def link_name(link: Mapping[str, Any]) -> str:
    """Return the name of a link: its own, or those of its ends."""
    name = link.get("name")
    return name if isinstance(name, str) and not isinstance(name, Token) and name else "-".join(link["between"])


def _thermal(system: Mapping[str, Any]) -> list[Any]:
    found = [Name("thermal"), Name(system.get("name", "")),
             [[Name(name), lump["capacity"]] for name, lump in system["lumps"].items()],
             [Name(name) for name in system["ambients"]],
             [_link(link) for link in system["links"]],
             [_module(name, module) for name, module in system["modules"].items()]]
    if heaters := [[Name(name), Name(item["lump"]), item["power_slope"], item["reference_temperature"]]
                   for name, item in system.get("inputs", {}).items()
                   if isinstance(item, Mapping) and "power_slope" in item]:
        found += [Name("inputs"), heaters]
    if "operating" in system:
        operating = system["operating"]
        found += [Name("scheduled"), [operating["temperature"][name] for name in system["lumps"]],
                  [operating["current"][name] for name in system["modules"]], system["gain"]]
    elif "gain" in system:
        found += [Name("observer"), [_sensor(sensor) for sensor in system["sensors"]], system["gain"]]
    if "controller" in system:
        found += [Name("controller"), system["controller"]]
    return found


def _link(link: Mapping[str, Any]) -> list[Any]:
    natural = link.get("natural", {})
    return [Name(link_name(link)), *(Name(end) for end in link["between"]), link["conductance"],
            natural.get("gain", ZERO), natural.get("exponent", ZERO), link.get("radiation", ZERO)]


def _module(name: str, module: Mapping[str, Any]) -> list[Any]:
    properties = [module[key][part] for key in ("seebeck", "resistance", "conductance") for part in ("value", "slope")]
    return [Name(name), Name(module["hot"]), Name(module["cold"]), *properties, module["reference_temperature"]]


def _sensor(sensor: Any) -> list[Any]:
    if isinstance(sensor, str):
        return [Name(sensor), Name(sensor), Fraction(1)]
    return [Name(sensor.get("name", sensor["lump"])), Name(sensor["lump"]), sensor.get("gain", Fraction(1))]


def _write(pieces: list[str], value: Any) -> None:
    if isinstance(value, Mapping):
        pieces.append("{")
        for k, key in enumerate(sorted(value)):
            pieces.append(("," if k else "") + json.dumps(key) + ":")
            _write(pieces, value[key])
        pieces.append("}")
    elif isinstance(value, (list, tuple)):
        pieces.append("[")
        for k, item in enumerate(value):
            if k:
                pieces.append(",")
            _write(pieces, item)
        pieces.append("]")
    elif isinstance(value, Name) or (isinstance(value, str) and not _denotes(value)):
        pieces.append(json.dumps(str(value)))
    else:
        pieces.append(_number(value if isinstance(value, Fraction) else exact(value, "a hashed value")))


def _denotes(text: str) -> bool:
    try:
        exact(text, "")
    except Malformed:
        return False
    return True


def _number(value: Fraction) -> str:
    try:
        nearest = value.numerator / value.denominator
    except OverflowError:
        nearest = 0.0
    if value == 0 or (nearest and Fraction(float.__repr__(nearest)) == value):
        return "d" + struct.pack(">d", nearest).hex()
    return f"{value.numerator}/{value.denominator}"
