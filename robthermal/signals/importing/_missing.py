"""What is said of a name without a column: which header it may be, and what else can be done."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from ...errors import InputError
from .._names import fold, misspelt
from ._options import ColumnChoice
from ._table import Table
from ._units import split_header, unit_of

KINDS = {
    "input": "heater",
    "current": "module current",
    "ambient": "ambient",
    "sensor": "sensor",
    "voltage": "module voltage",
}
_LISTED = 200  # characters of a list of headers in a message
_QUANTITIES = {"input": ("power", "percent"), "current": ("current",), "voltage": ("voltage",),
               "ambient": ("temperature",), "sensor": ("temperature",)}
_SURE, _MAYBE, _OTHER = range(3)  # whether a column holds such a quantity, by its unit


@dataclass(frozen=True)
class Sought:
    """A name that a column is looked for.

    Parameters
    ----------
    name, role : str
        In the system, as of `Channel`; the role is empty without a system.
    picked : ColumnChoice or None
        What is declared of it.
    unit : str or None
        That the system gives an input.
    gain : float
        Heat per unit of an input [W]; an input of gain 0 may be anything.
    """

    name: str
    role: str = ""
    picked: ColumnChoice | None = None
    unit: str | None = None
    gain: float = 1.0

    @property
    def quantities(self) -> Sequence[str]:
        """What its column may hold, as of `Unit`; none where it may hold anything."""
        picked, own = self.picked, unit_of(self.unit or "")
        if picked is not None and picked.resistance is not None:
            return ("voltage", "current")
        if picked is not None and (picked.thermistor is not None or picked.scale is not None):
            return ()
        if self.role == "input" and (own is not None or self.unit or self.gain == 0.0):
            return (own.quantity,) if own is not None else ()
        return _QUANTITIES.get(self.role, ())


def refuse_misspelt(table: Table, sought: Sought, free: Sequence[int]) -> None:
    """Refuse a header that is the name but for a letter, and may be it.

    Parameters
    ----------
    table : Table
        For its headers and units, and the file in messages.
    sought : Sought
        Name without a column, of which nothing is declared.
    free : sequence of int
        Columns that nobody uses.
    """
    likely, _ = _ordered(table, sought, free)
    for header in likely:
        if misspelt(split_header(header)[0], [sought.name]) is not None:
            others = _listed([other for other in likely if other != header])
            raise InputError(
                f"there is no column {sought.name!r} ({KINDS[sought.role]}), but {header!r}",
                where=table.where,
                expected="the names of the system file",
                remedy=f"Write --column '{sought.name}={header}' (or [columns]) if it is the same; else the column "
                f"that {sought.name!r} is: {others or 'there is no other'}. If it is none, give {header!r} a name less "
                "alike.",
            )


def missing(table: Table, sought: Sought, free: Sequence[int]) -> InputError:
    """What is said of a name that needs a column.

    Parameters
    ----------
    table : Table
        For its headers and units, and the file in messages.
    sought : Sought
        Name without a column.
    free : sequence of int
        Columns that nobody uses.
    """
    name, picked = sought.name, sought.picked
    if picked is None and name in table.facts.get("left_out", {}):
        return InputError(f"column {name!r} is {table.facts['left_out'][name]}", where=table.where,
                          expected="a numeric vector as long as the others")
    likely, others = _ordered(table, sought, free)
    alike = _alike(likely, [name] if picked is None else [name, picked.column.strip()])
    example = alike or _only(table, sought, likely, free) or "HEADER"
    remedy = [f"Did you mean {split_header(alike)[0]!r}?"] if alike else []
    if likely or others:
        remedy += [f"Write {_choice(sought, example)} (or [columns]) with one of: {_listed([*likely, *others])}."]
    else:
        remedy += ["Every column has a name already."]
    driven = sought.role in ("input", "current")
    if picked is None and driven:
        remedy += [f"Zeros if {name!r} was off: [columns] {name} = {{ constant = 0.0 }}, or what it was throughout."]
    if picked is not None:
        remedy += _per_file(table, sought)
    kind = f" ({KINDS[sought.role]})" if sought.role in KINDS else ""
    what = f"{name!r}{kind}" if picked is None else f"{picked.column.strip()!r}, declared for {name!r}{kind}"
    return InputError(
        f"there is no column {what}",
        where=table.where,
        expected="a column for every heater and module" if picked is None and driven else "a header of the file",
        remedy=" ".join(remedy),
    )


def _per_file(table: Table, sought: Sought) -> list[str]:
    """What to do where the headers differ from file to file."""
    said = []
    if sought.role not in ("input", "current", ""):
        said += [f"A file without this {KINDS[sought.role]} is read if {sought.name} is not in [columns]."]
    if not Path(table.where).suffix:  # a table in memory
        return said
    return [*said, f'Files with different headers: in a project file, each with its own, {{ file = '
                   f'"{Path(table.where).name}", columns = {{ … }} }}; --column is for all files.']


def _ordered(table: Table, sought: Sought, free: Sequence[int]) -> tuple[list[str], list[str]]:
    """Headers that may be it, those in a unit of its quantity first, and those that are in another unit."""
    ranks = {place: _rank(table, sought.quantities, place) for place in free}
    ordered = sorted(free, key=ranks.__getitem__)
    return ([table.headers[k] for k in ordered if ranks[k] < _OTHER],
            [table.headers[k] for k in ordered if ranks[k] == _OTHER])


def _rank(table: Table, quantities: Sequence[str], place: int) -> int:
    unit = unit_of(table.unit_text(place) or "")
    return _MAYBE if unit is None or not quantities else _SURE if unit.quantity in quantities else _OTHER


def _alike(headers: Sequence[str], names: Sequence[str]) -> str | None:
    """Header whose name is nearest one of the names; None where none is near."""
    known = {fold(split_header(header)[0]): header for header in headers}
    for name in names:
        close = get_close_matches(fold(split_header(name)[0]), known, n=1)
        if close:
            return known[close[0]]
    return None


def _only(table: Table, sought: Sought, likely: Sequence[str], free: Sequence[int]) -> str | None:
    """The header that is left where there is one; of the temperatures of a machine one is as good as another."""
    if sought.role in ("sensor", "ambient"):
        return None
    sure = [table.headers[k] for k in free if _rank(table, sought.quantities, k) == _SURE]
    found = sure or likely
    return found[0] if len(found) == 1 else None


def _choice(sought: Sought, header: str) -> str:
    """What to write on the command line, with what else is declared of the name."""
    more = {} if sought.picked is None else sought.picked.model_dump(
        mode="json", exclude_unset=True, exclude={"column", "unit"})
    text = json.dumps({"column": header, **more}, ensure_ascii=False) if more else header
    return f"--column '{sought.name}={text}'"


def _listed(headers: Sequence[str]) -> str:
    text = ", ".join(map(repr, headers))
    return text if len(text) <= _LISTED else text[:_LISTED] + " …"
