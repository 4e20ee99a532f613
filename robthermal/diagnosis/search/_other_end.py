"""A lag of a heater or of the thermometer of its lump: where the model is not exact, both are listed.

Every other sensor sees a lag of the heater and none of the thermometer. That difference is of the size of what the
lump's inside does to it, and the refit of the other lag, which starts where there is none, may end far from its best.
Validation records may then exclude the heater: `_places`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import replace

from ...errors import Diverged, InputError
from ...thermal import System
from ..effects import Candidate, candidates
from ..fit import Refit, extended
from ._decide import Accepted
from ._short_list import Entry, Key, delta_bic

_LAGS = ("input_lag", "sensor_lag")
_TIME = "time_constant"
_ALIKE = 0.98  # of the sum of squares that the accepted lag removes: the inside of a lump is worth less than the rest


def with_other_end(round_: Accepted, named: Set[Key], names: Sequence[str] | None) -> Accepted:
    """List beside a lag that of the other end of its lump, refitted from the same time, if it does nearly as much.

    Parameters
    ----------
    round_ : Accepted
        Effect accepted beside a network that may be too coarse.
    named : set of tuple
        Keys of all effects that are accepted: none of them is a rival.
    names : sequence of str or None
        Effects that may be named; None for the whole catalog.
    """
    best, before = round_.best, round_.before
    if best.candidate.effect.name not in _LAGS:
        return round_
    asked = [lag for lag in _LAGS if names is None or lag in names]
    known = named | {entry.candidate.key for entry in round_.contenders}
    others = [one for one in before.testable(candidates(before.structure.base, asked))
              if one.key not in known and ends_of_a_lump(before.structure.base, one, best.candidate)]
    try:
        at = {_TIME: best.found[_TIME]}
        own = refitted_from(best.fit, best.candidate, before, at) if others else before
        fits = [(one, refitted_from(best.fit, one, before, at)) for one in others]
    except (Diverged, InputError):  # the model beside these records runs away: nothing to compare
        return round_
    listed = tuple(Entry(one, fit, delta_bic(before, fit), best.p_value) for one, fit in fits
                   if before.rss - fit.rss > _ALIKE * (before.rss - own.rss))
    return replace(round_, contenders=(*round_.contenders, *listed))


def refitted_from(fit: Refit, candidate: Candidate, before: Refit, values: Mapping[str, float]) -> Refit:
    """A fit with a candidate added, which starts from the parameters of another fit.

    Parameters
    ----------
    fit : Refit
        Fit whose parameters are the start.
    candidate : Candidate
        Effect that is added.
    before : Refit
        Fit without it.
    values : mapping
        Quantities of the candidate to start from.
    """
    known = {one.unknowns: value for own in (before, fit)  # the later fit need not have all effects of the earlier one
             for one, value in zip(own.structure.effects, own.structure.quantities(own.v), strict=True)}
    structure = before.structure.with_effect(candidate)
    at = [*(known[one.unknowns] for one in before.structure.effects), {**candidate.shape, **values}]
    return extended(before, structure, structure.carried(fit.structure, fit.v, at))


def ends_of_a_lump(system: System, one: Candidate, other: Candidate) -> bool:
    """Whether one of two lags is of a heater, the other of a thermometer, of the same lump.

    Parameters
    ----------
    system : System
        Network with its heaters and sensors.
    one, other : Candidate
        Two candidates, of whatever effects.
    """
    ends = {candidate.effect.name: candidate.where[0] for candidate in (one, other)}
    heater, sensor = system.inputs.get(ends.get("input_lag", "")), system.sensors.get(ends.get("sensor_lag", ""))
    return heater is not None and sensor is not None and heater.lump == sensor.lump
