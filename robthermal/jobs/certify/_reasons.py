"""Reasons that a certification gives by itself, beside those of its claims."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ..._celsius import ZERO_CELSIUS
from ...certify import heater_heat
from ...report import Reason
from ..claims import Certification, GateCode
from ._currents import CODES, box_stays_inside, current_reasons, within_usable

CERTIFY_GATES = tuple(code.code for code in (*CODES.values(), GateCode.BOX_BEYOND_TEMPERATURE,
                                           GateCode.HEATER_BEYOND_CLAIM, GateCode.NOMINAL_ONLY))


_SLIGHT = 1e-6  # of a range: rounding


def certification_reasons(result: Certification, measured: Mapping[str, tuple[float, float]] | None = None
                          ) -> tuple[Reason, ...]:
    """Reasons that a certification gives by itself.

    Parameters
    ----------
    result : Certification
        Certification, as `certify_system` returns it.
    measured : mapping, optional
        Range of the currents in the records, by module [A].
    """
    found = [*current_reasons(result.current, measured or {}, result.usable, box_inside(result))]
    found.extend(_hotter_than_stated(result))
    found.extend(_heaters_beyond(result))
    if result.parameters is None:
        found.append(remark(GateCode.NOMINAL_ONLY, "certify", "parameters", GateCode.NOMINAL_ONLY.meaning))
    return tuple(found)


def _hotter_than_stated(result: Certification) -> Iterator[Reason]:
    """Of machines without modules; with modules the usable current is what keeps the box inside the stated one."""
    if result.system.modules:
        return
    boxes = [one.certificate.region["temperature"] for one in result.checked
             if one.required and one.good and one.certificate.kind == "invariance"]
    hottest = max((float(high) for box in boxes for _, high in box.values()), default=0.0)
    stated = result.boxes.temperature[1]
    if hottest > stated:
        text = (f"With the stated heats and ambients the machine is certified to stay below "
                f"{hottest - ZERO_CELSIUS:.1f} °C, not below the stated {stated - ZERO_CELSIUS:.1f} °C.")
        yield remark(GateCode.BOX_BEYOND_TEMPERATURE, "certify", "temperature", text, hottest, stated)


def _heaters_beyond(result: Certification) -> Iterator[Reason]:
    """Heaters whose declared limits go beyond the heat that is stated for their lump."""
    stated, system = result.boxes.heat or {}, result.system
    unknown = {lump: (0.0, 0.0) for one in system.inputs.values() if one.limits is None
               for lump in (one.lump, *([one.feedthrough.lump] if one.feedthrough else []))}
    for lump, (low, high) in heater_heat(system, stated=unknown).items() if stated else ():
        least, most = stated.get(lump, (low, high))
        if lump not in unknown and (high > most + _SLIGHT * abs(most) or low < least - _SLIGHT * abs(least)):
            yield remark(GateCode.HEATER_BEYOND_CLAIM, "certify", lump, f"The claims are about {least:g} to {most:g} W "
                         f"into {lump}; by their limits its heaters may give {low:.4g} to {high:.4g} W.", high, most)


def box_inside(result: Certification) -> bool:
    """Whether the boxes that are never left are certified, for all parameters asked for, and inside the stated one."""
    good = {one.file: one.certificate for one in result.checked if one.good}
    needed = [one.file for one in result.checked if one.required and one.certificate.kind == "invariance"]
    return box_stays_inside(good, needed, result.boxes.temperature_lower == "held")


def stays_usable(result: Certification) -> bool:
    """Whether all currents of the claims are inside the usable ranges: only then is "no thermal runaway" said."""
    return within_usable(result.current, result.usable, box_inside(result))


def remark(code: GateCode, stage: str, about: str, text: str, value: float | None = None,
            limit: float | None = None) -> Reason:
    return Reason("remark", code.code, stage, about, text, code.remedy, value, limit)
