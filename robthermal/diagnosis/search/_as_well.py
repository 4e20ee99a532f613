"""Candidates that do nearly as much as an accepted effect in the network as it is, refitted beside a finer one."""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import Diverged, InputError
from ..effects import Candidate
from ..evidence import score_candidates
from ..fit import Refit, exact
from ._decide import Accepted
from ._other_end import refitted_from
from ._short_list import Entry, Key, delta_bic, refit_short_list

_SHARE = 0.95  # of what the effect does to the sum of squares in the network as it is


def as_well(best: Candidate, others: Sequence[Candidate], less: Refit) -> list[Entry]:
    """Those that do nearly as much as an effect in the network as it is, refitted beside what the others have."""
    plain = exact(less)
    least = enough(best, plain)
    found = [(one, entry) for one in others for entry in refitted(one, plain)[:1] if entry.fit.rss < least]
    return [entry for one, alone in found for entry in refitted(one, less) or from_alone(alone, less)]


def enough(best: Candidate, plain: Refit) -> float:
    """Sum of squares below which a rival does nearly as much as an effect; 0 where that cannot be fitted."""
    own = [entry.fit.rss for entry in refitted(best, plain)]
    return plain.rss - _SHARE * (plain.rss - min(own)) if own else 0.0


def from_alone(alone: Entry, less: Refit) -> list[Entry]:
    """An effect beside a finer network that has explained it away, from where it was found without one."""
    try:
        fit = refitted_from(less, alone.candidate, less, alone.found)
    except (Diverged, InputError):
        return []
    return [Entry(alone.candidate, fit, delta_bic(less, fit), alone.p_value)]


def listed_keys(round_: Accepted, fit: Refit) -> set[Key]:
    """Effects that are accepted, listed already, or excluded."""
    listed = {entry.candidate.key for entry in (*round_.contenders, *round_.ruled_out)}
    return listed | {one.key for one in fit.structure.effects}


def refitted(candidate: Candidate, less: Refit) -> Sequence[Entry]:
    """The candidate refitted; none if the model runs away beside these records."""
    try:
        return refit_short_list(less, score_candidates(less, [candidate])).entries
    except (Diverged, InputError):
        return ()
