"""Usable currents of a system for its report: four bounds, their certificates, and what exceeds them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from typing import Literal

from ...certify import UsableCurrent, heater_heat, usable_current
from ...report import Bound, Reason, UsableRange, rounded_down
from ...thermal import System
from ...verification import Certificate
from ..claims import GateCode
from ..request import Boxes

Direction = Literal["cooling", "heating", "symmetric"]
Found = tuple[str, str, Certificate]  # key, title, certificate
Pairs = Mapping[str, tuple[float, float]]
_NAMES = {"contraction": "contraction", "box": "invariance", "runaway": "runaway", "rating": "rating"}
CODES = {"rating": GateCode.CURRENT_BEYOND_RATING, "runaway": GateCode.CURRENT_BEYOND_RUNAWAY,
          "invariance": GateCode.CURRENT_BEYOND_INVARIANCE}
_HELD = ("held", "held_contraction")  # endings of the two certificates of a headline
_ROUNDING = 1e-9  # of a comparison between currents


def directions(current: Pairs) -> tuple[Direction, ...]:
    """Cooling and heating; symmetric too where there are to be currents of both signs."""
    both = any(low < 0.0 for low, _ in current.values()) and any(high > 0.0 for _, high in current.values())
    return ("cooling", "heating", "symmetric") if both else ("cooling", "heating")


def usable_currents(system: System, boxes: Boxes, current: Pairs, parameters: Pairs | None,
                    progress: Callable[[str], None]) -> tuple[list[UsableRange], list[Found]]:
    """Usable currents of all directions, with certificates; for the parameter ranges too where there are some."""
    rows: list[UsableRange] = []
    found: list[Found] = []
    for direction in directions(current) if system.modules else ():
        for ranges in (None, parameters) if parameters else (None,):
            progress(f"searching the usable {direction} current{', for the parameter ranges' * (ranges is not None)}")
            best = usable_current(system, direction=direction, temperature=boxes.temperature, ambient=boxes.ambient,
                                  heat=heater_heat(system, ranges, boxes.heat), setpoint=boxes.setpoint or None,
                                  parameters=ranges,
                                  lower="inside" if boxes.temperature_lower == "held" else "reported",
                                  method="energy" if boxes.method == "lyapunov" else boxes.method)
            rows.append(_row(best, direction, ranges is not None, system.module_names))
            found += _certificates(best, direction, ranges is not None)
        rows = [*rows[:-2], _at_least(rows[-2], rows[-1]), rows[-1]] if parameters else rows
    return rows, found


def _at_least(nominal: UsableRange, robust: UsableRange) -> UsableRange:
    """What is certified for parameter ranges is certified for the parameters as they stand: they are inside."""
    bounds = [more if more is not None and more.basis == "proven" and (more.current or 0.0) > (one.current or 0.0)
              else one for one in nominal.bounds for more in [robust.bound(one.name)]]
    held = nominal if (nominal.certified or 0.0) >= (robust.certified or 0.0) else robust
    return replace(nominal, bounds=bounds, certified=held.certified, files=held.files)


def _row(best: UsableCurrent, direction: str, ranges: bool, modules: tuple[str, ...]) -> UsableRange:
    bounds = [Bound(_NAMES[name], one.current if isfinite(one.current) else None, one.basis, one.text,
                    f"certificates/{_key(direction, name, ranges)}.json"
                    if one.certificate is not None and one.certificate.holds else "")
              for name, one in best.limits.items()]
    held = [f"certificates/{_key(direction, name, ranges)}.json" for name in _HELD] if best.invariance.holds else []
    return UsableRange(direction, "ranges" if ranges else "nominal", modules, bounds, best.current, held,
                       best.limiting_parameter or "")


def _certificates(best: UsableCurrent, direction: str, ranges: bool) -> Iterator[Found]:
    about = ", for the parameter ranges" * ranges
    titles = {"contraction": f"Contraction limit of {direction} currents, not a limit for use",
              "box": f"Box that is never left at the largest {direction} current",
              "runaway": f"Contraction while the cold faces are held, {direction} currents"}
    for name, one in best.limits.items():
        if one.certificate is not None and one.certificate.holds:
            yield _key(direction, name, ranges), titles[name] + about, one.certificate
    for name, certificate, what in zip(_HELD, (best.invariance, best.contraction),
                                       ("The box is never left", "Contraction in that box"), strict=True):
        if certificate.holds:
            yield _key(direction, name, ranges), f"{what} at the usable {direction} current{about}", certificate


def _key(direction: str, name: str, ranges: bool) -> str:
    return f"usable_{direction}_{name}{'_ranges' * ranges}"


def rest_on_certificates(rows: Sequence[UsableRange], certificates: Mapping[str, Certificate]) -> list[UsableRange]:
    """The same rows with every proven bound as its certificate says; 0 where there is no valid one.

    Parameters
    ----------
    rows : sequence of UsableRange
        As found, or as stored.
    certificates : mapping
        Certificates by file, only those that hold and are verified.
    """
    return [replace(row, bounds=[_rested(bound, certificates) for bound in row.bounds],
                    certified=_certified(row, certificates)) for row in rows]


def _certified(row: UsableRange, certificates: Mapping[str, Certificate]) -> float | None:
    if row.certified is None or not row.certified:
        return row.certified
    return min((_size(certificates[file]) if file in certificates else 0.0 for file in row.files), default=0.0)


def _size(certificate: Certificate) -> float:
    """Current that every module may have in the region of a certificate [A]."""
    currents = certificate.region.get("current") or {}
    return min((max(abs(float(low)), abs(float(high))) for low, high in currents.values()), default=0.0)


def _rested(bound: Bound, certificates: Mapping[str, Certificate]) -> Bound:
    if bound.basis != "proven" or bound.current is None or not (bound.current or bound.file):
        return bound
    certificate = certificates.get(bound.file)
    if certificate is None:
        return replace(bound, current=0.0, text="its certificate is not valid")
    return replace(bound, current=_size(certificate))


def box_stays_inside(good: Mapping[str, Certificate], needed: Iterable[str], held: bool) -> bool:
    """Whether the boxes that are never left are certified and lie inside the stated one.

    Parameters
    ----------
    good : mapping
        Certificates that hold and are verified, by file.
    needed : iterable of str
        Files of the boxes: for the parameters as they stand and, where asked for, for their ranges.
    held : bool
        Whether the lower ends must lie inside too.
    """
    stated = good.get("certificates/contraction.json")
    needed = list(needed)
    if stated is None or not needed or any(file not in good for file in needed):
        return False
    low, high = (float(end) for end in stated.region["temperature"])
    ends = [(float(a), float(b)) for file in needed for a, b in good[file].region["temperature"].values()]
    return all(b <= high and (a >= low or not held) for a, b in ends)


def within_usable(current: Pairs, rows: Sequence[UsableRange], inside: bool) -> bool:
    """Whether every current of these ranges is inside the usable ones; True where there is no module."""
    return not list(beyond(current, rows, inside)) and not any(
        _exceeds(size, _limit(rows, direction, None)) for _, direction, size in _sizes(current)
        if direction != "symmetric")


def beyond(current: Pairs, rows: Sequence[UsableRange], inside: bool
           ) -> Iterator[tuple[str, str, str, float, float]]:
    """Module, direction, bound, size and limit [A] wherever a range exceeds a bound other than contraction.

    `inside` says that for exactly these ranges a certified box inside the stated one is never left: currents of both
    signs need no more than that.
    """
    for module, direction, size in _sizes(current):
        for name in ("invariance",) if direction == "symmetric" else tuple(CODES):
            limit = _limit(rows, direction, name)
            if limit is not None and _exceeds(size, limit) and not (direction == "symmetric" and inside):
                yield module, direction, name, size, limit


def _exceeds(size: float, limit: float | None) -> bool:
    return limit is not None and size > limit * (1.0 + _ROUNDING)


def _sizes(current: Pairs) -> Iterator[tuple[str, str, float]]:
    both = "symmetric" in directions(current)
    for module, (low, high) in current.items():
        if high > 0.0:
            yield module, "cooling", high
        if low < 0.0:
            yield module, "heating", -low
        if both and (low or high):
            yield module, "symmetric", max(-low, high)


def _limit(rows: Sequence[UsableRange], direction: str, name: str | None) -> float | None:
    """Bound of that name, or the smallest, over the parameter ranges where there are some."""
    alike = {row.parameters: row for row in rows if row.direction == direction}
    row = alike.get("ranges") or alike.get("nominal")
    if row is None:
        return None
    bound = row.bound(name) if name else None
    if name is None:
        return row.current
    if name == "invariance" and row.certified is not None and bound is not None and bound.current is not None:
        return min(bound.current, row.certified) if row.limited_by == name else bound.current
    return bound.current if bound else None


def current_reasons(current: Pairs, measured: Pairs, rows: Sequence[UsableRange], inside: bool) -> Iterator[Reason]:
    """Failures where the certified currents exceed a bound; remarks where those of the records do.

    Parameters
    ----------
    current, measured : mapping
        Ranges of the claims and of the records, by module [A].
    rows : sequence of UsableRange
        Usable currents of every module.
    inside : bool
        Whether a certified box for exactly the claimed currents lies inside the stated one.
    """
    failed = set()
    for module, direction, name, size, limit in beyond(current, rows, inside):
        failed.add((module, name))
        usable = _limit(rows, direction, None)
        yield Reason("fail", CODES[name].code, "certify", module, f"{module} is to have {direction} currents up to "
                     f"{size:.6g} A; {_meant(name, rows)} is {rounded_down(limit)} A.", "Ask for at most "
                     f"{rounded_down(usable or 0.0)} A, the usable current.", size, limit)
    for module, direction, name, size, limit in beyond(measured, rows, True):
        if (module, name) not in failed:
            failed.add((module, name))
            yield Reason("remark", CODES[name].code, "certify", module, f"In the records {module} has {direction} "
                         f"currents up to {size:.6g} A; {_meant(name, rows)} is {rounded_down(limit)} A.", "", size,
                         limit)


def _meant(name: str, rows: Sequence[UsableRange]) -> str:
    """A bound in words: the usable current is one for all modules, and so is its rating, the smallest of them."""
    several = name == "rating" and any(len(row.modules) > 1 for row in rows)
    return "the smallest declared rating, which bounds the usable current of all modules," if several else _MEANS[name]


_MEANS = {"rating": "the declared rating", "runaway": "the runaway limit",
          "invariance": "the largest current with a certified box inside the stated one that is never left"}
