"""First rows whose time steps are irregular, as loggers write them while they start."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ._options import ImportOptions
from ._table import Action, Array, Table

_MOST = 10  # rows
_PART = 0.1  # of a run, at most


def without_startup(
    table: Table, runs: Sequence[slice], stamps: Array, step: float, threshold: float, options: ImportOptions
) -> list[slice]:
    """Runs without their first rows, up to the last of ten whose time step is irregular; what is left out is said.

    A record may begin anywhere, so that nothing is lost by it; one irregular step would have the whole log refused.

    Parameters
    ----------
    table : Table
        For lines, and its actions.
    runs : sequence of slice
        Rows of the uninterrupted runs.
    stamps : ndarray, shape (n,)
        Time of every row [s].
    step, threshold : float
        Usual step, and the one from which on it is a gap [s].
    options : ImportOptions
        Declared jitter, and fewest samples of a run.
    """
    out = []
    for rows in runs:
        n = rows.stop - rows.start
        steps = np.diff(stamps[rows.start : rows.start + min(_MOST, int(_PART * n)) + 1])
        irregular = np.flatnonzero((steps <= threshold) & (np.abs(steps - step) > options.jitter * step))
        cut = int(irregular[-1]) + 1 if irregular.size else 0
        if not cut or n - cut < options.least:
            out.append(rows)
            continue
        least, most = float(steps[:cut].min()), float(steps[:cut].max())
        first = "the first row left out: a step" if cut == 1 else f"the first {cut} rows left out: steps"
        size = f"{least:.3g} s" if least == most else f"{least:.3g} to {most:.3g} s"
        text = f"{first} of {size} before steps of {step:.6g} s, a logger that starts"
        lines = table.lines.of(np.arange(rows.start, rows.start + cut))
        table.actions.append(Action("left_out", cut, text, lines=lines, rows=cut))
        out.append(slice(rows.start + cut, rows.stop))
    return out
