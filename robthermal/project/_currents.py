"""Usable currents of a system for its report: four bounds, their certificates, and what exceeds them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from typing import Literal

from ..certify import UsableCurrent, usable_current
from ..report import Bound, Reason, UsableRange
from ..thermal import System
from ..verification import Certificate
from ._codes import GateCode
from ._schema import Boxes

Direction = Literal["cooling", "heating", "symmetric"]
Found = tuple[str, str, Certificate]  # key, title, certificate
Pairs = Mapping[str, tuple[float, float]]
_NAMES = {"contraction": "contraction", "box": "invariance", "runaway": "runaway", "rating": "rating"}
_CODES = {"rating": GateCode.CURRENT_BEYOND_RATING, "runaway": GateCode.CURRENT_BEYOND_RUNAWAY,
          "invariance": GateCode.CURRENT_BEYOND_INVARIANCE}
_ROUNDING = 1e-9  # of a comparison between currents


def directions(current: Pairs) -> tuple[Direction, ...]:
    """Cooling and heating; symmetric too where a module is to have currents of both signs."""
    both = any(low < 0.0 < high for low, high in current.values())
    return ("cooling", "heating", "symmetric") if both else ("cooling", "heating")


def usable_currents(system: System, boxes: Boxes, current: Pairs, heat: Pairs, parameters: Pairs | None,
                    progress: Callable[[str], None]) -> tuple[list[UsableRange], list[Found]]:
    """Usable currents of all directions, for the parameters as they stand and for their ranges, with certificates."""
    rows, found = [], []
    for direction in directions(current) if system.modules else ():
        for ranges in (None, parameters) if parameters else (None,):
            progress(f"searching the usable {direction} current{', for the parameter ranges' * (ranges is not None)}")
            best = usable_current(system, direction=direction, temperature=boxes.temperature, ambient=boxes.ambient,
                                  heat=heat, setpoint=boxes.setpoint or None, parameters=ranges,
                                  lower="inside" if boxes.temperature_lower == "held" else "reported",
                                  method="energy" if boxes.method == "lyapunov" else boxes.method)
            rows.append(_row(best, direction, ranges is not None, system.module_names))
            found += _certificates(best, direction, ranges is not None)
    return rows, found


def _row(best: UsableCurrent, direction: str, ranges: bool, modules: tuple[str, ...]) -> UsableRange:
    bounds = [Bound(_NAMES[name], one.current if isfinite(one.current) else None, one.basis, one.text,
                    f"certificates/{_key(direction, name, ranges)}.json"
                    if one.certificate is not None and one.certificate.holds else "")
              for name, one in best.limits.items()]
    return UsableRange(direction, "ranges" if ranges else "nominal", modules, bounds)


def _certificates(best: UsableCurrent, direction: str, ranges: bool) -> Iterator[Found]:
    about = ", for the parameter ranges" * ranges
    titles = {"contraction": f"Contraction limit of {direction} currents, not a limit for use",
              "box": f"Box that is never left at the largest {direction} current",
              "runaway": f"Contraction while the cold faces are held, {direction} currents"}
    for name, one in best.limits.items():
        if one.certificate is not None and one.certificate.holds:
            yield _key(direction, name, ranges), titles[name] + about, one.certificate
    for name, certificate, what in (("held", best.invariance, "The box is never left"),
                                    ("held_contraction", best.contraction, "Contraction in that box")):
        if certificate is not None and certificate.holds:
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
    return [replace(row, bounds=[_rested(bound, certificates) for bound in row.bounds]) for row in rows]


def _rested(bound: Bound, certificates: Mapping[str, Certificate]) -> Bound:
    if bound.basis != "proven" or bound.current is None or not (bound.current or bound.file):
        return bound
    certificate = certificates.get(bound.file)
    if certificate is None:
        return replace(bound, current=0.0, text="its certificate is not valid")
    sizes = [max(abs(float(low)), abs(float(high))) for low, high in certificate.region["current"].values()]
    return replace(bound, current=min(sizes, default=0.0))


def within_usable(current: Pairs, rows: Sequence[UsableRange]) -> bool:
    """Whether every current of these ranges is inside the usable ones; True where there is no module."""
    return not any(True for _ in beyond(current, rows)) and all(
        limit is None or size <= limit * (1.0 + _ROUNDING)
        for _, direction, size in _sizes(current) for limit in [_limit(rows, direction, None)])


def beyond(current: Pairs, rows: Sequence[UsableRange]) -> Iterator[tuple[str, str, str, float, float]]:
    """Module, direction, bound, size and limit [A] wherever a range exceeds a bound other than contraction."""
    for module, direction, size in _sizes(current):
        for name in _CODES:
            limit = _limit(rows, direction, name)
            if limit is not None and size > limit * (1.0 + _ROUNDING):
                yield module, direction, name, size, limit


def _sizes(current: Pairs) -> Iterator[tuple[str, str, float]]:
    both = any(low < 0.0 < high for low, high in current.values()) or (
        any(low < 0.0 for low, _ in current.values()) and any(high > 0.0 for _, high in current.values()))
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
    return row.current if name is None else bound.current if bound else None


def current_reasons(current: Pairs, measured: Pairs, rows: Sequence[UsableRange]) -> Iterator[Reason]:
    """Failures where the certified currents exceed a bound; remarks where those of the records do.

    Parameters
    ----------
    current, measured : mapping
        Ranges of the claims and of the records, by module [A].
    rows : sequence of UsableRange
        Usable currents.
    """
    failed = set()
    for module, direction, name, size, limit in beyond(current, rows):
        failed.add((module, name))
        usable = _limit(rows, direction, None)
        yield Reason("fail", _CODES[name].code, "certify", module, f"{module} is to have {direction} currents up to "
                     f"{size:.4g} A; {_MEANS[name]} is {limit:.4g} A.", f"Ask for at most {usable or 0.0:.4g} A, the "
                     "usable current.", size, limit)
    for module, direction, name, size, limit in beyond(measured, rows):
        if (module, name) not in failed and direction != "symmetric":
            failed.add((module, name))
            yield Reason("remark", _CODES[name].code, "certify", module, f"In the records {module} has {direction} "
                         f"currents up to {size:.4g} A; {_MEANS[name]} is {limit:.4g} A.", "", size, limit)


_MEANS = {"rating": "the declared rating", "runaway": "the runaway limit",
          "invariance": "the largest current with a certified box inside the stated one that is never left"}
