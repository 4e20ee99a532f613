"""Counters that start again from zero, as the clocks of microcontrollers do."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ._options import ImportOptions
from ._table import Action, Array, Table

_PERIODS = (2.0**16, 2.0**32, 86400.0, 8.64e7, *(10.0**k for k in range(3, 13)))  # proposed, in the unit of the column
_NEAR = 0.25  # of a step: so near to one is the step across the start again


def counted_on(table: Table, header: str, values: Array, options: ImportOptions) -> Array:
    """Values of a time column of numbers, counted on where the counter starts again.

    Parameters
    ----------
    table : Table
        For lines, and its actions.
    header : str
        Header of the time column, for messages.
    values : ndarray, shape (n,)
        Cells of that column, as in the file.
    options : ImportOptions
        Declared wraps_at and restarts.

    Raises
    ------
    InputError
        A fall that is no start again at the declared value, or one that looks like it and nothing is declared.
    """
    back = np.flatnonzero(values[1:] < values[:-1]) + 1
    if not back.size:
        return values
    if options.wraps_at is None:
        if options.restarts == "refuse":
            _propose(table, header, values, back)
        return values
    period = options.wraps_at
    steps = values[back] - values[back - 1] + period
    wrong = (steps > 0.5 * period) | (values[back - 1] >= period) | (values[back] < 0.0)
    if wrong.any() and options.restarts == "refuse":
        k = int(back[np.argmax(wrong)])
        raise InputError(
            f"falls from {values[k - 1]:.10g} to {values[k]:.10g}, and a counter that starts again at {period:.10g} "
            f"does so from just below it to just above zero",
            where=table.place(k, header),
            expected="such falls alone",
            remedy='Correct wraps_at. Two runs in one file? Write restarts = "split" as well.',
        )
    wraps = back[~wrong]
    if wraps.size:
        times = f"{wraps.size} time{'s' * (wraps.size > 1)}"
        text = f"the counter {header!r} starts again at {period:.10g}, {times}; counted on"
        table.actions.append(Action("counted", int(wraps.size), text, header, table.lines.of(wraps)))
    turns = np.zeros(len(values))
    turns[wraps] = period
    return np.asarray(values + np.cumsum(turns))


def _propose(table: Table, header: str, values: Array, back: NDArray[np.intp]) -> None:
    """Refuse falls that are all one step across the same round value: a counter, or runs of that length."""
    steps = np.diff(values)
    rising = steps[steps > 0.0]
    step = float(np.median(rising)) if rising.size else 0.0
    for period in _PERIODS:
        if values.max() < period and bool(np.all(np.abs(steps[back - 1] + period - step) <= _NEAR * step)):
            k = int(back[0])
            raise InputError(
                f"falls from {values[k - 1]:.10g} to {values[k]:.10g}, one step across {period:.10g}"
                + (f" ({back.size} such places)" if back.size > 1 else ""),
                where=table.place(k, header),
                expected="time that increases",
                remedy=f"A counter that starts again there? Write wraps_at = {period:.0f}. Two runs in one file? "
                'Write restarts = "split".',
            )
