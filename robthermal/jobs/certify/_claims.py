"""All claims about one system: its boxes certified, its limits found, every certificate verified."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from math import isfinite
from typing import Any

from ...certify import (
    Runaway,
    RunawayFree,
    contraction,
    heater_heat,
    largest_regulated_current,
    runaway,
    runaway_free,
)
from ...errors import InputError
from ...report import Parameters
from ...thermal import System, drivable_range
from ...verification import Certificate, not_certified, verify
from ..claims import Certification, Checked
from ..request import Boxes
from ._currents import rest_on_certificates, usable_currents
from ._parameter_ranges import Ranges, breaking

TITLES = {"contraction": "Contraction in the stated box", "box": "The box is never left",
          "box_contraction": "Contraction in the box that is never left"}
RANGES = "_ranges"  # ending of the key of a claim for all parameters in their ranges


def certify_system(system: System, boxes: Boxes, progress: Callable[[str], None] = lambda stage: None, *,
                   parameters: Ranges | None = None) -> Certification:
    """Certify a system in its boxes and verify every certificate.

    Parameters
    ----------
    system : System
        System with the parameters of the nominal claims.
    boxes : Boxes
        Ranges of the claims.
    progress : callable, optional
        Called with a sentence before every stage.
    parameters : mapping, optional
        {parameter: (lower, upper)}: every claim is made for all of them too. Default: those of `boxes`, if it names
        some.

    Returns
    -------
    Certification

    Raises
    ------
    InputError
        Ranges that do not fit the system, a module or heater without a range.

    Examples
    --------
    >>> import robthermal as rt
    >>> done = rt.jobs.certify_system(rt.systems.two_module(), rt.jobs.Boxes(
    ...     current={"m1": (0.0, 1.0), "m2": (0.0, 1.0)}))
    >>> done.holds
    True
    """
    if parameters is None and not isinstance(boxes.parameters, str):
        parameters = boxes.parameters
    current = _currents(system, boxes)
    progress("certifying the temperature box, and that no trajectory leaves its box")
    nominal, safe = _required(system, boxes, current)
    found = list(nominal.values())
    if parameters:
        progress("certifying the same for the parameter ranges")
        robust = _robust(system, boxes, current, parameters, nominal)
        found = [one for key in nominal for one in (nominal[key], robust.get(key)) if one is not None]
    rows, limits = usable_currents(system, boxes, current, parameters, progress)
    fold: Runaway | None = None
    optional = [Checked(key, title, certificate, None, False) for key, title, certificate in limits]
    if boxes.setpoint:
        progress("searching the runaway limit")
        fold, closed = _closed_form(system, boxes.setpoint)
        optional += closed
        progress("searching the largest current while the cold faces are held")
        optional.append(Checked("regulated", "Largest current while the cold faces are held", _held(system, boxes),
                                None, False))
    progress("verifying every certificate")
    checked = tuple(_verified(one) for one in (*found, *optional))
    rows = rest_on_certificates(rows, {one.file: one.certificate for one in checked if one.good})
    return Certification(system, boxes, checked, (), fold, safe, tuple(rows), parameters)


def claims_hold(system: System, boxes: Boxes, parameters: Ranges) -> bool:
    """Whether every required claim holds for all parameters in these ranges.

    Parameters
    ----------
    system : System
        System with the parameters of the nominal claims.
    boxes : Boxes
        Ranges of the claims.
    parameters : mapping
        {parameter: (lower, upper)}.
    """
    box, safe = _claims(system, boxes, _currents(system, boxes), parameters)
    return box.holds and safe.holds


def _claims(system: System, boxes: Boxes, current: Mapping[str, Any], parameters: Ranges | None
            ) -> tuple[Certificate, RunawayFree]:
    norm: dict[str, Any] = {"method": boxes.method, "structure": boxes.structure, "large": boxes.large,
                            "parameters": parameters}
    box = contraction(system, current=current, temperature=boxes.temperature, **norm)
    return box, runaway_free(system, current=current, ambient=boxes.ambient,
                             heat=heater_heat(system, parameters, boxes.heat), **norm)


def _required(system: System, boxes: Boxes, current: Mapping[str, Any], parameters: Ranges | None = None
              ) -> tuple[dict[str, Checked], RunawayFree]:
    """Required claims by key, as yet without their checks."""
    box, safe = _claims(system, boxes, current, parameters)
    found = {"contraction": box, "box": safe.invariance}
    if safe.contraction is not safe.invariance:
        found["box_contraction"] = safe.contraction
    ending = RANGES if parameters else ""
    which: Parameters = "ranges" if parameters else "nominal"
    return {key: Checked(key + ending, TITLES[key], certificate, None, True, which)
            for key, certificate in found.items()}, safe


def _robust(system: System, boxes: Boxes, current: Mapping[str, Any], parameters: Ranges,
            nominal: Mapping[str, Checked]) -> dict[str, Checked]:
    """The same for all parameters in their ranges, with the parameter that breaks what holds without the ranges."""
    found, _ = _required(system, boxes, current, parameters)

    def holds(key: str, ranges: Ranges) -> bool:
        again, _ = _required(system, boxes, current, ranges)
        return key in again and again[key].certificate.holds

    return {key: one if one.certificate.holds or not nominal[key].certificate.holds else replace(
        one, breaks=breaking(parameters, partial(holds, key))) for key, one in found.items() if key in nominal}


def _verified(one: Checked) -> Checked:
    verdict = verify(one.certificate) if one.certificate.holds else None
    return replace(one, verdict=verdict)


def _closed_form(system: System, setpoint: Mapping[str, float]) -> tuple[Runaway | None, list[Checked]]:
    """The runaway limit of single modules with its certificates; of a system that it leaves heats out of, why not."""
    title = "Closed form of {}, constant properties (not the network)"
    try:
        fold = runaway(system, setpoint=setpoint)
    except InputError as refusal:
        if refusal.where != "argument system":  # wrong set-points are the caller's
            raise
        refused = not_certified("runaway", system={}, region={"setpoint": setpoint}, evidence={}, reason=str(refusal),
                                made_by={}, claim="Up to some current a module takes more heat with more current.")
        return None, [Checked("runaway", title.format("the modules"), refused, None, False)]
    return fold, [Checked(f"runaway_{name}", title.format(name), cert, None, False)
                  for name, cert in fold.certificates.items()]


def _held(system: System, boxes: Boxes) -> Certificate:
    """Certificate of the regulated network at its largest current; for what it does not cover, one that says so."""
    setpoint = boxes.setpoint or {}
    try:
        return largest_regulated_current(system, setpoint=setpoint, temperature=boxes.temperature).certificate
    except InputError as refusal:
        return not_certified("regulated", system={}, region={"setpoint": setpoint}, evidence={}, reason=str(refusal),
                             made_by={}, claim="While its cold faces are held, the rest of the network contracts.")


def _currents(system: System, boxes: Boxes) -> dict[str, tuple[float, float]]:
    if boxes.current is not None:
        return boxes.current
    ranges = {}
    for name, module in system.modules.items():
        declared = drivable_range(module, boxes.temperature)
        if not isfinite(declared.high - declared.low):
            raise InputError(f"module {name!r} has no current range", where=f"[modules.{name}] current_limits",
                             remedy="Declare current_limits, or give the range to certify.")
        ranges[name] = (declared.low, declared.high)
    return ranges
