"""design.json: every number an engineer needs to program the controller, with its unit and the equations it is for."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...design import DESIGN_FORMAT, GainObserver, gains_digest
from ...report import versions
from ...thermal import Equations, Module, System
from ._design import ControllerDesign

_LAW = ("T = (x_hot + x_cold)/2 - reference_temperature, S = seebeck.value + seebeck.slope T, R and K alike; "
        "q = v - K (x_hot - x_cold); a = S x_cold/R; s = max(2 q/R, -a^2); I = -s/(a + sqrt(a^2 + s)); "
        "clip I to current_limits; v_achieved = K (x_hot - x_cold) + R I^2/2 - S x_cold I. "
        "Positive I cools the cold face. Temperatures in kelvin: measured, or the observer's estimate.")
_PI = ("v = proportional (r - y) + z, then the law gives I and v_achieved, then "
       "z <- z + sample_time integral (r - y) + (1 - exp(-sample_time/tracking_time)) (v_achieved - v). "
       "Start with z = v_achieved of the current that flows. y is what the module regulates: the reading of a sensor "
       "at this sample as it is, or the temperature of a lump, measured or the observer's estimate.")
_RAMP = ("once per sample, before the controller: r <- r + min(max(target - r, -down sample_time), up sample_time). "
         "Start with r = y, the measured value of what the module regulates.")
_MARGIN_UNITS = {"gain": "-", "phase": "deg", "modulus": "-", "delay": "s", "crossover": "rad/s"}
_OBSERVER = ("x <- A_d x + Gamma f + L (y - C x); y = reference + (reading - offset - reference)/gain; C x is x at the "
             "sensors' lumps; f = B w + modules + nonlinear links, w: heaters, then ambients. A module adds S x_hot I "
             "+ R I^2/2 - (K - conductance.value)(x_hot - x_cold) to its hot lump and -S x_cold I + R I^2/2 + "
             "(K - conductance.value)(x_hot - x_cold) to its cold lump, S, R, K at x. A nonlinear link takes "
             "gain |dT|^exponent dT + radiation (Ta^4 - Tb^4), dT = Ta - Tb, from its first end to its second. Once "
             "per sample, with the reading and the current of this sample; the law uses x before it.")


def write_design_file(result: ControllerDesign, path: Path) -> None:
    """Write design.json."""
    path.write_text(json.dumps(design_numbers(result), indent=1, allow_nan=False) + "\n", encoding="utf-8")


def design_numbers(result: ControllerDesign) -> dict[str, Any]:
    """Everything in design.json."""
    system, done = result.certification.system, result.certification
    certified = [c.key for c in done.checked if c.good]
    gains = {name: _gains(result, i) for i, name in enumerate(result.law.names)}
    return {
        "format": DESIGN_FORMAT, "system": system.name, "holds": result.holds,
        "certificates": [f"certificates/{key}.json" for key in certified],
        "not_certified": {c.title: c.certificate.reason for c in done.checked if not c.good},
        "units": {"temperature": "K", "current": "A", "heat": "W", "time": "s"},
        "sample_time": {"value": result.controller.sample_time, "unit": "s"},
        "setpoint": {"value": result.request.setpoint, "unit": "K"},
        "certified_in": {"temperature": {"value": list(result.request.temperature), "unit": "K"}},
        "law": {"equation": _LAW,
                "modules": {name: _module(result, i, name) for i, name in enumerate(result.law.names)}},
        "controller": {"equation": _PI, "bandwidth": {"value": result.bandwidth, "unit": "rad/s"},
                       "modules": gains, "sha256": gains_digest(gains, result.controller.sample_time)},
        "setpoint_ramp": _ramp(result),
        "margins": result.margins.to_dict(), "margin_units": _MARGIN_UNITS, "margins_missed": list(result.missed),
        "observer": None if result.observer is None else _observer(system, result.observer),
        "linearity": None if result.collapse is None else {
            "meaning": "largest spread of the normalized step responses",
            "steps": {"value": list(result.collapse.steps), "unit": "K"}, "without_law": result.collapse.before,
            "with_law": result.collapse.after, "limit_active": not result.collapse.outcome.ok},
        "made_by": dict(versions()),
    }


def _ramp(result: ControllerDesign) -> dict[str, Any] | None:
    ramp = result.request.ramp(result.law.names)
    return None if ramp is None else {"equation": _RAMP, "modules": {
        name: {"up": {"value": up, "unit": "K/s"}, "down": {"value": down, "unit": "K/s"}}
        for name, up, down in zip(ramp.names, ramp.up, ramp.down, strict=True)}}


def _module(result: ControllerDesign, i: int, name: str) -> dict[str, Any]:
    part, fold = result.law.system.modules[name], result.certification.runaway
    return {"hot": part.hot, "cold": part.cold, **_properties(part),
            "current_limits": {"value": [float(result.law.current_low[i]), float(result.law.current_high[i])],
                               "unit": "A"},
            "runaway_current": {"value": fold.current[name] if fold else None, "unit": "A"},
            "runaway_load": {"value": fold.load[name] if fold else None, "unit": "W"}}


def _properties(part: Module) -> dict[str, Any]:
    units = {"seebeck": "V/K", "resistance": "ohm", "conductance": "W/K"}
    values = {key: getattr(part, key) for key in units}
    return {**{key: {"value": values[key].value, "slope": values[key].slope, "unit": unit, "slope_unit": f"{unit}/K"}
               for key, unit in units.items()},
            "reference_temperature": {"value": part.reference_temperature, "unit": "K"}}


def _gains(result: ControllerDesign, i: int) -> dict[str, Any]:
    c, point = result.controller, list(result.points.values())[i]
    return {"regulates": {"kind": point.kind, "name": point.name, "lump": point.lump, "gain": point.gain,
                          **{key: {"value": value, "unit": unit} for key, value, unit in (
                              ("offset", point.offset, "K"), ("time_constant", point.time_constant, "s"),
                              ("delay", point.delay, "s"))}},
            "proportional": {"value": float(c.proportional[i]), "unit": "W/K"},
            "integral": {"value": float(c.integral[i]), "unit": "W/(K s)"},
            "tracking_time": {"value": float(c.tracking_time[i]), "unit": "s"}}


def _observer(system: System, found: GainObserver) -> dict[str, Any]:
    model, B = found.model, Equations(system).B.toarray()
    heaters, ambients = len(system.inputs), len(system.ambients)
    columns = [*range(heaters), *range(B.shape[1] - ambients, B.shape[1])]
    return {"equation": _OBSERVER, "method": found.method, "lumps": list(system.lump_names),
            "heaters_and_ambients": [*system.input_names, *system.ambient_names],
            "reference": {"value": next(iter(system.ambients.values())).temperature, "unit": "K"},
            "sensors": [_sensor(system, name) for name in found.sensors],
            "bent_links": [_bent(link) for link in system.links
                           if link.natural is not None or link.radiation is not None],
            "A_d": {"value": model.A_d.tolist(), "unit": "K/K"},
            "Gamma": {"value": model.Gamma.tolist(), "unit": "K/W"},
            "B": {"value": B[:, columns].tolist(), "unit": "W/unit of the heater, W/K"},
            "L": {"value": found.gain.tolist(), "unit": "K/K"}}


def _sensor(system: System, name: str) -> dict[str, Any]:
    sensor = system.sensors[name]
    return {"name": name, "lump": sensor.lump, "gain": sensor.gain, "offset": {"value": sensor.offset, "unit": "K"}}


def _bent(link: Any) -> Mapping[str, Any]:
    return {"between": list(link.between), "gain": link.natural.gain if link.natural else 0.0,
            "exponent": link.natural.exponent if link.natural else 0.0, "radiation": link.radiation or 0.0}
