"""What an inexact model cannot distinguish: an offset of either of two thermometers, two laws of a loss.

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

Natural convection and radiation of one path differ little over tens of kelvins. Beside a finer network that leaves no
misfit the right one is found; where it leaves one, the other stands beside it. A simulated mirror in vacuum, whose
network has four lumps, had natural convection as a name of its own. So it is with a conductance that grows with its
temperature: beside it stands radiation between the same two nodes, and the reverse.
"""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import Diverged, InputError
from ...thermal import System
from ..effects import Candidate, candidates
from ..evidence import score_candidates
from ..fit import Refit, exact
from ._decide import Accepted
from ._neighbors import ALIKE
from ._other_end import refitted_from
from ._short_list import Entry, Key, delta_bic, refit_short_list

_OFFSET = "sensor_offset"
_INSTEAD = ("heat_source", "input_feedthrough", "sensor_gain")  # the last part of their place is where they act
_LAWS = ("natural_convection", "radiation", "conductance_exponent")  # of the heat between two nodes
_MISFIT = 2.0  # whitened variance, as that which a finer network leaves, to explain nothing away
_AS_WELL = 0.95  # of what the effect does to the sum of squares in the network as it is


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
    known = _known(round_, fit)
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
    known, sensor = _known(round_, fit), round_.best.candidate.where[0]
    at = (sensor, system.sensors[sensor].lump)
    others = [one for one in less.testable(candidates(system, asked)) if one.where[-1] in at and one.key not in known]
    return _as_well(round_.best.candidate, others, less)


def other_laws(round_: Accepted, fit: Refit, less: Refit, names: Sequence[str] | None) -> list[Entry]:
    """Other laws of the heat between the same two nodes, if they do nearly as much, refitted.

    Where the fit leaves no misfit even a small difference between the two is seen, and none is asked.

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
    best, system = round_.best.candidate, less.structure.base
    if best.effect.name not in _LAWS:
        return []
    seen = _LAWS[:2] if fit.variance < _MISFIT else ()
    others = [law for law in _LAWS if law != best.effect.name and (names is None or law in names)
              and not {law, best.effect.name} <= {*seen}]
    if not others:
        return []
    known, nodes = _known(round_, fit), _nodes(best, system)
    return _as_well(best, [one for one in less.testable(candidates(system, others))
                           if _nodes(one, system) == nodes and one.key not in known], less)


def _nodes(candidate: Candidate, system: System) -> frozenset[str]:
    """The two nodes between which an effect acts, by themselves or by their link."""
    joined = (link.between for link in system.links if candidate.where == (link.name,))
    return frozenset(next(joined, candidate.where))


def _as_well(best: Candidate, others: Sequence[Candidate], less: Refit) -> list[Entry]:
    """Those that do nearly as much as an effect in the network as it is, refitted beside what the others have."""
    plain = exact(less)
    own = [entry.fit.rss for entry in _refitted(best, plain)]
    if not own:  # nothing to compare with
        return []
    least = plain.rss - _AS_WELL * (plain.rss - min(own))
    found = [(one, entry) for one in others for entry in _refitted(one, plain)[:1] if entry.fit.rss < least]
    return [entry for one, alone in found for entry in _refitted(one, less) or _from(alone, less)]


def _from(alone: Entry, less: Refit) -> list[Entry]:
    """An effect beside a finer network that has explained it away, from where it was found without one."""
    try:
        fit = refitted_from(less, alone.candidate, less, alone.found)
    except (Diverged, InputError):
        return []
    return [Entry(alone.candidate, fit, delta_bic(less, fit), alone.p_value)]


def _off(round_: Accepted, system: System) -> bool:
    """Whether the effect is an offset of a thermometer."""
    best = round_.best.candidate
    return best.effect.name == _OFFSET and best.where[0] in system.thermometers


def _known(round_: Accepted, fit: Refit) -> set[Key]:
    """Effects that are accepted, listed already, or excluded."""
    listed = {entry.candidate.key for entry in (*round_.contenders, *round_.ruled_out)}
    return listed | {one.key for one in fit.structure.effects}


def _refitted(candidate: Candidate, less: Refit) -> Sequence[Entry]:
    """The candidate refitted; none if the model runs away beside these records."""
    try:
        return refit_short_list(less, score_candidates(less, [candidate])).entries
    except (Diverged, InputError):
        return ()


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
