"""Effects that hold where the model is not exact: over blocks and segments, and needed; rivals of those that do not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..errors import Diverged, InputError
from ._judge import Validation
from .evidence import NEEDED, Evidence, Stability, expected_rms, left, reproducible, stability
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
    noise = expected_rms(whole) ** 2
    excess = [max(bare.rms**2 - noise, 0.0)]
    excess += [max(one.rms**2 - noise, 0.0) for one in _prefixes(whole, bare)]
    out = []
    for place, round_ in enumerate(rounds):
        less = without(fit, place, nominal, round_.before)
        plain = bare if len(rounds) == 1 else without(whole, place, bare)
        before = max((whole if plain is None else plain).rms ** 2 - noise, 0.0)
        needed = 1.0 - excess[-1] / before if before > 0 else 0.0
        if needed < NEEDED and plain is not None and validation is not None:
            needed = max(needed, _needed_held_out(whole, plain, validation))
        out.append(Evidence(
            share=(excess[place] - excess[place + 1]) / excess[0] if excess[0] > 0 else 0.0,
            reproducible=0.0 if less is None else reproducible(fit, less),
            stability=_stability(fit, place), needed=needed))
    return tuple(out)


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


def lasting(state: SearchState, finer: Refit, validation: Validation) -> tuple[SearchState, tuple[Evidence, ...]]:
    """The effects that hold over blocks and segments and are needed, the least needed one dropped first.

    What the records cannot tell from it is asked first: a rival that holds and is needed takes its place.
    """
    rounds, fit = state.rounds, state.fit
    found = evidence_of(rounds, fit, finer, validation)
    while not all(one.lasting for one in found):
        worst = min(range(len(found)), key=lambda i: (found[i].lasting, found[i].needed))
        instead = in_its_place(rounds, worst, finer, validation)
        if instead is not None:
            rounds, fit = instead
            found = evidence_of(rounds, fit, finer, validation)
            continue
        less = finer if len(rounds) == 1 else without(fit, worst, finer, rounds[worst].before)
        if less is None:
            return replace(state, rounds=(), fit=finer), ()
        rounds, fit = rounds[:worst] + rounds[worst + 1:], less
        if rounds and fit.structure.coarse:
            fit = coarsened(fit)
        if rounds:
            rounds = (*rounds[:-1], replace(rounds[-1], best=replace(rounds[-1].best, fit=fit)))
        found = evidence_of(rounds, fit, finer, validation)
    return replace(state, nominal=finer, rounds=rounds, fit=fit), found


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
    tried = filter(None, (_instead(rounds, place, entry) for entry in rounds[place].contenders))
    lasting = [(new, at) for new, at in tried if evidence_of(new, new[at].best.fit, finer, validation)[at].lasting]
    if not lasting:
        return None
    (chosen, at), *others = lasting
    own = replace(chosen[at], contenders=tuple(new[i].best for new, i in others))
    return (*chosen[:at], own, *chosen[at + 1:]), own.best.fit


def _instead(rounds: tuple[Accepted, ...], place: int, rival: Entry) -> tuple[tuple[Accepted, ...], int] | None:
    """The effects with a rival in one place, and where it stands; None if it was not fitted beside the others."""
    others = [round_.best.candidate.key for i, round_ in enumerate(rounds) if i != place]
    keys = [candidate.key for candidate in rival.fit.structure.effects]
    if [key for key in keys if key != rival.candidate.key] != others:
        return None
    fit = coarsened(rival.fit) if rival.fit.structure.coarse else rival.fit
    at, out = keys.index(rival.candidate.key), [*rounds[:place], *rounds[place + 1:]]
    out.insert(at, replace(rounds[place], best=replace(rival, fit=fit), contenders=()))
    out[-1] = replace(out[-1], best=replace(out[-1].best, fit=fit))
    return tuple(out), at
