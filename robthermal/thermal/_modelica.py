"""A system as one Modelica model: plain equations, SI units, no library needed."""

from __future__ import annotations

from pathlib import Path

from .._write import write
from ..errors import InputError
from ._modelica_text import Text
from ._parts import Drive, Input, Link, Module, Sensor
from ._system import System, equations


def write_modelica(system: System, path: str | Path, name: str = "") -> None:
    """Write a system as a Modelica model (.mo).

    Every effect that a system can hold is written. Inputs are the heaters, module currents and ambients, outputs the
    sensor readings; every number of the system file is a parameter. Random disturbances and sensor noise are left out,
    as in `simulate`.

    Parameters
    ----------
    system : System
        What to write.
    path : str or Path
        Where to; replaced in one step.
    name : str
        Name of the model; default the system's.

    Raises
    ------
    InputError
        The file cannot be written.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.thermal.write_modelica(rt.systems.two_module(), "setup.mo", "TwoModule")
    """
    write(path, format_modelica(system, name).encode("ascii"))


def format_modelica(system: System, name: str = "") -> str:
    """Modelica text of a system.

    Parameters
    ----------
    system : System
        What to write.
    name : str
        Name of the model; default the system's. What Modelica does not allow in a name becomes an underscore.

    Returns
    -------
    str

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.thermal.format_modelica(rt.systems.two_module(), "TwoModule").splitlines()[0]
    'model TwoModule "two-module application setup"'
    """
    equations(system)  # refuses what is no system
    text = Text(system.name, name or system.name)
    _columns(system, text)
    heats: dict[str, list[str]] = {lump: [] for lump in system.lumps}
    driven: dict[str, Input | Module] = {**system.inputs, **system.modules}
    for column, driver in driven.items():
        _drive(text, column, driver.drive)
    for link in system.links:
        _link(system, text, link, heats)
    for module, part in system.modules.items():
        _module(system, text, module, part, heats)
    for lead in system.leads:
        resistance = text.parameter(f"R_{lead.name}", lead.resistance, "Ohm")
        heats[lead.lump].append(f"+ {resistance} * {_driven(text, lead.module)}^2")
    for flow in system.flows:
        conductance = text.parameter(f"flow_{flow.name}", flow.conductance, "W/K")
        heats[flow.downstream].append(
            f"+ {conductance} * ({text[flow.upstream]} - {_seen(system, text, flow.ambient, flow.downstream)})")
    for heater in system.inputs:
        _heater(system, text, heater, heats)
    for sensor, own in system.sensors.items():
        _sensor(system, text, sensor, own, heats)
    for lump in system.lumps:
        _lump(system, text, lump, heats[lump])
    return text.model()


def _columns(system: System, text: Text) -> None:
    """First, so that names of the file stay as they are."""
    for heater in system.inputs:
        text.column("input", heater, "", f"heater {heater}")
    for module in system.modules:
        text.column("input", module, "A", f"current of module {module}")
    for ambient in system.ambients:
        text.column("input", ambient, "K", f"ambient {ambient}")
    for sensor in system.sensors:
        text.column("output", sensor, system.sensors[sensor].unit, f"reading of sensor {sensor}")
    first = next(iter(system.ambients.values())).temperature
    for lump, part in system.lumps.items():
        text.state(lump, "K", first if part.initial is None else part.initial, f"temperature of lump {lump}")
    text.know("nominal", text.parameter("T_nominal", first, "K", "about which sensor gains and heater slopes act"))
    for lump, part in system.lumps.items():
        if part.gradient:
            text.know(f"gradient {lump}", text.parameter(f"gradient_{lump}", part.gradient, "K"))


def _driven(text: Text, column: str) -> str:
    """What a heater or an amplifier makes of its column."""
    return text.known(f"driven {column}", column)


def _drive(text: Text, column: str, drive: Drive) -> None:
    if drive == Drive():
        return
    if drive.before is not None:
        raise InputError(f"{column} has a value from before the record", where="argument system",
                         expected="drives that begin with their first value", remedy="Leave drive.before out.")
    u = text[column]
    gain, offset = text.parameter(f"{column}_gain", drive.gain, "1"), text.parameter(f"{column}_offset", drive.offset)
    slope = text.parameter(f"{column}_gain_slope", drive.gain_slope)
    cubic = text.parameter(f"{column}_cubic", drive.cubic)
    linear = text.variable(f"{column}_linear", "", f"(1 + {gain}) * {u} + {offset}")
    shaped = f"(1 + {slope} * abs({linear})) * {linear} - {cubic} * {linear}^3"
    if drive.clip is not None:
        clip = text.parameter(f"{column}_clip", drive.clip)
        shaped = f"max(-{clip}, min({clip}, {shaped}))"
    now = text.variable(f"{column}_shaped", "", shaped)
    if drive.delay:
        delay = text.parameter(f"{column}_delay", drive.delay, "s")
        now = text.variable(f"{column}_late", "", f"delay({now}, {delay})")
    text.know(f"early {column}", now)
    if drive.time_constant:
        tau = text.parameter(f"{column}_time_constant", drive.time_constant, "s")
        now = text.lag(f"{column}_lagged", "", tau, now, now)
    text.know(f"driven {column}", now)


def _link(system: System, text: Text, link: Link, heats: dict[str, list[str]]) -> None:
    """Heat from the first end to the second."""
    a, b = (_seen(system, text, end, other) for end, other in (link.between, link.between[::-1]))
    flows = []
    if link.conductance:
        conductance, changes = text.parameter(f"G_{link.name}", link.conductance, "W/K"), list[str]()
        if link.step:
            relative = text.parameter(f"step_{link.name}", link.step.relative, "1")
            time = text.parameter(f"step_time_{link.name}", link.step.time, "s")
            changes.append(f"(if time >= {time} then {relative} else 0)")
        if link.follow:
            growth = text.parameter(f"follow_{link.name}", link.follow.relative)
            changes.append(f"{growth} * abs({_driven(text, link.follow.column)})")
        if link.temperature_law:
            exponent = text.parameter(f"law_{link.name}", link.temperature_law.exponent, "1")
            at = text.parameter(f"law_temperature_{link.name}", link.temperature_law.reference_temperature, "K")
            changes.append(f"((({a} + {b}) / (2 * {at}))^{exponent} - 1)")
        if changes:
            conductance += f" * (1 + {' + '.join(changes)})"
        flows.append(f"{conductance} * ({a} - {b})")
    if link.natural:
        gain = text.parameter(f"natural_{link.name}", link.natural.gain)
        exponent = text.parameter(f"exponent_{link.name}", link.natural.exponent, "1")
        flows.append(f"{gain} * noEvent(abs({a} - {b}))^{exponent} * ({a} - {b})")
    if link.radiation is not None:
        coefficient = text.parameter(f"radiation_{link.name}", link.radiation, "W/K4")
        flows.append(f"{coefficient} * ({a}^4 - {b}^4)")
    flow = text.variable(f"Q_{link.name}", "W", " + ".join(flows) or "0", f"heat from {' to '.join(link.between)}")
    for end, sign in zip(link.between, "-+", strict=True):
        if end in heats:
            heats[end].append(f"{sign} {flow}")


def _seen(system: System, text: Text, end: str, other: str) -> str:
    """A lump with a gradient sees its ambients warmer than they are."""
    if end not in system.ambients or not system.lumps[other].gradient:
        return text[end]
    return f"({text[end]} + {text.known(f'gradient {other}')})"


def _module(system: System, text: Text, name: str, module: Module, heats: dict[str, list[str]]) -> None:
    """Evers (5.4)-(5.5), (5.13), corrected: S, R, K at the mean temperature of the faces."""
    hot, cold, current = text[module.hot], text[module.cold], _driven(text, name)
    reference = text.parameter(f"{name}_T_ref", module.reference_temperature, "K")
    warmer = text.variable(f"{name}_warmer", "K", f"({hot} + {cold}) / 2 - {reference}")
    S, R, K = (text.variable(f"{name}_{symbol}", unit, f"{text.parameter(f'{name}_{symbol}_ref', part.value, unit)} + "
                             f"{text.parameter(f'{name}_{symbol}_slope', part.slope, f'{unit}/K')} * {warmer}")
               for symbol, unit, part in (("S", "V/K", module.seebeck), ("R", "Ohm", module.resistance),
                                          ("K", "W/K", module.conductance)))
    thomson = text.parameter(f"{name}_thomson", module.thomson, "V/K")
    split = text.parameter(f"{name}_split", module.joule_split, "1")
    if any(sensor.module == name for sensor in system.sensors.values()):
        difference = f"({S} - {thomson}) * ({hot} - {cold})"
        text.know(f"open circuit {name}", text.variable(f"{name}_open", "V", difference, "voltage without current"))
        text.know(f"resistance {name}", R)
    joule = text.variable(f"{name}_joule", "W", f"{R} * {current}^2 / 2", "half of the Joule heat")
    taken = text.variable(f"{name}_taken", "W", f"{thomson} * {current} * ({hot} - {cold}) / 2", "half Thomson heat")
    leak = text.variable(f"{name}_leak", "W", f"{K} * ({hot} - {cold})", "conducted heat")
    heats[module.hot] += [f"+ {S} * {hot} * {current}", f"+ (1 - 2 * {split}) * {joule}", f"- {taken}", f"- {leak}"]
    heats[module.cold] += [f"- {S} * {cold} * {current}", f"+ (1 + 2 * {split}) * {joule}", f"- {taken}", f"+ {leak}"]
    if module.hysteresis:
        heat = text.parameter(f"{name}_memory_heat", module.hysteresis.heat, "W")
        tau = text.parameter(f"{name}_memory_time", module.hysteresis.time_constant, "s")
        memory = text.lag(f"{name}_memory", "1", tau, f"sign({text.known(f'early {name}', name)})", "0")
        heats[module.cold].append(f"+ {heat} * {memory}")


def _heater(system: System, text: Text, name: str, heats: dict[str, list[str]]) -> None:
    part = system.inputs[name]
    power = f"{text.parameter(f'{name}_power', part.gain, '', 'W per unit')} * {_driven(text, name)}"
    if part.power_slope is not None:
        slope = text.parameter(f"{name}_power_slope", part.power_slope, "1/K")
        power += f" * (1 + {slope} * ({text[part.lump]} - {text.known('nominal')}))"
    heat = text.variable(f"Q_{name}", "W", power, f"heat of heater {name}")
    if part.feedthrough is None:
        heats[part.lump].append(f"+ {heat}")
        return
    share = text.parameter(f"{name}_share", part.feedthrough.share, "1")
    heats[part.lump].append(f"+ (1 - {share}) * {heat}")
    heats[part.feedthrough.lump].append(f"+ {share} * {heat}")


def _sensor(system: System, text: Text, name: str, sensor: Sensor, heats: dict[str, list[str]]) -> None:
    gain = text.parameter(f"{name}_gain", sensor.gain, "1")
    offset = text.parameter(f"{name}_offset", sensor.offset, sensor.unit)
    if sensor.module:
        lead = text.parameter(f"{name}_lead", sensor.lead_resistance or 0.0, "Ohm")
        resistance, current = text.known(f"resistance {sensor.module}"), _driven(text, sensor.module)
        opened = text.known(f"open circuit {sensor.module}")
        text.equation(f"{text[name]} = {gain} * ({opened} + ({resistance} + {lead}) * {current}) + {offset}")
        return
    if sensor.self_heating:
        heats[sensor.lump].append(f"+ {text.parameter(f'{name}_self_heating', sensor.self_heating, 'W')}")
    source = text[sensor.lump]
    if sensor.time_constant:
        tau = text.parameter(f"{name}_time_constant", sensor.time_constant, "s")
        start = source if sensor.initial is None else text.parameter(f"{name}_initial", sensor.initial, "K")
        source = text.lag(f"{name}_lagged", "K", tau, source, start)
    if sensor.delay:
        source = f"delay({source}, {text.parameter(f'{name}_delay', sensor.delay, 's')})"
    nominal = text.known("nominal")
    text.equation(f"{text[name]} = {nominal} + {gain} * ({source} - {nominal}) + {offset}")


def _lump(system: System, text: Text, name: str, heats: list[str]) -> None:
    part, capacity = system.lumps[name], text.parameter(f"C_{name}", system.lumps[name].capacity, "J/K")
    if part.heat:
        heats.append(f"+ {text.parameter(f'heat_{name}', part.heat, 'W')}")
    if part.periodic:
        heat = text.parameter(f"periodic_{name}", part.periodic.heat, "W")
        period = text.parameter(f"period_{name}", part.periodic.period, "s")
        phase = text.parameter(f"phase_{name}", part.periodic.phase, "rad")
        heats.append(f"+ {heat} * sin(6.283185307179586 * time / {period} + {phase})")
    if part.condensation:
        conductance = text.parameter(f"condensation_{name}", part.condensation.conductance, "W/K")
        dew_point = text.parameter(f"dew_point_{name}", part.condensation.dew_point, "K")
        heats.append(f"+ {conductance} * max(0, {dew_point} - {text[name]})")
    text.equation(f"{capacity} * der({text[name]}) = {' '.join(heats).removeprefix('+ ') or '0'}")
