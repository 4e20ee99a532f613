"""With several effects, the first was chosen before the others were known: choose every one again, given the others."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ...errors import Diverged, InputError
from ..evidence import BIC_GAP, score
from ..fit import Refit, Whitened, extended, relinearized
from ._decide import Accepted, settled
from ._short_list import Entry, delta_bic, quantities_of, refit_short_list

_SWEEPS = 2
_LENGTH = 4
_EVALUATIONS = 20  # without an effect: where it is strong the misfit is large, and need not be polished
_SURE = 8.0  # standard deviations of a size that is certainly worth a ΔBIC of 10


def revised(rounds: tuple[Accepted, ...], nominal: Refit, effects: Iterable[str] | None, *, last_is_new: bool = False,
            share: float = 0.0) -> tuple[tuple[Accepted, ...], Refit]:
    """Choose each effect again with the others in place, until none changes; drop what is not needed any more.

    Parameters
    ----------
    rounds : tuple of Accepted
        In order of acceptance.
    nominal : Refit
        Without any effect.
    effects : iterable of str, optional
        Effects of the catalog to try.
    last_is_new : bool
        Whether the last one was chosen a moment ago with the others in place, and need not be again at first.
    share : float
        Of the misfit beyond noise, that choosing each of them once has to remove for doing it a second time.
    """
    names = None if effects is None else list(effects)
    fit = rounds[-1].best.fit
    decisions = list(rounds)
    for _ in range(_SWEEPS):
        before, n = fit, len(decisions)
        decisions, fit, changed = _swept(decisions, fit, nominal, names, last_is_new)
        last_is_new = len(decisions) == n  # chosen a moment ago, beside the others as they are: none was dropped
        if not changed or (share > 0.0 and _removed(before, fit) < share):
            break
    kept, less = needed(tuple(decisions), fit, nominal)
    return revised(kept, nominal, names) if 0 < len(kept) < len(decisions) else (kept, less)


def _swept(rounds: Sequence[Accepted], fit: Refit, nominal: Refit, names: list[str] | None, last_is_new: bool
           ) -> tuple[list[Accepted], Refit, bool]:
    """Each effect chosen again, the last one first, until one is dropped; whether any is another one now."""
    decisions, changed = list(rounds), False
    for place in range(len(decisions) - 1 - last_is_new, -1, -1):
        again = _chosen_again(decisions, fit, place, nominal, names)
        if again is None:
            continue
        old = decisions.pop(place)
        if isinstance(again, Refit):
            return decisions, again, True
        # the effect chosen again stands last in the new structure: keep the order of the decisions the same
        decisions.append(again)
        fit = again.best.fit
        changed = changed or again.best.candidate.key != old.best.candidate.key
    return decisions, fit, changed


def _removed(before: Refit, after: Refit) -> float:
    """Share of the misfit beyond noise that is gone, with the filters that were there before."""
    power = float(np.sum(Whitened(after.structure, before.whiteners).residual(after.v) ** 2))
    return (before.rss - power) / max(before.rss - before.n_readings, 1e-9)


def _chosen_again(rounds: Sequence[Accepted], fit: Refit, place: int, nominal: Refit, names: list[str] | None
                  ) -> Accepted | Refit | None:
    """One effect chosen again beside the others; the fit to them alone where none is needed; None without a fit."""
    before = without(fit, place, nominal, rounds[place].before)
    if before is None:
        return None
    old = rounds[place].best
    short = refit_short_list(before, score(before, names), length=_LENGTH, tried=old.candidate.key)
    entries = _with_the_accepted(short.entries, replace(old, fit=fit), place, before)
    if entries[0].delta_bic < BIC_GAP:
        return before
    before.without_derivatives()
    return settled(before, entries)


def needed(rounds: tuple[Accepted, ...], fit: Refit, nominal: Refit) -> tuple[tuple[Accepted, ...], Refit]:
    """Without effects that are not worth ΔBIC 10 in the end: beside one chosen later, one may shrink to nothing.

    Parameters
    ----------
    rounds : tuple of Accepted
        In the order of the effects of the fit.
    fit, nominal : Refit
        With them, without any.
    """
    for place in range(len(rounds)):
        value, std = quantities_of(fit, place)[fit.structure.effects[place].effect.size.name]
        if abs(value) > _SURE * std:
            continue
        less = without(fit, place, nominal, rounds[place].before)
        if less is not None and delta_bic(less, fit) < BIC_GAP:
            kept = [round_ for at, round_ in enumerate(rounds) if at != place]
            if kept:
                kept[-1] = replace(kept[-1], best=replace(kept[-1].best, fit=less))
            return needed(tuple(kept), less, nominal)
    return rounds, fit


def _with_the_accepted(entries: tuple[Entry, ...], accepted: Entry, place: int, before: Refit) -> tuple[Entry, ...]:
    """The list with the accepted effect as it is: far from the truth its score may be too low to be listed."""
    fit = accepted.fit
    values = fit.structure.quantities(fit.v)
    structure = before.structure.with_effect(fit.structure.effects[place])
    v = structure.carried(fit.structure, fit.v, [*values[:place], *values[place + 1:], values[place]])
    again = extended(before, structure, v)
    own = replace(accepted, fit=again, delta_bic=delta_bic(before, again))
    twice = [entry for entry in entries if entry.candidate.key == own.candidate.key]
    if any(entry.delta_bic >= own.delta_bic for entry in twice):
        return entries
    others = [entry for entry in entries if entry.candidate.key != own.candidate.key]
    return tuple(sorted([own, *others], key=lambda entry: -entry.delta_bic))


def without(fit: Refit, place: int, nominal: Refit, before: Refit | None = None, *, from_both: bool = False
            ) -> Refit | None:
    """The fit without one of its effects; None where another acts on a part that this one adds, or nothing survives.

    Parameters
    ----------
    fit : Refit
        With all effects.
    place : int
        Of the effect to leave out.
    nominal : Refit
        Fit without any effect.
    before : Refit, optional
        From which the effect was chosen; if it had the other effects, its unknowns are a start, too.
    from_both : bool
        Fit from either start and keep the better fit, where it is an answer; else from the start that leaves less.
    """
    effects, values = fit.structure.effects, fit.structure.quantities(fit.v)
    others = effects[:place] + effects[place + 1:]
    try:
        structure = nominal.structure.with_effects(others)
        starts = [structure.carried(fit.structure, fit.v, values[:place] + values[place + 1:])]
        if before is not None and [c.unknowns for c in before.structure.effects] == [c.unknowns for c in others]:
            starts.append(structure.carried(before.structure, before.v, before.structure.quantities(before.v)))
        problem = Whitened(structure, fit.whiteners)
        if not from_both and len(starts) > 1:
            starts = [min(starts, key=lambda v: float(np.sum(problem.residual(v) ** 2)))]
        fits = [extended(fit, structure, v, _EVALUATIONS) for v in starts]
        return relinearized(min(fits, key=lambda one: one.rss))
    except (Diverged, InputError):
        return None
