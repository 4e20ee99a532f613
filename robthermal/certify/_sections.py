"""Sections of a certificate file from a system and a box; refuses boxes that do not fit the system."""

from __future__ import annotations

import platform
from collections.abc import Collection, Iterable, Mapping, Sequence
from difflib import get_close_matches
from importlib.metadata import version
from typing import Any

import numpy as np

from .._celsius import ADD_ZERO
from ..errors import InputError
from ..thermal import System
from ._heaters import LATE, MORE, following, heater_sections, is_of_lead, is_own_heat, power_ranges, slope_of

Interval = tuple[float, float]
Currents = Mapping[str, Interval]
Temperatures = Interval | Mapping[str, Interval]
_UNCERTAIN = (".capacity", ".conductance", ".natural.gain", ".radiation",
              *(f".{name}.{part}" for name in ("seebeck", "resistance", "conductance") for part in ("value", "slope")))

_NOT_OF_THE_NETWORK = ("sensors.", "inputs.", "ambients.")
JACOBIAN = ("lumps", "sensors", "leads")  # tables of heats that ∂f/∂x does not depend on
_LISTED = 12  # names in a message

# forcing: what adds heat that depends on no lump, and leaves the Jacobian ∂f/∂x as it is
_FORCING = {"lumps": ("heat", "periodic.heat"), "sensors": ("self_heating",),
            "inputs": (*MORE, *LATE), "leads": ("resistance",)}


def system_section(system: System, *, forcing: bool = False, heaters: tuple[str, ...] = ()) -> dict[str, Any]:
    """Every number of a thermal network that a claim depends on, kelvin.

    Effects that no checker knows are refused: a certificate must not leave out a heat. With `forcing`, for claims on
    ∂f/∂x alone, those pass that are not part of it. `heaters` are those, following temperature, that the claim knows.
    """
    if not isinstance(system, System):
        raise InputError(f"system is a {type(system).__name__}", where="argument system",
                         expected="a robthermal.System", remedy="Read one with rt.read_system(path).")
    inputs = {"inputs": heater_sections(system, heaters)} if heaters else {}
    refuse_effects(system, tuple(_FORCING) if forcing else (), {slope_of(name) for name in heaters})
    return {"name": system.name,
            "lumps": {name: {"capacity": lump.capacity} for name, lump in system.lumps.items()},
            "ambients": list(system.ambients),
            "links": [_link(link) for link in system.links],
            "modules": {name: _module(module) for name, module in system.modules.items()}, **inputs}


def refuse_effects(system: System, forcing: tuple[str, ...] = (), known: Collection[str] = ()) -> None:
    """Refuse effects that no checker knows, but those of `known` names, and heats of these tables that are forcing."""
    for name in system.effects:
        table, _, rest = name.partition(".")
        passes = table in forcing and (any(rest.endswith("." + field) for field in _FORCING.get(table, ())) or (
            rest.endswith(".gradient") and not _breezy(system, rest.removesuffix(".gradient"))))
        if not passes and name not in known:
            raise InputError(f"{name} = {system.parameter(name):g} is an effect that no certificate covers yet",
                             where="argument system", expected="a network of links, modules and lumps only",
                             remedy="Certify the system without it (set it to 0), a heat that it adds as a range of "
                                    "heat and a conductance that it changes as a range of parameters, each wide enough "
                                    "for every temperature in the box. That covers the box that is never left; "
                                    "contraction says nothing then of a heat that rises with temperature.")


def _breezy(system: System, lump: str) -> bool:
    """Whether natural convection joins a lump to an ambient: its slope depends on how warm the ambient is."""
    return any(link.natural is not None and lump in link.between and any(end in system.ambients for end in link.between)
               for link in system.links)


def _link(link: Any) -> dict[str, Any]:
    section: dict[str, Any] = {"name": link.name, "between": list(link.between), "conductance": link.conductance}
    if link.natural is not None:
        section["natural"] = {"gain": link.natural.gain, "exponent": link.natural.exponent}
    if link.radiation is not None:
        section["radiation"] = link.radiation
    return section


def _module(module: Any) -> dict[str, Any]:
    properties = {key: {"value": getattr(module, key).value, "slope": getattr(module, key).slope}
                  for key in ("seebeck", "resistance", "conductance")}
    return {"hot": module.hot, "cold": module.cold, **properties, "reference_temperature": module.reference_temperature}


def region_section(system: System, current: Currents, temperature: Temperatures,
                   parameters: Mapping[str, Interval] | None = None, knows: Collection[str] = ()) -> dict[str, Any]:
    """Temperature and current box, and the ranges of uncertain parameters, checked against the system.

    `knows`: as in `parameter_box`.
    """
    region = {"temperature": temperature_box(system, temperature), "current": current_box(system, current)}
    if ranges := parameter_box(system, parameters or {}, knows):
        region["parameters"] = ranges
    if "inputs" in knows and (powers := power_ranges(system, parameters)):
        region["power"] = powers
    return region


def parameter_box(system: System, parameters: Mapping[str, Interval], knows: Collection[str] = ()
                  ) -> dict[str, list[float]]:
    """{parameter name: [lo, hi]} around the values of the system, of those that the claim depends on.

    What only sensors, heaters or a start know is left out: no claim about the network in given ranges of currents,
    heats and ambients depends on it. `knows` are tables whose heats the claim has otherwise, or does not depend on:
    constant ones of lumps and sensors, those of leads; with "inputs" it knows heaters whose power follows temperature.
    """
    every = named_ranges(parameters, system.parameter_names, "parameters", "parameter")
    slopes = set(map(slope_of, following(system, parameters))) if "inputs" in knows else set()
    ranges: dict[str, list[float]] = {}
    for name, (low, high) in every.items():
        where = f"argument parameters[{name!r}]"
        follows = name in slopes
        heats = is_own_heat(name) or is_of_lead(name) or name.endswith(".power_slope")
        outside = name.partition(".")[0] in knows if heats and not follows else name.startswith(_NOT_OF_THE_NETWORK)
        if (outside and not follows) or name.endswith((".disturbance", ".initial")):
            continue
        if not follows and not name.endswith(_UNCERTAIN):
            raise InputError(f"a range of {name} cannot be covered: no checker knows it", where=where,
                             expected="ranges of capacities, conductances, natural.gain and radiation of links, "
                                      "and values and slopes of modules; in boxes that are never left also of heats",
                             remedy="Leave it out of `parameters`, and hold it at its value in the calibration too.")
        must_hold(system, name, (low, high))
        positive = low > 0 or (low == 0 and name.startswith("links."))
        if not positive and not follows and not name.endswith(".slope"):
            raise InputError(f"({low}, {high})", where=where, expected="positive numbers; of links also 0")
        ranges[name] = [low, high]
    return ranges


def must_hold(system: System, name: str, pair: Interval) -> None:
    """Refuse a range without the system's own value: a claim names this system."""
    value = system.parameter(name)
    if not pair[0] <= value <= pair[1]:
        raise InputError(f"({pair[0]}, {pair[1]}) excludes the system's own value {value}",
                         where=f"argument parameters[{name!r}]", expected="lower <= value <= upper")


def temperature_box(system: System, temperature: Temperatures, lumps: Sequence[str] | None = None) -> Any:
    """[lo, hi] or {lump: [lo, hi]}, kelvin; of all lumps, or of those named."""
    if isinstance(temperature, Mapping):
        names = system.lump_names if lumps is None else tuple(lumps)
        _same_names(temperature, names, "argument temperature", "lump")
        return {name: _interval(temperature[name], f"argument temperature[{name!r}]", kelvin=True) for name in names}
    return _interval(temperature, "argument temperature", kelvin=True)


def current_box(system: System, current: Currents) -> dict[str, list[float]]:
    """{module: [lo, hi]} [A], every module named."""
    if not isinstance(current, Mapping):
        raise InputError(f"current is a {type(current).__name__}", where="argument current",
                         expected='a mapping {"m1": (lo, hi), …} with every module')
    _same_names(current, system.module_names, "argument current", "module")
    return {name: _interval(current[name], f"argument current[{name!r}]") for name in system.module_names}


def named_ranges(values: Mapping[str, Interval], names: tuple[str, ...], argument: str, kind: str,
                 kelvin: bool = False) -> dict[str, list[float]]:
    """Checked intervals of some of the names."""
    unknown = [name for name in values if name not in names]
    if unknown:
        raise _unknown(unknown[0], names, f"argument {argument}", kind)
    return {name: _interval(pair, f"argument {argument}[{name!r}]", kelvin=kelvin) for name, pair in values.items()}


def _unknown(name: str, names: Sequence[str], where: str, kind: str) -> InputError:
    near = get_close_matches(name, names, n=1)
    listed = ", ".join(names[:_LISTED]) + (f" and {len(names) - _LISTED} more" if len(names) > _LISTED else "")
    return InputError(f"there is no {kind} {name!r}", where=where, expected=f"one of {listed}",
                      remedy=f"Did you mean {near[0]!r}?" if near else "")


def _same_names(given: Iterable[str], names: tuple[str, ...], where: str, kind: str) -> None:
    given = list(given)
    missing, unknown = [n for n in names if n not in given], [n for n in given if n not in names]
    if unknown:
        raise _unknown(unknown[0], names, where, kind)
    if missing:
        raise InputError(f"{kind} {missing[0]!r} has no range", where=where, expected=f"a range for every {kind}",
                         remedy=f'Add "{missing[0]}": (lower, upper); (0, 0) says that it is never used.')


def _interval(pair: Any, where: str, kelvin: bool = False) -> list[float]:
    try:
        low, high = (float(value) for value in pair)
    except (TypeError, ValueError):
        raise InputError(f"{pair!r}", where=where, expected="a pair of numbers (lower, upper)") from None
    if not (np.isfinite(low) and np.isfinite(high) and low <= high):
        raise InputError(f"({low}, {high})", where=where, expected="finite numbers, lower <= upper")
    if kelvin and low < 150.0:
        raise InputError(f"{low} K is below 150 K: it looks like degrees Celsius", where=where, expected="kelvin",
                         remedy=ADD_ZERO)
    return [low, high]


def made_by(solver: str, status: str) -> dict[str, str]:
    """Versions, solver and its status: for the record, never as evidence."""
    return {"robthermal": version("robthermal"), "python": platform.python_version(), "numpy": np.__version__,
            "solver": solver, "status": status}
