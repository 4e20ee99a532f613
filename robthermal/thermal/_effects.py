"""The catalogue of effects by name: what each is about, and how it becomes ordinary content of a system."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..errors import InputError
from ._effect_parts import Lead
from ._parameters import parts_of
from ._parts import Link, Lump
from ._system import System

Values = Mapping[str, float]
_TABLES = {"module": ("modules",), "lump": ("lumps",), "ambient": ("ambients",), "link": ("links",),
           "sensor": ("sensors",), "input": ("inputs",), "input or module": ("inputs", "modules")}
_TINY_MASS = 1e-6  # of its lump's capacity: a hidden mass that is not there yet


@dataclass(frozen=True)
class EffectKind:
    """One entry of the catalogue.

    Parameters
    ----------
    where : tuple of str
        Kinds of the parts that it names, in order: "module", "lump", "ambient", "link", "sensor", "input", or
        "input or module".
    parameters : mapping of str to str
        Parameter to unit.
    sizes : tuple of str
        Parameters that are zero when the effect is absent (a clip: when it is left out).
    nonnegative : tuple of str
        Parameters that cannot be negative.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.thermal.effects()["lead_heating"].where
    ('lump', 'module')
    """

    where: tuple[str, ...]
    parameters: Mapping[str, str]
    sizes: tuple[str, ...]
    nonnegative: tuple[str, ...] = ()


@dataclass(frozen=True)
class AddedEffect:
    """A system with one more effect.

    Parameters
    ----------
    system : System
        Which.
    parameters : mapping of str to str
        Parameter of the effect to the name of the number in the system.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.thermal.add_effect(rt.systems.two_module(), "thomson", ["m1"]).parameters
    {'coefficient': 'modules.m1.thomson'}
    """

    system: System
    parameters: Mapping[str, str]


_DRIVEN = ("input or module",)
_KINDS = {
    "seebeck_slope": EffectKind(("module",), {"slope": "V/K²"}, ("slope",)),
    "resistance_slope": EffectKind(("module",), {"slope": "Ω/K"}, ("slope",)),
    "conductance_slope": EffectKind(("module",), {"slope": "W/K²"}, ("slope",)),
    "thomson": EffectKind(("module",), {"coefficient": "V/K"}, ("coefficient",)),
    "joule_split": EffectKind(("module",), {"split": "-"}, ("split",)),
    "hysteresis": EffectKind(("module",), {"heat": "W", "time_constant": "s"}, ("heat",), ("time_constant",)),
    "natural_convection": EffectKind(("lump", "ambient"), {"gain": "W/K^(1+exponent)", "exponent": "-"}, ("gain",),
                                     ("gain", "exponent")),
    "radiation": EffectKind(("lump", "ambient"), {"coefficient": "W/K⁴"}, ("coefficient",), ("coefficient",)),
    "missing_link": EffectKind(("lump", "lump"), {"conductance": "W/K"}, ("conductance",), ("conductance",)),
    "missing_ambient_link": EffectKind(("lump", "ambient"), {"conductance": "W/K"}, ("conductance",), ("conductance",)),
    "heat_source": EffectKind(("lump",), {"heat": "W"}, ("heat",)),
    "sensor_self_heating": EffectKind(("sensor",), {"heat": "W"}, ("heat",)),
    "lead_heating": EffectKind(("lump", "module"), {"resistance": "Ω"}, ("resistance",)),
    "hidden_mass": EffectKind(("lump",), {"capacity": "J/K", "time_constant": "s"}, ("capacity",),
                              ("capacity", "time_constant")),
    "input_gain": EffectKind(_DRIVEN, {"gain": "-"}, ("gain",)),
    "input_offset": EffectKind(_DRIVEN, {"offset": "unit"}, ("offset",)),
    "input_saturation": EffectKind(_DRIVEN, {"cubic": "1/unit²", "clip": "unit"}, ("cubic", "clip"), ("clip",)),
    "input_delay": EffectKind(_DRIVEN, {"delay": "s"}, ("delay",), ("delay",)),
    "input_lag": EffectKind(_DRIVEN, {"time_constant": "s"}, ("time_constant",), ("time_constant",)),
    "heater_power_slope": EffectKind(("input",), {"slope": "1/K"}, ("slope",)),
    "input_feedthrough": EffectKind(("input", "lump"), {"share": "-"}, ("share",)),
    "sensor_lag": EffectKind(("sensor",), {"time_constant": "s"}, ("time_constant",), ("time_constant",)),
    "sensor_offset": EffectKind(("sensor",), {"offset": "K"}, ("offset",)),
    "sensor_gain": EffectKind(("sensor",), {"gain": "-"}, ("gain",)),
    "ambient_gradient": EffectKind(("lump",), {"difference": "K"}, ("difference",)),
    "periodic_load": EffectKind(("lump",), {"heat": "W", "period": "s", "phase": "rad"}, ("heat",), ("period",)),
    "conductance_step": EffectKind(("link",), {"relative": "-", "time": "s"}, ("relative",)),
    "condensation": EffectKind(("lump",), {"conductance": "W/K", "dew_point": "K"}, ("conductance",), ("conductance",)),
}
# effects that are one number of a part: parameter to key
_NUMBERS = {
    "thomson": {"coefficient": "thomson"}, "joule_split": {"split": "joule_split"}, "heat_source": {"heat": "heat"},
    "sensor_self_heating": {"heat": "self_heating"}, "ambient_gradient": {"difference": "gradient"},
    "seebeck_slope": {"slope": "seebeck.slope"}, "resistance_slope": {"slope": "resistance.slope"},
    "conductance_slope": {"slope": "conductance.slope"}, "input_gain": {"gain": "drive.gain"},
    "input_offset": {"offset": "drive.offset"}, "input_delay": {"delay": "drive.delay"},
    "input_saturation": {"cubic": "drive.cubic", "clip": "drive.clip"},
    "input_lag": {"time_constant": "drive.time_constant"}, "heater_power_slope": {"slope": "power_slope"},
    "sensor_lag": {"time_constant": "time_constant"}, "sensor_offset": {"offset": "offset"},
    "sensor_gain": {"gain": "gain"},
}
# effects that are a table of a part: its key, and defaults of what is not a size
_SUBTABLES: dict[str, tuple[str, Values]] = {
    "hysteresis": ("hysteresis", {"time_constant": 60.0}), "conductance_step": ("step", {"time": 0.0}),
    "periodic_load": ("periodic", {"period": 600.0, "phase": 0.0}),
    "condensation": ("condensation", {"dew_point": 283.15}),
}


def effects() -> dict[str, EffectKind]:
    """Catalogue of effects that a system can carry.

    Returns
    -------
    dict
        Name to `EffectKind`.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.thermal.effects()["thomson"].parameters
    {'coefficient': 'V/K'}
    """
    return dict(_KINDS)


def add_effect(system: System, effect: str, where: Sequence[str], values: Values | None = None) -> AddedEffect:
    """Add one effect to a system.

    Parameters
    ----------
    system : System
        To which; it is not changed.
    effect : str
        A name of `effects`.
    where : sequence of str
        Parts that it names, in the order of `EffectKind.where`.
    values : mapping, optional
        Parameters; what is left out is zero, or for a shape a usual value (exponent 0.25, time constant 60 s, period
        600 s, dew point 283.15 K). A hidden mass cannot be zero: it starts at a millionth of its lump's capacity.

    Returns
    -------
    AddedEffect
        The parameter "time_constant" of a hidden mass is set by its link's conductance, capacity / time_constant.

    Raises
    ------
    InputError
        Unknown names; a place that has this effect already; a value that the system refuses.

    Examples
    --------
    >>> import robthermal as rt
    >>> added = rt.thermal.add_effect(rt.systems.two_module(), "lead_heating", ["x6", "m1"], {"resistance": 0.02})
    >>> added.parameters, added.system.parameter("leads.m1-x6.resistance")
    ({'resistance': 'leads.m1-x6.resistance'}, 0.02)
    """
    given, values = list(where), dict(values or {})
    kind = _checked(system, effect, given, values)
    if effect in _NUMBERS:
        return _numbers(system, effect, given[0], values)
    if effect in _SUBTABLES:
        return _subtable(system, effect, kind, given[0], values)
    return _BUILDERS[effect](system, given, values)


def _checked(system: System, effect: str, where: list[str], values: Values) -> EffectKind:
    if effect not in _KINDS:
        raise InputError(f"there is no effect {effect!r}", where="argument effect",
                         expected="one of " + ", ".join(_KINDS))
    kind = _KINDS[effect]
    if len(where) != len(kind.where):
        raise InputError(f"{effect} at {where}", where="argument where", expected=", ".join(kind.where))
    for name, what in zip(where, kind.where, strict=True):
        known = [part for table in _TABLES[what] for part in parts_of(system, table)]
        if name not in known:
            raise InputError(f"there is no {what} {name!r}", where="argument where",
                             expected="one of " + (", ".join(known) or "none"))
    for name in values:
        if name not in kind.parameters:
            raise InputError(f"{effect} has no parameter {name!r}", where="argument values",
                             expected="some of " + ", ".join(kind.parameters))
    return kind


def _table(system: System, effect: str, part: str) -> str:
    return next(table for table in _TABLES[_KINDS[effect].where[0]] if part in parts_of(system, table))


def _numbers(system: System, effect: str, part: str, values: Values) -> AddedEffect:
    """One number of a part; a sensor's gain is 1 + the relative one."""
    table, keys = _table(system, effect, part), _NUMBERS[effect]
    wanted = {key: float(values[key]) for key in keys if key in values} or {next(iter(keys)): 0.0}
    numbers = {f"{table}.{part}.{keys[key]}": value + (effect == "sensor_gain") for key, value in wanted.items()}
    if any(name in system.parameter_names and system.parameter(name) != float(effect == "sensor_gain")
           for name in numbers):
        raise _already(effect, [part])
    if effect.endswith("_slope") and table == "modules":  # a slope needs to say where the values hold
        reference = f"modules.{part}.reference_temperature"
        system = system.with_parameters({reference: system.parameter(reference)})
    return AddedEffect(system.with_parameters(numbers), {key: f"{table}.{part}.{keys[key]}" for key in wanted})


def _subtable(system: System, effect: str, kind: EffectKind, part: str, values: Values) -> AddedEffect:
    table, (key, defaults) = _table(system, effect, part), _SUBTABLES[effect]
    if getattr(parts_of(system, table)[part], key) is not None:
        raise _already(effect, [part])
    numbers = {name: float(values.get(name, defaults.get(name, 0.0))) for name in kind.parameters}
    names = {name: f"{table}.{part}.{key}.{name}" for name in numbers}
    return AddedEffect(system.with_parameters({names[name]: value for name, value in numbers.items()}), names)


def _with_link(system: System, where: list[str], keys: Mapping[str, Any]) -> tuple[System, str]:
    """One more link under a free name."""
    base, taken = "-".join(where), {link.name for link in system.links}
    name = next(n for n in (base, *(f"{base} {k}" for k in range(2, 1000))) if n not in taken)
    link = Link(between=(where[0], where[1]), name=name, **keys)
    return System(**(_content(system) | {"links": (*system.links, link)})), name


def _content(system: System) -> dict[str, Any]:
    return {field: getattr(system, field) for field in type(system).model_fields}


def _natural(system: System, where: list[str], values: Values) -> AddedEffect:
    keys = {"gain": float(values.get("gain", 0.0)), "exponent": float(values.get("exponent", 0.25))}
    new, name = _with_link(system, where, {"natural": keys})
    return AddedEffect(new, {key: f"links.{name}.natural.{key}" for key in keys})


def _radiation(system: System, where: list[str], values: Values) -> AddedEffect:
    new, name = _with_link(system, where, {"radiation": float(values.get("coefficient", 0.0))})
    return AddedEffect(new, {"coefficient": f"links.{name}.radiation"})


def _missing(system: System, where: list[str], values: Values) -> AddedEffect:
    new, name = _with_link(system, where, {"conductance": float(values.get("conductance", 0.0))})
    return AddedEffect(new, {"conductance": f"links.{name}.conductance"})


def _lead(system: System, where: list[str], values: Values) -> AddedEffect:
    lead = Lead(module=where[1], lump=where[0], resistance=float(values.get("resistance", 0.0)))
    if any(lead.name == other.name for other in system.leads):
        raise _already("lead_heating", where)
    new = System(**(_content(system) | {"leads": (*system.leads, lead)}))
    return AddedEffect(new, {"resistance": f"leads.{lead.name}.resistance"})


def _hidden_mass(system: System, where: list[str], values: Values) -> AddedEffect:
    name = f"{where[0]}_hidden"
    if name in system.lumps:
        raise _already("hidden_mass", where)
    own = system.lumps[where[0]]
    capacity = float(values.get("capacity", 0.0)) or _TINY_MASS * own.capacity
    conductance = capacity / float(values.get("time_constant", 60.0))
    lumps = {**system.lumps, name: Lump(capacity=capacity) if own.initial is None
             else Lump(capacity=capacity, initial=own.initial)}
    link = Link(between=(where[0], name), conductance=conductance)
    new = System(**(_content(system) | {"lumps": lumps, "links": (*system.links, link)}))
    return AddedEffect(new, {"capacity": f"lumps.{name}.capacity", "time_constant": f"links.{link.name}.conductance"})


def _feedthrough(system: System, where: list[str], values: Values) -> AddedEffect:
    heater, lump = where
    if system.inputs[heater].feedthrough is not None:
        raise _already("input_feedthrough", where)
    own = system.inputs[heater].model_dump(exclude_unset=True)
    own["feedthrough"] = {"lump": lump, "share": float(values.get("share", 0.0))}
    new = System(**(_content(system) | {"inputs": {**system.inputs, heater: own}}))
    return AddedEffect(new, {"share": f"inputs.{heater}.feedthrough.share"})


def _already(effect: str, where: Sequence[str]) -> InputError:
    return InputError(f"the system has {effect} at {', '.join(where)} already", where="argument where",
                      remedy="Change its parameters with system.with_parameters.")


_BUILDERS: dict[str, Callable[[System, list[str], Values], AddedEffect]] = {
    "natural_convection": _natural, "radiation": _radiation, "missing_link": _missing,
    "missing_ambient_link": _missing, "lead_heating": _lead, "hidden_mass": _hidden_mass,
    "input_feedthrough": _feedthrough}
