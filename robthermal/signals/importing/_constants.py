"""What a file does not hold because it never changed: a column of one number, declared."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import numpy as np

from ...errors import InputError
from ._options import ColumnChoice, Declared
from ._table import Action, Block, Source
from ._units import split_header


class _WithColumns:
    """A source with columns of one number each behind its own."""

    def __init__(self, source: Source, constants: dict[str, float]):
        table = source.table  # the same one: a text file notes there which lines it has read
        self._source, self._first, self._values = source, len(table.headers), list(constants.values())
        table.columns = [*table.columns, *(np.full(len(table.lines), value) for value in self._values)]
        table.headers = (*table.headers, *constants)
        table.units = (*table.units, *[""] * len(constants)) if table.units else ()
        self.table, self.most_rows = table, source.most_rows

    def blocks(self, numbers: Sequence[int], texts: Sequence[int]) -> Iterator[Block]:
        """As `Source.blocks`."""
        for block in self._source.blocks([k for k in numbers if k < self._first], texts):
            added = {self._first + k: np.full(len(block.lines), value) for k, value in enumerate(self._values)}
            yield Block({**block.columns, **added}, block.lines)


def with_constants(source: Source, choice: Declared, measured: Collection[str]) -> tuple[Source, Declared]:
    """A source that has a column for every constant of [columns], and the map to these columns.

    Parameters
    ----------
    source : Source
        File or table as it was opened.
    choice : Declared
        What is declared.
    measured : collection of str
        Sensors, which are no constants.

    Raises
    ------
    InputError
        A constant for a sensor, or for a name that the file has a column of.
    """
    table, found, columns = source.table, {}, dict(choice.columns)
    for name, picked in choice.columns.items():
        if picked.constant is None:
            continue
        if name in measured:
            raise InputError(f"{name!r} is a sensor, and a constant is declared for it", where=table.where,
                             expected="a column with its readings", remedy="Leave it out where it was not read.")
        own = [header for header in table.headers if name in (header, split_header(header)[0])]
        if own:
            raise InputError(f"a constant is declared for {name!r}, and there is a column {own[0]!r}",
                             where=table.where, expected="one of the two",
                             remedy=f"Leave {name} out of [columns] for this file.")
        header = f"{name} = {picked.constant:.10g}" + (f" [{picked.unit}]" if picked.unit else "")
        found[header], columns[name] = picked.constant, ColumnChoice(column=header)
    if not found:
        return source, choice
    made = _WithColumns(source, found)
    for header in found:
        made.table.actions.append(Action("mapped", 1, f"{header} throughout, as declared", header))
    return made, choice.model_copy(update={"columns": columns})
