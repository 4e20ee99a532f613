"""Effects that hold where the model is not exact: over blocks and segments, and needed; rivals of those that do not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from ..errors import Diverged, InputError
from ._judge import Validation, of_its_time
from .evidence import (
    NEEDED,
    PREDICTED,
    SURE,
    Evidence,
    Stability,
    deviations,
    expected_rms,
    left,
    reproducible,
    stability,
)
from .fit import Refit, coarsened, exact
from .search import Accepted, Entry, SearchState, without


def evidence_of(rounds: Sequence[Accepted], fit: Refit, nominal: Refit, validation: Validation | None = None
                ) -> tuple[Evidence, ...]:
    """Evidence for every effect of a fit.

    Parameters
    ----------
    rounds : sequence of Accepted
        In the order of the effects of the fit.
    fit, nominal : Refit
        With all of them; without any.
    validation : Validation, optional
        Data that no fit has seen: an effect may be needed there that the training records hide.
    """
    if not rounds:
        return ()
    whole, bare = exact(fit), exact(nominal)
    found = (Evidence(share=share, reproducible=_reproducible(rounds, fit, nominal, place),
                      stability=_stability(fit, place), needed=_needed(whole, bare, place, validation))
             for place, share in enumerate(_shares(whole, bare)))
    return tuple(one if one.lasting or one.needed < NEEDED else
                 replace(one, predicted=_predicted(fit, nominal, place, validation)) for place, one in enumerate(found))


def lasts(rounds: Sequence[Accepted], fit: Refit, nominal: Refit, place: int, validation: Validation | None = None
          ) -> bool:
    """Whether one effect of a fit holds over blocks and segments and is needed: the tests of `Evidence.lasting`.

    Parameters
    ----------
    rounds, fit, nominal, validation
        As in `evidence_of`.
    place : int
        Of the effect.
    """
    needed = _needed(exact(fit), exact(nominal), place, validation) >= NEEDED
    return needed and _holds(rounds, fit, nominal, place, validation)


def _weakest(rounds: Sequence[Accepted], fit: Refit, nominal: Refit, validation: Validation | None) -> int | None:
    """Place of the effect that is needed least of those that do not last; None if all do.

    One that is needed too little does not last, whatever it does over blocks: those tests are not made then.
    """
    needs = [_needed(exact(fit), exact(nominal), place, validation) for place in range(len(rounds))]
    if any(not need >= NEEDED for need in needs):
        return needs.index(min(needs))
    fleeting = [place for place in range(len(rounds)) if not _holds(rounds, fit, nominal, place, validation)]
    return min(fleeting, key=needs.__getitem__, default=None)


def _holds(rounds: Sequence[Accepted], fit: Refit, nominal: Refit, place: int, validation: Validation | None) -> bool:
    """Whether an effect keeps its size over segments and is better than none in block after block, or predicts.

    Training records that hardly excite an effect say little of its size part by part. Where that size takes nearly all
    of what is left without it off records that no fit has seen, they have confirmed it; not a size that may be zero.
    """
    if _stability(fit, place).constant and _reproducible(rounds, fit, nominal, place) >= SURE:
        return True
    return _predicted(fit, nominal, place, validation) >= PREDICTED


def _is_beyond_zero(fit: Refit, place: int) -> bool:
    """Whether the size of an effect is beyond its standard deviation, which includes the remainder."""
    at, size = fit.structure.column_of(place), fit.structure.effects[place].effect.size
    std = float(deviations(fit, exact(fit), [at])[0])
    return std < (1.0 if size.lower > 0 else abs(fit.v[at]))


def _predicted(fit: Refit, nominal: Refit, place: int, validation: Validation | None) -> float:
    """Part of the excess mean square of validation records left without an effect that it removes.

    0 for a swing or a step at a time of the training records: on another day it fits by accident. And for a size that
    may be zero: what helps is then a number of the network that is elsewhere beside it.
    """
    if validation is None or validation.data is None or of_its_time(fit.structure.effects[place]) or (
            not _is_beyond_zero(fit, place)):
        return 0.0  # before the effects are fitted without it: that costs
    whole = exact(fit)
    plain = _plain(whole, exact(nominal), place)
    return 0.0 if plain is None else _needed_held_out(whole, plain, validation)


def _plain(whole: Refit, bare: Refit, place: int) -> Refit | None:
    """The network as it is without one of its effects; None if nothing survives that."""
    return bare if len(whole.structure.effects) == 1 else without(whole, place, bare)


def _reproducible(rounds: Sequence[Accepted], fit: Refit, nominal: Refit, place: int) -> float:
    """Share of draws of blocks in which the fit is better with an effect than without it."""
    less = without(fit, place, nominal, rounds[place].before)
    return 0.0 if less is None else reproducible(fit, less)


def _needed(whole: Refit, bare: Refit, place: int, validation: Validation | None) -> float:
    """Part of the excess mean square left without an effect that it removes, of training or validation records.

    A swing or a step at a time of the training records may fit there what others leave: beside these it is needed only
    if it is on validation records, where there are any, by the part of their rms that a whole set has to remove.
    """
    plain = _plain(whole, bare, place)
    trained = plain is not bare and of_its_time(whole.structure.effects[place])
    if trained and plain is not None and validation is not None and validation.data is not None:
        return 1.0 - math.sqrt(max(1.0 - _needed_held_out(whole, plain, validation), 0.0))
    before, after = _excess(whole if plain is None else plain, whole), _excess(whole, whole)
    needed = 1.0 - after / before if before > 0 else 0.0
    if needed < NEEDED and plain is not None and validation is not None:
        needed = max(needed, _needed_held_out(whole, plain, validation))
    return needed


def _shares(whole: Refit, bare: Refit) -> list[float]:
    """Parts of the excess mean square that the effects remove, in the order of their acceptance."""
    excess = [_excess(one, whole) for one in (bare, *_prefixes(whole, bare))]
    return [(excess[i] - excess[i + 1]) / excess[0] if excess[0] > 0 else 0.0 for i in range(len(excess) - 1)]


def _excess(fit: Refit, whole: Refit) -> float:
    """Mean square that a fit leaves beyond noise."""
    return max(fit.rms**2 - expected_rms(whole) ** 2, 0.0)


def _needed_held_out(whole: Refit, less: Refit, validation: Validation) -> float:
    """Part of the excess mean square of the validation data left without an effect that it removes; 0 without data."""
    try:
        held = validation.predicted(less, whole)
    except (Diverged, InputError):
        return 0.0
    return 0.0 if held is None else left(held.gap).share_explained


def _stability(fit: Refit, place: int) -> Stability:
    """Of the size of an effect, relative to it."""
    structure = fit.structure
    at = structure.column_of(place)
    found, size = stability(fit, at), structure.effects[place].effect.size
    scale = 1.0 if size.lower > 0 else abs(fit.v[at])  # a logarithm's spread is relative
    return Stability(found.segments, found.spread / scale if scale > 0 else float("inf"))


def _prefixes(whole: Refit, bare: Refit) -> list[Refit]:
    """Fits with the first effect, the first two, and so on."""
    out = [whole]
    for place in range(len(whole.structure.effects) - 1, 0, -1):
        out.append(without(out[-1], place, bare) or out[-1])
    return out[::-1]


def lasting(state: SearchState, finer: Refit, validation: Validation) -> SearchState:
    """The effects that hold over blocks and segments and are needed, the least needed one dropped first.

    What the records cannot tell from it is asked first: a rival that holds and is needed takes its place.
    """
    rounds, fit = state.rounds, state.fit
    while rounds and (worst := _weakest(rounds, fit, finer, validation)) is not None:
        instead = in_its_place(rounds, worst, finer, validation)
        if instead is not None:
            rounds, fit = instead
            continue
        less = finer if len(rounds) == 1 else without(fit, worst, finer, rounds[worst].before, from_both=True)
        if less is None:
            return replace(state, nominal=finer, rounds=(), fit=finer)
        rounds, fit = rounds[:worst] + rounds[worst + 1:], less
        if rounds and fit.structure.coarse:
            fit = coarsened(fit)
        if rounds:
            rounds = (*rounds[:-1], replace(rounds[-1], best=replace(rounds[-1].best, fit=fit)))
    return replace(state, nominal=finer, rounds=rounds, fit=fit)


def in_its_place(rounds: tuple[Accepted, ...], place: int, finer: Refit, validation: Validation | None = None
                 ) -> tuple[tuple[Accepted, ...], Refit] | None:
    """The effects with a rival in the place of one that does not last; None if none of its rivals lasts.

    Beside unknowns of a finer network an effect may have the smallest sum of squares and remove nothing where the
    network is as it is: it could not be named itself, and so it is no rival of one that could.

    Parameters
    ----------
    rounds : tuple of Accepted
        In the order of the effects of the fit.
    place : int
        Of the effect that does not last.
    finer : Refit
        Without any effect.
    validation : Validation, optional
        Data that no fit has seen.
    """
    beside = [round_.best.candidate.key for i, round_ in enumerate(rounds) if i != place]
    tried = (_instead(rounds, place, entry) for entry in rounds[place].contenders
             if _others(entry) == beside and _is_needed(entry, finer, validation))
    kept = [(new, at) for new, at in tried if lasts(new, new[at].best.fit, finer, at, validation)]
    if not kept:
        return None
    (chosen, at), *others = kept
    own = replace(chosen[at], contenders=tuple(new[i].best for new, i in others))
    return (*chosen[:at], own, *chosen[at + 1:]), own.best.fit


def _others(entry: Entry) -> list[tuple[str, tuple[str, ...]]]:
    """Keys of the effects beside which a rival was fitted."""
    return [one.key for one in entry.fit.structure.effects if one.key != entry.candidate.key]


def _is_needed(entry: Entry, finer: Refit, validation: Validation | None) -> bool:
    """Whether a rival is needed with the network as it is: asked before all else, as it costs least and most fail."""
    return _needed(exact(entry.fit), exact(finer), _place(entry), validation) >= NEEDED


def _place(entry: Entry) -> int:
    """Of the effect among those of its fit."""
    return [one.key for one in entry.fit.structure.effects].index(entry.candidate.key)


def _instead(rounds: tuple[Accepted, ...], place: int, rival: Entry) -> tuple[tuple[Accepted, ...], int]:
    """The effects with a rival in one place, which was fitted beside the others, and where it stands."""
    fit = coarsened(rival.fit) if rival.fit.structure.coarse else rival.fit
    at, out = _place(rival), [*rounds[:place], *rounds[place + 1:]]
    out.insert(at, replace(rounds[place], best=replace(rival, fit=fit), contenders=()))
    out[-1] = replace(out[-1], best=replace(out[-1].best, fit=fit))
    return tuple(out), at
