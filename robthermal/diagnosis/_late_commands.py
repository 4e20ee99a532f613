"""Whether delays of all heaters are one row of the log: then it may be the log that is late, not the machine."""

from __future__ import annotations

from .data import commands
from .fit import Refit
from .search import quantities_of

_NEAR = 0.15  # of a sample time
_SURE = 3.0  # standard deviations


def late_by_rows(fit: Refit) -> list[str]:
    """Where every heater and module acts late by the same number of samples: that the log may be so, a sentence.

    Parameters
    ----------
    fit : Refit
        With the effects accepted.
    """
    if not fit.records:
        return []
    record, structure = fit.records[0].one.record, fit.structure
    sent = set(commands(structure.base, record))
    delays = {effect.where[0]: quantities_of(fit, place)["delay"] for place, effect in enumerate(structure.effects)
              if effect.effect.name == "input_delay"}
    if not sent or set(delays) != sent:
        return []
    h = record.sample_time
    rows = {round(delay / h) for delay, _ in delays.values()}
    if rows == {0} or len(rows) > 1 or any(abs(delay - round(delay / h) * h) > max(_NEAR * h, _SURE * std)
                                           for delay, std in delays.values()):
        return []
    n = rows.pop()
    late = "a row" if n == 1 else f"{n} rows"
    return [f"All commands act {late} late: a program that logs them before it sends them does that. If so, declare "
            f"input_shift = {n} in [record], and nothing of this is missing in the machine."]
