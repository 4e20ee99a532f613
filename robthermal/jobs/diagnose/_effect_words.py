"""Effects of the catalog at their places, in words that follow "the model lacks …"."""

from __future__ import annotations

import re

from ...thermal import System, parameter_in_words

WORDS = {  # {0}, {1}: the parts it acts on, in the order of the catalog
    "ambient_drift": "a swing or drift of {0}, which was not recorded",
    "ambient_gradient": "an ambient at {0} that is warmer or colder than the measured one",
    "condensation": "condensation on {0}",
    "conductance_exponent": "a dependence of the conductance {0} on its temperature",
    "conductance_slope": "the slope of the conductance of {0} over temperature",
    "conductance_step": "a change of the conductance {0} during the record",
    "coolant_warming": "the warming of {0} at the lumps that it passes",
    "driven_conductance": "a growth of the conductance {0} with {1}",
    "driven_heat": "a heat into {1} in proportion to {0}",
    "heat_source": "a constant heat into {0}",
    "heater_power_slope": "a dependence of the power of {0} on its temperature",
    "hidden_mass": "a mass that hangs on {0}",
    "hysteresis": "a late extra heat of {0}, of the sign of its current",
    "input_delay": "the delay of input {0}",
    "input_feedthrough": "a share of the heat of {0} that goes to {1}",
    "input_gain": "a gain error of input {0}",
    "input_gain_slope": "a growth of the gain of {0} with its level",
    "input_lag": "the lag of input {0}",
    "input_offset": "an offset of input {0}",
    "input_saturation": "the saturation of input {0}",
    "joule_split": "an uneven split of the Joule heat of {0}",
    "lead_heating": "heat of the leads of {1} into {0}",
    "missing_ambient_link": "a heat path from {0} to {1}",
    "missing_link": "a heat path between {0} and {1}",
    "natural_convection": "natural convection from {0} to {1}",
    "path_mass": "a mass within the path {0}",
    "periodic_load": "a periodic heat into {0}",
    "radiation": "radiation from {0} to {1}",
    "resistance_slope": "the slope of the resistance of {0} over temperature",
    "seebeck_slope": "the slope of the Seebeck coefficient of {0} over temperature",
    "sensor_gain": "a gain error of sensor {0}",
    "sensor_lag": "the lag of sensor {0}",
    "sensor_offset": "an offset of sensor {0}",
    "sensor_self_heating": "self-heating of sensor {0}",
    "thomson": "the Thomson heat of {0}",
}

_FOLLOWED = {  # of a column that heats nothing: the imperfection is of what follows it
    "input_delay": "a delay of what follows {0}",
    "input_gain_slope": "a growth of what follows {0} that is not in proportion to it",
    "input_lag": "a lag of what follows {0}",
    "input_saturation": "a growth of what follows {0} that is less than in proportion to it",
}


def in_words(name: str, where: tuple[str, ...]) -> str:
    """An effect at its place.

    Parameters
    ----------
    name : str
        Of the catalog, or your own.
    where : tuple of str
        Parts of the system it acts on.
    """
    if name == "parameter_change":
        return f"a change of {' and '.join(map(parameter_in_words, where))}"
    if name in WORDS:
        return WORDS[name].format(*where)
    return f"{name.replace('_', ' ')} at {', '.join(where)}"


def at_place(system: System, name: str, where: tuple[str, ...]) -> str:
    """An effect at its place in a system, in which some columns heat nothing.

    Parameters
    ----------
    system : System
        Without the effect.
    name : str
        Of the catalog, or your own.
    where : tuple of str
        Parts of the system it acts on.
    """
    column = system.inputs.get(where[0]) if where else None
    if name in _FOLLOWED and column is not None and not column.gain:
        return _FOLLOWED[name].format(*where)
    return in_words(name, where)


def labels_in_words(text: str) -> str:
    """A sentence with the labels of tables in it, for example sensor_lag(T6), written out.

    Parameters
    ----------
    text : str
        Sentence of a diagnosis.
    """
    return re.sub(r"\b([a-z]+(?:_[a-z]+)*)\(([^()]+)\)", _written_out, text)


def _written_out(label: re.Match[str]) -> str:
    name, where = label.group(1), tuple(label.group(2).split(", "))
    return in_words(name, where) if name in WORDS or name == "parameter_change" else label.group()
