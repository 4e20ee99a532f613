"""An offset of one thermometer or, the other way, of another one: beside an inexact model both are listed.

Of two thermometers the records show the difference. Which of them is off is read from heats that depend on absolute
temperatures and from ambients, in which the error of a model is the same in every block: that one of them does better
in block after block says less than it seems. Of 140 simulated cells whose inside a model of two lumps lacks, three got
the wrong one of their two thermometers alone, none with this rule (`tests/diagnosis/test_offsets_of_thermometers.py`).
"""

from __future__ import annotations

from ...errors import Diverged, InputError
from ..effects import Candidate, candidates
from ..fit import Refit
from ._decide import Accepted
from ._neighbors import ALIKE
from ._other_end import refitted_from
from ._short_list import Entry, Key, delta_bic

_OFFSET = "sensor_offset"


def other_thermometers(round_: Accepted, fit: Refit, less: Refit) -> list[Entry]:
    """Offsets of other thermometers that do nearly all that the accepted one does, each fitted from its opposite.

    Parameters
    ----------
    round_ : Accepted
        Accepted effect with its contenders.
    fit : Refit
        Fit with all accepted effects.
    less : Refit
        Fit with all but this one.
    """
    best = round_.best.candidate
    system = less.structure.base
    if best.effect.name != _OFFSET or best.where[0] not in system.thermometers:
        return []
    known: set[Key] = {one.key for one in fit.structure.effects}
    known |= {entry.candidate.key for entry in (*round_.contenders, *round_.ruled_out)}
    return [entry for one in less.testable(candidates(system, [_OFFSET]))
            if one.key not in known and one.where[0] in system.thermometers
            for entry in _alike(one, round_.best, fit, less)]


def _alike(candidate: Candidate, best: Entry, fit: Refit, less: Refit) -> list[Entry]:
    """The candidate refitted, if it does nearly as much; none if the model runs away beside these records."""
    size = candidate.effect.size.name
    place = [one.key for one in fit.structure.effects].index(best.candidate.key)
    value = -fit.structure.quantities(fit.v)[place][size]
    try:
        own = refitted_from(fit, candidate, less, {size: value})
    except (Diverged, InputError):
        return []
    if less.rss - own.rss <= ALIKE * (less.rss - fit.rss):
        return []
    return [Entry(candidate, own, delta_bic(less, own), best.p_value)]
