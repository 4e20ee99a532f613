"""One heat path at two neighboring lumps: which of them, where training and validation records agree beyond doubt.

Beside a finer network a path from one lump looks much like one from the next, and the one that removes less may be the
right one. What a finer network changes is known to first order only: a difference in the sum of squares counts from the
same few percent on from which an effect may be accepted beside it, and with the filters of either place. Faces of
modules are left out: the legs have no inside in a finer network either, and a face takes over what they would do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..data import DataSet
from ..evidence import BIC_GAP, negative_log_predictive_density
from ..fit import Refit, coarsened, extended
from ._decide import Accepted
from ._neighbors import faces_of, neighboring
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
        if _beats(entry.fit, best.fit, data):
            best = entry
    left = [entry for entry in (own, *near.values()) if entry is not best]
    worse = tuple(entry for entry in left if _beats(best.fit, entry.fit, data))
    alike = [entry for entry in left if entry not in worse]
    others_left = [entry for entry in last.contenders if entry not in near]
    new = replace(last, best=best, contenders=(*alike, *others_left), ruled_out=(*last.ruled_out, *worse))
    return (*others, new), best.fit


def _decidable(entry: Entry, last: Accepted, fit: Refit) -> bool:
    """Whether an entry is the same path at a neighboring lump, no face of a module exchanged."""
    base = fit.structure.base
    exchanged = set(entry.candidate.where) ^ set(last.best.candidate.where)
    return neighboring(base, entry.candidate, last.best.candidate) and not faces_of(base) & exchanged


def _beats(one: Refit, other: Refit, data: Sequence[DataSet]) -> bool:
    """Whether a place leaves clearly less than another and predicts better, with the filters of either."""
    here, there = extended(one, other.structure, other.v), extended(other, one.structure, one.v)
    if one.rss >= (1.0 - FIRST_ORDER) * here.rss or there.rss >= (1.0 - FIRST_ORDER) * other.rss:
        return False
    return _predicts_better(one, here, one, data) and _predicts_better(there, other, other, data)


def _predicts_better(one: Refit, other: Refit, reference: Refit, data: Sequence[DataSet]) -> bool:
    own, rival = negative_log_predictive_density([one, other], reference, data)
    return rival > own + BIC_GAP
