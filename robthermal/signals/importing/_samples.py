"""Rows that repeat or jump back in time: what is kept."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ._options import ImportOptions
from ._rounded import grid
from ._table import Action, Array, Table
from ._times import Clock

Rows = NDArray[np.intp]
Flags = NDArray[np.bool_]


def runs(table: Table, clock: Clock, options: ImportOptions) -> list[slice]:
    """Rows between jumps back of the time.

    Raises
    ------
    InputError
        Time that runs backward, unless restarts are to split.
    """
    seconds = clock.seconds
    back = np.flatnonzero(seconds[1:] < seconds[:-1]) + 1
    if back.size and options.restarts == "refuse":
        k = int(back[0])
        raise InputError(
            f"time runs backward, from {seconds[k - 1]:.10g} s to {seconds[k]:.10g} s"
            + (f" ({back.size} such places)" if back.size > 1 else ""),
            where=table.place(k),
            expected="time that increases",
            remedy='Two runs in one file? Write restarts = "split".',
        )
    for k in back.tolist():
        text = f"time jumps back to {seconds[k]:.10g} s; a new part begins"
        table.actions.append(Action("split", 1, text, lines=[table.lines[k]], times=[float(seconds[k])]))
    bounds = [0, *back.tolist(), len(seconds)]
    return [slice(start, stop) for start, stop in pairwise(bounds)]


def single(
    table: Table, stamps: Array, pieces: Sequence[slice], values: Sequence[Array], options: ImportOptions
) -> tuple[Array, Flags | None]:
    """Times counted on a grid where the clock rounds, and which rows stay where time stamps repeat.

    Parameters
    ----------
    table : Table
        For lines, and its actions.
    stamps : ndarray
        Time of every row [s].
    pieces : sequence of slice
        Rows of the runs.
    values : sequence of ndarray, shape (n_rows, channels)
        Changed in place where repeated rows are averaged.
    options : ImportOptions
        Import options, of which `duplicates` and `jitter` are used.

    Returns
    -------
    stamps : ndarray
        Time of every row, on a grid where it was counted [s].
    keep : ndarray of bool or None
        Rows that stay, None for all.

    Raises
    ------
    InputError
        Rows of one time with different values, unless one of them is chosen.
    """
    keep: Flags | None = None
    for rows in pieces:
        counted = grid(table, stamps[rows], rows, options)
        if counted is not None:
            stamps = stamps.copy()
            stamps[rows] = counted
            continue
        again = rows.start + 1 + np.flatnonzero(stamps[rows][1:] == stamps[rows][:-1])
        if again.size:
            keep = np.ones(len(stamps), bool) if keep is None else keep
            keep[_lost(table, stamps, again, values, options.duplicates)] = False
    return stamps, keep


def _lost(table: Table, stamps: Array, again: Rows, values: Sequence[Array], policy: str) -> Rows:
    """Rows that go, among those that repeat the time of the row before."""
    other = again[~np.logical_and.reduce([_same(matrix[again], matrix[again - 1]) for matrix in values])]
    if other.size and policy == "refuse":
        k = int(other[0])
        raise InputError(
            f"time {stamps[k]:.10g} s stands twice, with other values ({other.size} such rows)",
            where=table.place(k),
            expected="one row per time",
            remedy='Write duplicates = "first", "last" or "mean".',
        )
    if policy == "mean":
        for group in np.split(again, np.flatnonzero(np.diff(again) > 1) + 1):
            for matrix in values:
                matrix[group[0] - 1] = np.mean(matrix[group[0] - 1 : group[-1] + 1], axis=0)
    lost = again - 1 if policy == "last" else again
    table.actions.append(
        Action(
            "duplicates",
            len(lost),
            f"{len(lost)} repeated rows dropped" + (f" ({policy} kept)" if other.size else " (identical)"),
            lines=table.lines.of(lost),
            times=[float(stamps[k]) for k in lost[:50]],
            rows=len(lost),
        )
    )
    return lost


def _same(a: Array, b: Array) -> Flags:
    return np.asarray(((a == b) | (np.isnan(a) & np.isnan(b))).all(axis=1))
