"""Recorded columns that nothing in the model follows, and that were elsewhere on the days of reference."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...fitting import Data
from ...thermal import System

_APART = 0.05  # of the larger value: ranges at least so far apart


def other_inputs(system: System, new: Sequence[Data], reference: Sequence[Data]) -> tuple[str, ...]:
    """Such columns, a sentence each.

    Parameters
    ----------
    system : System
        Model of all records.
    new, reference : sequence of Data
        The new records, and those of the healthy machine.
    """
    followed = {link.follow.column for link in system.links if link.follow is not None}
    said = []
    for name, column in system.inputs.items():
        if column.gain or name in followed:
            continue
        (low, high), (least, most) = _range(new, name), _range(reference, name)
        if max(low - most, least - high) > _APART * max(abs(low), abs(high), abs(least), abs(most)):
            said.append(f"{name} is {_words(low, high)} in the new records and {_words(least, most)} in the reference "
                        "records, and nothing in the model follows it: what has changed may be its effect, which "
                        "healthy records at both would show.")
    return tuple(said)


def _range(records: Sequence[Data], name: str) -> tuple[float, float]:
    values = np.concatenate([one.record[name] for one in records if name in one.record.input_names] or [np.zeros(0)])
    values = values[np.isfinite(values)]
    return (float(values.min()), float(values.max())) if values.size else (np.nan, np.nan)


def _words(low: float, high: float) -> str:
    return f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"
