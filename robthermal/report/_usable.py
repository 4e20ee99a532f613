"""The current that can be used, and the four bounds it is the smallest of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Literal

from .._digits import towards_zero
from ..errors import InputError

BOUNDS = ("contraction", "invariance", "runaway", "rating")
MEANINGS = {
    "contraction": "contraction limit inside the box; not a limit for use",
    "invariance": "largest current with a certified box that is never left",
    "runaway": "runaway limit I* of the network",
    "rating": "declared rating",
}
LIMITED_BY = {  # in a sentence, with what the word means
    "contraction": "the contraction limit inside the box, up to which any two temperature histories approach each "
                   "other there",
    "invariance": "the certified box, a range of temperatures that is never left",
    "runaway": "the runaway limit I* of the network, beyond which more current takes less heat from the cold side",
    "rating": "the declared rating",
}
Parameters = Literal["", "nominal", "ranges"]


@dataclass(frozen=True)
class Bound:
    """One bound of a current.

    Parameters
    ----------
    name : str
        "contraction", "invariance", "runaway" or "rating".
    current : float or None
        Size of the current [A]; 0 where nothing is certified, None where this bound does not apply.
    basis : str
        "proven", "computed" or "declared".
    text : str, optional
        What it rests on, in a sentence.
    file : str, optional
        Certificate file, relative to the report.

    Raises
    ------
    InputError
        Another name, a current that is not a number ≥ 0.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.report.Bound("rating", 3.3, "declared").meaning
    'declared rating'
    """

    name: str
    current: float | None
    basis: str
    text: str = ""
    file: str = ""

    def __post_init__(self) -> None:
        if self.name not in BOUNDS:
            raise InputError(f"name is {self.name!r}", where="bound of a current", expected=", ".join(BOUNDS))
        if self.current is not None and not (isfinite(self.current) and self.current >= 0.0):
            raise InputError(f"current is {self.current!r}", where=f"bound {self.name!r}", expected="a number ≥ 0 [A]")

    @property
    def meaning(self) -> str:
        """What kind of bound this is, in words."""
        return MEANINGS[self.name]


@dataclass(frozen=True)
class UsableRange:
    """The usable current of one direction, for one set of parameters.

    Parameters
    ----------
    direction : str
        "cooling", "heating" or "symmetric".
    parameters : str
        "nominal": the parameters as they stand; "ranges": all of their ranges.
    modules : sequence of str
        Modules that may have it, all at the same time and independently.
    bounds : sequence of Bound
        The bounds it is the smallest of.
    certified : float or None, optional
        Size of the current for which a box that is never left is certified, with contraction in it [A]; the usable
        current is not larger. None: nothing beside the bounds.
    files : sequence of str, optional
        Certificate files of that box.
    costly : str, optional
        Parameter whose range costs most of the current.

    Examples
    --------
    >>> import robthermal as rt
    >>> bounds = [rt.report.Bound("contraction", 5.2, "proven"), rt.report.Bound("rating", 3.3, "declared")]
    >>> rt.report.UsableRange("cooling", "nominal", ["m1"], bounds).range
    '0 to 3.3 A'
    """

    direction: str
    parameters: Parameters
    modules: Sequence[str]
    bounds: Sequence[Bound]
    certified: float | None = None
    files: Sequence[str] = ()
    costly: str = ""

    @property
    def current(self) -> float | None:
        """The usable current: smallest bound, and not more than what is certified [A]; None if no bound applies."""
        sizes = [one.current for one in self.bounds if one.current is not None]
        return min([*sizes, *([] if self.certified is None else [self.certified])], default=None)

    @property
    def limited_by(self) -> str:
        """Name of the smallest bound; empty if no bound applies."""
        sizes = {one.name: one.current for one in self.bounds if one.current is not None}
        return min(sizes, key=lambda name: sizes[name], default="")

    @property
    def range(self) -> str:
        """The range in words, rounded inward."""
        if self.current is None:
            return "no bound applies"
        if not self.current:
            return "nothing is certified"
        size = rounded_down(self.current)
        return {"cooling": f"0 to {size} A", "heating": f"-{size} to 0 A"}.get(self.direction, f"-{size} to {size} A")

    @property
    def how_sure(self) -> str:
        """What of it is proven, and what is computed or declared; empty where no bound applies or nothing is certified.
        """
        limit = self.bound(self.limited_by) if self.limited_by else None
        if limit is None or not self.current:
            return ""
        kept = "Certified for this model: no lump leaves its range in the box" if self.certified else ""
        beyond = {"computed": "the limit itself is computed, not proven", "declared": "the limit itself is declared"}
        parts = [part for part in (kept, beyond.get(limit.basis, "")) if part]
        return f"{parts[0][0].upper()}{'; '.join(parts)[1:]}." if parts else ""

    def bound(self, name: str) -> Bound | None:
        """The bound of this name.

        Parameters
        ----------
        name : str
            One of the four names.
        """
        return next((one for one in self.bounds if one.name == name), None)


def rounded_down(current: float) -> str:
    """A current with four digits, never larger than it is.

    Parameters
    ----------
    current : float
        Size of a current that may be had [A].

    Returns
    -------
    str
        For a sentence, without unit.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.report.rounded_down(1.41159)
    '1.411'
    """
    return towards_zero(current, 4)


def shown(rows: Sequence[UsableRange]) -> list[tuple[str, UsableRange, UsableRange | None]]:
    """Per direction the row that counts, and the nominal one beside it where there are two."""
    found = []
    for direction in dict.fromkeys(one.direction for one in rows):
        alike = {one.parameters: one for one in rows if one.direction == direction}
        best = alike.get("ranges") or alike.get("nominal")
        if best is not None:
            found.append((direction, best, alike.get("nominal") if best.parameters == "ranges" else None))
    return found


def summary(rows: Sequence[UsableRange]) -> dict[str, dict[str, object]]:
    """By module and direction, for JSON: four bounds, the smallest and its name; the same for nominal parameters."""
    found: dict[str, dict[str, object]] = {}
    for direction, best, nominal in shown(rows):
        for module in best.modules:
            found.setdefault(module, {})[direction] = {
                **_four(best), "headline": best.current, "limited_by": best.limited_by,
                "nominal": _four(nominal or best) | {"headline": (nominal or best).current}}
    return found


def _four(row: UsableRange) -> dict[str, object]:
    return {name: (found.current if (found := row.bound(name)) else None) for name in BOUNDS}
