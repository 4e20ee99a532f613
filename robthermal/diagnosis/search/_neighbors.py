"""A heat path that attaches to the neighboring lump: where a lump ends is the model's choice; both are one answer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ...errors import Diverged, InputError
from ...thermal import System
from ..effects import Candidate, candidates
from ..evidence import score_candidates
from ..fit import Refit, exact
from ._decide import Accepted
from ._short_list import Entry, Key, refit_short_list

PATHS = ("missing_link", "missing_ambient_link")  # to a lump, and to what that lump is cooled by
MASSES = ("hidden_mass", "path_mass")  # on a lump, and within a path that begins there
_OFF = 1.05  # times an end of a range: nearer is at that end
ALIKE = 0.9  # of the decrease of the sum of squares: a rival that reaches it is as good where the model is not exact
_MOST = 0.75  # of that decrease: where another day is predicted better, the training records need not decide


def with_neighbors(round_: Accepted, names: Sequence[str] | None = None,
                   predicts_better: Callable[[Entry], bool] = lambda entry: False) -> Accepted:
    """List beside a heat path those to neighboring lumps, refitted, that do nearly all that it does.

    Or most of it, where records that no fit has seen are predicted better with them.

    Of a path to a lump that an ambient cools the other place is that ambient, and the reverse; of a mass on a lump the
    path from there to an ambient.

    A path from the middle of a lump looks in a coarse network as if it came from between that lump and the next; the
    sum of squares decides for one of them beyond every statistical doubt, and can be wrong. A face of a module and the
    lump beside it are compared in the network as it is.

    Parameters
    ----------
    round_ : Accepted
        Effect accepted beside a network that may be too coarse.
    names : sequence of str, optional
        Effects that may be named; default the whole catalog.
    predicts_better : callable
        Whether records that no fit has seen are predicted better with a rival; asked last.
    """
    best, before = round_.best, round_.before
    near = _near(round_, names)
    if not near:
        return round_
    own = next((one for one in candidates(before.structure.base, [best.candidate.effect.name])
                if one.key == best.candidate.key), best.candidate)
    try:
        refitted = _refitted(before, own, near)
    except (Diverged, InputError):  # the model beside these records runs away: nothing to compare
        return round_
    alike = _nearly_best(before, refitted, own, predicts_better)
    listed = {entry.candidate.key for entry in alike}  # ΔBIC and densities say less of places than they do of effects
    return replace(round_, contenders=(*round_.contenders, *alike),
                   ruled_out=tuple(entry for entry in round_.ruled_out if entry.candidate.key not in listed))


def _near(round_: Accepted, names: Sequence[str] | None) -> list[Candidate]:
    """Other places of the path, without those that are listed."""
    best, before = round_.best.candidate, round_.before
    if len(best.where) != 2 and best.effect.name not in MASSES:  # a drift of an ambient is not in the catalog, either
        return []
    known, system = {entry.candidate.key for entry in round_.contenders}, before.structure.base
    asked = {best.effect.name}
    for kind in (set(PATHS), set(MASSES)):
        if asked <= kind and (names is None or kind <= set(names)):
            asked = kind
    return [one for one in before.testable(candidates(system, sorted(asked))) if one.key not in known
            and (neighboring(system, one, best) or beside_an_ambient(system, one, best))]


def neighboring(system: System, one: Candidate, other: Candidate) -> bool:
    """Whether a heat path is another one with its lumps, one or both, exchanged for neighbors of theirs.

    Or a mass hangs on a lump, and another one lies within a path that leads from there to an ambient.

    Parameters
    ----------
    system : System
        Network with the links that make neighbors.
    one, other : Candidate
        Candidates of the same effect, or of the two for masses.
    """
    if {one.effect.name, other.effect.name} <= set(MASSES):
        return one.key != other.key and "path_mass" in (one.effect.name, other.effect.name) and (
            _bearer(system, one) == _bearer(system, other))
    nodes = {*system.lumps, *system.ambients}
    if one.effect.name != other.effect.name or set(one.where) == set(other.where) or not all(
            len(at.where) == 2 and nodes >= set(at.where) for at in (one, other)):
        return False
    joined = {frozenset(link.between) for link in system.links if set(link.between) <= set(system.lumps)}
    (a, b), (c, d) = one.where, other.where
    return any(all(p == q or frozenset((p, q)) in joined for p, q in ends)
               for ends in (((a, c), (b, d)), ((a, d), (b, c))))


def _bearer(system: System, mass: Candidate) -> set[str]:
    """The lump on which a mass hangs, or at which its path begins."""
    if mass.effect.name != "path_mass":
        return set(mass.where)
    return {end for link in system.links if link.name == mass.where[0] for end in link.between if end in system.lumps}


def beside_an_ambient(system: System, one: Candidate, other: Candidate) -> bool:
    """Whether one of two heat paths goes to an ambient, the other from the same lump to one that this ambient cools.

    Parameters
    ----------
    system : System
        Network with the links to its ambients.
    one, other : Candidate
        Two candidates, of whatever effects.
    """
    ends = {candidate.effect.name: set(candidate.where) for candidate in (one, other)}
    if set(ends) != set(PATHS):
        return False
    lumps, outside = (ends[name] for name in PATHS)
    cooled = lumps ^ outside
    return len(cooled) == 2 and any(set(link.between) == cooled for link in system.links)


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


def _nearly_best(before: Refit, entries: Sequence[Entry], own: Candidate, predicts_better: Callable[[Entry], bool]
                 ) -> list[Entry]:
    """Others that reach nearly all of the decrease that the best of them reaches, or most of it and predict better."""
    shares = _shares(before, entries, own)

    def alike(entry: Entry) -> bool:
        share = shares[entry.candidate.key]
        return share > ALIKE or (share > _MOST and predicts_better(entry))

    return [entry for entry in entries if entry.candidate.key != own.key and not _at_an_end(entry) and alike(entry)]


def _shares(before: Refit, entries: Sequence[Entry], own: Candidate) -> dict[Key, float]:
    """Part of the decrease of the best place that every place reaches.

    Where a face of a module is exchanged, in the network as it is: beside a finer one a face takes over what the legs,
    which have no inside there, would do. So a face itself has to reach it in both.
    """
    faces = faces_of(before.structure.base)
    at_faces = [entry.candidate for entry in entries if faces & (set(entry.candidate.where) ^ set(own.where))]
    plain = exact(before)
    as_it_is = _decreases(plain, _refitted(plain, own, at_faces)) if at_faces and before.structure.coarse else {}
    beside = _decreases(before, entries)
    exchanged = {one.key for one in at_faces} if as_it_is else set()

    def share(candidate: Candidate) -> float:
        asked = [as_it_is] if candidate.key in exchanged else []
        if not asked or faces & (set(candidate.where) - set(own.where)):  # a face must do as much in both
            asked = [*asked, beside]
        return min(of.get(candidate.key, 0.0) / max([*of.values(), 1e-300]) for of in asked)

    return {entry.candidate.key: share(entry.candidate) for entry in entries}


def _at_an_end(entry: Entry) -> bool:
    """Whether a mass within a path would lie at an end of it: there it hangs on the lump, or is not seen."""
    ends = {quantity.name: (quantity.lower, quantity.upper) for quantity in entry.candidate.effect.quantities}
    low, high = ends.get("ratio", (0.0, np.inf))
    return entry.candidate.effect.name == "path_mass" and not low * _OFF < entry.found["ratio"] < high / _OFF


def _decreases(before: Refit, entries: Sequence[Entry]) -> dict[Key, float]:
    """By how much every place lessens the sum of squares."""
    return {entry.candidate.key: before.rss - entry.fit.rss for entry in entries}
