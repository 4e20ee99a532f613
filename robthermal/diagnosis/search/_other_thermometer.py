"""What an inexact model cannot distinguish: an offset of either of two thermometers, and heats at one of them.

Of two thermometers the records show the difference. Which of them is off is read from heats that depend on absolute
temperatures and from ambients, in which the error of a model is the same in every block: that one of them does better
in block after block says less than it seems. Of 140 simulated cells whose inside a model of two lumps lacks, three got
the wrong one of their two thermometers alone, none with this rule (`tests/diagnosis/test_offsets_of_thermometers.py`).

A heat that the model lacks at a lump that little else touches warms its thermometer alone, and so does an offset. So
a constant heat and shares of heaters at that lump are asked as well, and a gain of the thermometer: in the network as
it is, because what a finer one would change takes over most of a heat, and nothing of an offset. A simulated motor
whose magnet is heated with its speed, with no effect tried that says so, had an offset of the magnet's thermometer;
beside a finer network heats did 0.74 of what it did, in the network as it is 0.98 to 1.01
(`tests/diagnosis/test_motor.py`). Of 12 offsets that are there (bars, plates, stacks, housings of foreign truth) the
others did up to 0.78, and once 0.91.
"""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import Diverged, InputError
from ...thermal import System
from ..effects import Candidate, candidates
from ..fit import Refit
from ._as_well import as_well, listed_keys
from ._decide import Accepted
from ._neighbors import ALIKE
from ._other_end import refitted_from
from ._short_list import Entry, delta_bic

_OFFSET = "sensor_offset"
_INSTEAD = ("heat_source", "input_feedthrough", "sensor_gain")  # the last part of their place is where they act


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
    system = less.structure.base
    if not _off(round_, system):
        return []
    known = listed_keys(round_, fit)
    return [entry for one in less.testable(candidates(system, [_OFFSET]))
            if one.key not in known and one.where[0] in system.thermometers
            for entry in _alike(one, round_.best, fit, less)]


def heats_instead(round_: Accepted, fit: Refit, less: Refit, names: Sequence[str] | None) -> list[Entry]:
    """Heats into the lump of a thermometer, or its gain, that do nearly all that its offset does, each refitted.

    Parameters
    ----------
    round_ : Accepted
        Accepted effect with its contenders.
    fit : Refit
        Fit with all accepted effects.
    less : Refit
        Fit with all but this one.
    names : sequence of str or None
        Effects that may be named; None for the whole catalog.
    """
    system = less.structure.base
    asked = [name for name in _INSTEAD if names is None or name in names]
    if not _off(round_, system) or not asked:
        return []
    known, sensor = listed_keys(round_, fit), round_.best.candidate.where[0]
    at = (sensor, system.sensors[sensor].lump)
    others = [one for one in less.testable(candidates(system, asked)) if one.where[-1] in at and one.key not in known]
    return as_well(round_.best.candidate, others, less)


def _off(round_: Accepted, system: System) -> bool:
    """Whether the effect is an offset of a thermometer."""
    best = round_.best.candidate
    return best.effect.name == _OFFSET and best.where[0] in system.thermometers


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
