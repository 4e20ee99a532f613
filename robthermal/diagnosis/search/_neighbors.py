"""A heat path that attaches to the neighboring lump: where a lump ends is the model's choice; both are one answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...errors import Diverged, InputError
from ...thermal import System
from ..effects import Candidate, candidates
from ..evidence import NEEDED, score_candidates
from ..fit import Refit
from ._decide import Accepted
from ._short_list import Entry, refit_short_list

ALIKE = 0.9  # of the decrease of the sum of squares: a rival that reaches it is as good where the model is not exact


def with_neighbors(round_: Accepted) -> Accepted:
    """List beside a heat path those to neighboring lumps, refitted, that do nearly all that it does.

    A path from the middle of a lump looks in a coarse network as if it came from between that lump and the next; the
    sum of squares decides for one of them beyond every statistical doubt, and can be wrong. Legs of modules have no
    inside even in a finer network, and a face takes over what they would do: of a path at a face, the lump beside it is
    listed where it would be needed itself.

    Parameters
    ----------
    round_ : Accepted
        Effect accepted beside a network that may be too coarse.
    """
    best, before = round_.best, round_.before
    if len(best.candidate.where) != 2:  # no path: a drift of an ambient is not in the catalog, either
        return round_
    known = {entry.candidate.key for entry in round_.contenders}
    near = [one for one in before.testable(candidates(before.structure.base, [best.candidate.effect.name]))
            if one.key not in known and neighboring(before.structure.base, one, best.candidate)]
    if not near:
        return round_
    own = next((one for one in candidates(before.structure.base, [best.candidate.effect.name])
                if one.key == best.candidate.key), best.candidate)
    try:
        refitted = _refitted(before, own, near)
    except (Diverged, InputError):  # the model beside these records runs away: nothing to compare
        return round_
    alike = _nearly_best(before, refitted, best.candidate)
    listed = {entry.candidate.key for entry in alike}  # ΔBIC and densities say less of places than they do of effects
    return replace(round_, contenders=(*round_.contenders, *alike),
                   ruled_out=tuple(entry for entry in round_.ruled_out if entry.candidate.key not in listed))


def neighboring(system: System, one: Candidate, other: Candidate) -> bool:
    """Whether a heat path is another one with its lumps, one or both, exchanged for neighbors of theirs.

    Parameters
    ----------
    system : System
        Network with the links that make neighbors.
    one, other : Candidate
        Candidates of the same effect.
    """
    nodes = {*system.lumps, *system.ambients}
    if one.effect.name != other.effect.name or set(one.where) == set(other.where) or not all(
            len(at.where) == 2 and nodes >= set(at.where) for at in (one, other)):
        return False
    joined = {frozenset(link.between) for link in system.links if set(link.between) <= set(system.lumps)}
    (a, b), (c, d) = one.where, other.where
    return any(all(p == q or frozenset((p, q)) in joined for p, q in ends)
               for ends in (((a, c), (b, d)), ((a, d), (b, c))))


def one_place(round_: Accepted, system: System) -> bool:
    """Whether all that the records cannot tell from an effect is the same heat path at neighboring lumps: one answer.

    Parameters
    ----------
    round_ : Accepted
        Accepted effect with its contenders and aliases.
    system : System
        Network with the links that make neighbors.
    """
    best = round_.best.candidate
    others = [*round_.best.aliases, *(one for entry in round_.contenders for one in (entry.candidate, *entry.aliases))]
    return all(one.key == best.key or neighboring(system, one, best) for one in others)


def faces_of(system: System) -> set[str]:
    """Lumps that are faces of modules.

    Parameters
    ----------
    system : System
        Network with its modules.
    """
    return {face for module in system.modules.values() for face in (module.hot, module.cold)}


def _refitted(before: Refit, best: Candidate, near: Sequence[Candidate]) -> list[Entry]:
    """The path and the same at neighboring lumps, each refitted to its optimum."""
    entries = [*refit_short_list(before, score_candidates(before, [best, *near])).entries]
    kept = {entry.candidate.key for entry in entries}
    for one in near:  # the short list ends the fits of those that cannot become the best, and may be nearly as good
        if one.key not in kept:
            entries += refit_short_list(before, score_candidates(before, [one])).entries
    return entries


def _beside_a_face(system: System, one: Candidate, best: Candidate) -> bool:
    """Whether a path has another lump where the best one has the face of a module."""
    return bool(faces_of(system) & (set(best.where) - set(one.where)))


def _nearly_best(before: Refit, entries: Sequence[Entry], best: Candidate) -> list[Entry]:
    """Others that reach most of the decrease that the best of them reaches; beside a face, what would be needed."""
    most = before.rss - min((entry.fit.rss for entry in entries), default=before.rss)

    def least(entry: Entry) -> float:
        return NEEDED if _beside_a_face(before.structure.base, entry.candidate, best) else ALIKE

    return [entry for entry in entries if entry.candidate.key != best.key
            and before.rss - entry.fit.rss > least(entry) * most]
