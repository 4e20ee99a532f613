"""One heat path at two neighboring lumps: which of them, where training and validation records agree beyond doubt.

Beside a finer network a path from one lump looks much like one from the next, and the one that removes less may be the
right one. What a finer network changes is known to first order only: a difference in the sum of squares counts from the
same few percent on from which an effect may be accepted beside it, and with the filters of either place. Faces of
modules are left out: the legs have no inside in a finer network either, and a face takes over what they would do.

Of the lags of a lump's heater and of its thermometer only that of the heater can be dropped. The insides of all bodies
on the way delay what the thermometers of other lumps see, as a late heater does; nothing makes these faster.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..data import DataSet
from ..evidence import BIC_GAP, negative_log_predictive_density
from ..fit import Refit, coarsened, extended
from ._decide import Accepted
from ._neighbors import faces_of, neighboring
from ._other_end import ends_of_a_lump
from ._resolve_alternatives import takes_the_place
from ._short_list import Entry

FIRST_ORDER = 0.04  # of the sum of squares: to first order a finer network is described no better than that


def resolve_places(rounds: tuple[Accepted, ...], fit: Refit, data: Sequence[DataSet]
                   ) -> tuple[tuple[Accepted, ...], Refit]:
    """Drop places that explain clearly less, of training and of validation records; the best one comes first.

    Only the effect accepted last is asked: its rivals were fitted beside all the others.

    Parameters
    ----------
    rounds : tuple of Accepted
        In the order of the effects of the fit, with neighboring places among the contenders.
    fit : Refit
        Fit with these effects beside a network that may be too coarse.
    data : sequence of DataSet
        Validation data, which no fit has seen.
    """
    *others, last = rounds
    near = {entry: replace(entry, fit=coarsened(entry.fit)) for entry in last.contenders
            if takes_the_place(entry, last, fit) and _decidable(entry, last, fit)}
    best = own = replace(last.best, fit=fit)
    for entry in near.values():
        if _excludes(entry, best, data):
            best = entry
    left = [entry for entry in (own, *near.values()) if entry is not best]
    worse = tuple(entry for entry in left if _excludes(best, entry, data))
    alike = [entry for entry in left if entry not in worse]
    others_left = [entry for entry in last.contenders if entry not in near]
    new = replace(last, best=best, contenders=(*alike, *others_left), ruled_out=(*last.ruled_out, *worse))
    return (*others, new), best.fit


def _decidable(entry: Entry, last: Accepted, fit: Refit) -> bool:
    """Whether an entry is the lag of a lump's other end, or the path at a neighboring lump, no face exchanged."""
    base, one, other = fit.structure.base, entry.candidate, last.best.candidate
    if ends_of_a_lump(base, one, other):
        return True
    return neighboring(base, one, other) and not faces_of(base) & (set(one.where) ^ set(other.where))


def _excludes(one: Entry, other: Entry, data: Sequence[DataSet]) -> bool:
    """Whether records that prefer one of two say that it is not the other; of a late heater they do not."""
    return one.candidate.effect.name != "input_lag" and _beats(one.fit, other.fit, data)


def _beats(one: Refit, other: Refit, data: Sequence[DataSet]) -> bool:
    """Whether a place leaves clearly less than another and predicts better, with the filters of either."""
    here, there = extended(one, other.structure, other.v), extended(other, one.structure, one.v)
    if one.rss >= (1.0 - FIRST_ORDER) * here.rss or there.rss >= (1.0 - FIRST_ORDER) * other.rss:
        return False
    return _predicts_better(one, here, one, data) and _predicts_better(there, other, other, data)


def _predicts_better(one: Refit, other: Refit, reference: Refit, data: Sequence[DataSet]) -> bool:
    own, rival = negative_log_predictive_density([one, other], reference, data)
    return rival > own + BIC_GAP
