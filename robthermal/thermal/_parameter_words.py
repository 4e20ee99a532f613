"""Numbers of a system as a reader calls them: "modules.m1.seebeck.value" is the Seebeck coefficient of m1 [V/K]."""

from __future__ import annotations

_OF = {"gain": ("gain of the drive of {0}", "-"), "offset": ("offset of the drive of {0}", "unit of the input"),
       "gain_slope": ("slope of the gain of the drive of {0}", "1/unit"),
       "cubic": ("cubic term of the drive of {0}", "1/unit²"),
       "clip": ("limit of the drive of {0}", "unit of the input"),
       "delay": ("delay of the drive of {0}", "s"), "time_constant": ("lag of the drive of {0}", "s"),
       "before": ("value of {0} before the record", "unit of the input")}
_DRIVE = {f"drive.{field}": words for field, words in _OF.items()}
WORDS: dict[str, dict[str, tuple[str, str]]] = {  # by table and key: words and unit
    "ambients": {"temperature": ("temperature of {0}", "K")},
    "lumps": {
        "capacity": ("heat capacity of {0}", "J/K"), "disturbance": ("random heat into {0}", "W/√Hz"),
        "initial": ("initial temperature of {0}", "K"), "heat": ("constant heat into {0}", "W"),
        "gradient": ("ambient gradient at {0}", "K"), "periodic.heat": ("periodic heat into {0}", "W"),
        "periodic.period": ("period of the heat into {0}", "s"),
        "periodic.phase": ("phase of the heat into {0}", "rad"),
        "condensation.conductance": ("conductance of the condensation on {0}", "W/K"),
        "condensation.dew_point": ("dew point at {0}", "K")},
    "links": {
        "conductance": ("conductance of link {0}", "W/K"),
        "natural.gain": ("natural convection along link {0}", "W/K at 1 K"),
        "natural.exponent": ("exponent of the natural convection along link {0}", "-"),
        "radiation": ("radiation along link {0}", "W/K⁴"),
        "step.relative": ("relative step of the conductance of link {0}", "-"),
        "step.time": ("time of the step of link {0}", "s"),
        "follow.relative": ("growth of the conductance of link {0} with the column it follows", "1/unit"),
        "temperature_law.exponent": ("exponent of the temperature in the conductance of link {0}", "-"),
        "temperature_law.reference_temperature": ("reference temperature of link {0}", "K")},
    "inputs": {"gain": ("gain of {0}", "W per unit"), **_DRIVE, "power_slope": ("slope of the power of {0}", "1/K"),
               "feedthrough.share": ("share of {0} in another lump", "-")},
    "modules": {
        "seebeck.value": ("Seebeck coefficient of {0}", "V/K"),
        "seebeck.slope": ("slope of the Seebeck coefficient of {0}", "V/K²"),
        "resistance.value": ("resistance of {0}", "Ω"), "resistance.slope": ("slope of the resistance of {0}", "Ω/K"),
        "conductance.value": ("conductance of {0}", "W/K"),
        "conductance.slope": ("slope of the conductance of {0}", "W/K²"),
        "reference_temperature": ("reference temperature of {0}", "K"),
        "thomson": ("Thomson coefficient of {0}", "V/K"), "joule_split": ("split of the Joule heat of {0}", "-"),
        "hysteresis.heat": ("heat of the hysteresis of {0}", "W"),
        "hysteresis.time_constant": ("time constant of the hysteresis of {0}", "s"), **_DRIVE},
    "flows": {"conductance": ("heat that the coolant carries by {0}", "W/K")},
    "leads": {"resistance": ("lead resistance of {0}", "Ω")},
    "sensors": {
        "noise": ("noise of {0}", "K"), "time_constant": ("lag of {0}", "s"), "offset": ("offset of {0}", "K"),
        "gain": ("gain of {0}", "-"), "delay": ("delay of {0}", "s"), "self_heating": ("self-heating of {0}", "W"),
        "lead_resistance": ("lead resistance of {0}", "Ω"), "initial": ("initial temperature of {0}", "K")},
}


def parameter_in_words(name: str) -> str:
    """A number of the system in a sentence, as "the conductance of link sink-room".

    Parameters
    ----------
    name : str
        Dotted name of the number; returned as it is where it is none of a system.

    Returns
    -------
    str

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.thermal.parameter_in_words("modules.m1.seebeck.value")
    'the Seebeck coefficient of m1'
    """
    found = _found(name)
    return f"the {found[0]}" if found else name


def parameter_label(name: str) -> str:
    """A number of the system in a table, with its unit; of tied ones, "a = b", all with one unit.

    Parameters
    ----------
    name : str
        Dotted name of the number, or names joined by " = ".

    Returns
    -------
    str

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.thermal.parameter_label("links.sink-room.conductance")
    'conductance of link sink-room [W/K]'
    """
    parts = [_found(own) for own in name.split(" = ")]
    if not all(parts):
        return name
    return f"{' = '.join(part[0] for part in parts if part)} [{parts[0][1] if parts[0] else ''}]"


def _found(name: str) -> tuple[str, str] | None:
    """Words and unit; the longest key that fits, since names of parts may contain dots."""
    table, _, rest = name.partition(".")
    for field, (words, unit) in sorted(WORDS.get(table, {}).items(), key=lambda item: -len(item[0])):
        if rest.endswith(f".{field}"):
            return words.format(rest.removesuffix(f".{field}")), unit
    return None
